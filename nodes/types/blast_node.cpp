// blast: momentum that everything is given at once, away from a place.
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

Shadow shadow_of(const std::string& name) {
    return name == "all" ? Shadow::all : name == "solids" ? Shadow::solids : Shadow::none;
}

// Where its place or strength moves, that of its frame counts.
Result<Value> cook_blast(CookContext& context) {
    const int frame = context.parameters().integer("frame");
    if (context.frame() != frame + 1) return local_force(context, Nothing{frame});
    const Parameters& p = context.parameters(frame);
    Blast blast;
    blast.center = p.vector3("position");
    blast.falloff = falloff_of(p);
    if (p.text("strength") == "energy")
        blast.energy = p.number("energy");
    else
        blast.speed = p.number("speed");
    if (p.text("spread") == "cone") {
        if (Status ok = check_direction(context.node(), p, "direction"); !ok) return ok.error();  // between two keys
        blast.direction = p.vector3("direction").normalized();
        blast.least_cosine = math::cos(radians(Vec3::Constant(p.number("angle"))).x());
    }
    blast.shadow = shadow_of(p.text("shadow"));
    if (!(blast.energy > 0 || blast.speed > 0)) return local_force(context, Nothing());
    return local_force(context, blast);
}

Status check_blast(const std::string& node, const Parameters& p) {
    return p.text("spread") == "cone" ? check_direction(node, p, "direction") : Status();
}

std::vector<ParameterDescription> blast_parameters() {
    std::vector<ParameterDescription> all = {
        {.name = "frame",
         .label = "Frame",
         .type = ParameterType::integer,
         .default_value = 1,
         .sentence = "When it goes off: the state of this frame is the last before it"},
        position_parameter(Animation::animatable, "Its centre; where it moves, that of its frame counts"),
        {.name = "strength",
         .label = "Strength",
         .type = ParameterType::choice,
         .default_value = "speed",
         .sentence =
             "speed: everything is given a velocity, whatever it weighs; energy: the same, and as fast as makes "
             "that energy of all that it reaches",
         .choices = {"speed", "energy"}},
        {.name = "speed",
         .label = "Speed",
         .unit = "m/s",
         .min = 0,
         .max = 1e4,
         .default_value = 10.0,
         .sentence = "Given at the radius, where it is largest",
         .needs = {{is("strength", {"speed"})}}},
        {.name = "energy",
         .label = "Energy",
         .unit = "J",
         .min = 0,
         .max = 1e15,
         .default_value = 1000.0,
         .sentence = "Kinetic energy that all would be given if nothing moved before",
         .needs = {{is("strength", {"energy"})}}}};
    for (ParameterDescription& p : falloff_parameters()) all.push_back(std::move(p));
    all.insert(
        all.end(),
        {{.name = "spread",
          .label = "Spread",
          .type = ParameterType::choice,
          .default_value = "all",
          .sentence = "all: to all sides; cone: to those around a direction",
          .choices = {"all", "cone"},
          .group = "Direction"},
         in_group("Direction",
                  needing({{is("spread", {"cone"})}},
                          direction_parameter(Animation::animatable, "direction", "Direction", "Middle of the cone"))),
         {.name = "angle",
          .label = "Angle",
          .unit = "degrees",
          .min = 0,
          .max = 180,
          .min_excluded = true,
          .default_value = 45.0,
          .sentence = "Between the middle of the cone and its side",
          .group = "Direction",
          .needs = {{is("spread", {"cone"})}}},
         {.name = "shadow",
          .label = "Shadow",
          .type = ParameterType::choice,
          .default_value = "none",
          .sentence = "What keeps it from things that lie behind: nothing; solids, which are colliders and rigid "
                      "bodies; all, fragments too",
          .choices = {"none", "solids", "all"},
          .group = "Reach"}});
    return all;
}

}  // namespace

NodeType blast_node() {
    NodeDescription d{.type = "blast",
                      .label = "Blast",
                      .category = "simulation",
                      .sentence = "Throws everything away from a place, at once: an explosion. What pins hold stays."};
    d.outputs = {force_output()};
    d.parameters = blast_parameters();
    return {.description = d, .cook = cook_blast, .check = check_blast, .depends_on_frame = true};
}

}  // namespace sunder
