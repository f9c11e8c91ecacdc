// guide: draws the fragments of a body to a pose.
#include <algorithm>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

using Targets = std::shared_ptr<const std::vector<Pose>>;

// x -> pivot + position + R (x - pivot)
Pose target_pose(const Parameters& p) {
    const Vec3 pivot = p.vector3("pivot");
    Pose pose = pose_of(p);
    pose.position += pivot - pose.orientation * pivot;
    return pose;
}

Result<Targets> targets_of(CookContext& context, const BodyValue& body, double frame) {
    const Result<std::vector<Value>> wired = context.inputs("state", frame);
    if (!wired) return wired.error();
    if (wired->empty())
        return context.error("state", "no state is wired", "target 'state' takes one of another solver");
    const StateValue& state = *std::get<std::shared_ptr<const StateValue>>(wired->front());
    const auto there = std::ranges::find(state.scene->bodies, body.name, &Body::name);
    const size_t n = body.rest->n_particles();
    if (there == state.scene->bodies.end() || there->particle_end - there->particle_begin != n)
        return context.error("state", "has no body '" + body.name + "' of " + std::to_string(n) + " fragments",
                             "wire a solver that moves the same body");
    const SimulationMesh& rest = state.scene->rest;
    auto targets = std::make_shared<std::vector<Pose>>(n);
    for (uint32_t i = there->particle_begin; i < there->particle_end; ++i)
        targets->at(rest.fragment[i]) = {
            state.state->position[i],
            (state.state->orientation[i] * rest.rest_orientation[i].conjugate()).normalized()};
    return Targets(std::move(targets));
}

Result<Value> cook_guide(CookContext& context) {
    const Result<std::shared_ptr<const BodyValue>> body = context.input<BodyValue>("body", context.start_frame());
    if (!body) return body.error();
    Guide guide;
    guide.pose.begin = target_pose(context.parameters(context.frame() - 1));
    const Parameters& p = context.parameters();
    guide.pose.end = target_pose(p);
    guide.pose.pivot = p.vector3("pivot");
    guide.rate = p.number("strength");
    if (p.text("target") == "state") {
        const Result<Targets> targets = targets_of(context, **body, p.integer("target_frame"));
        if (!targets) return targets.error();
        guide.targets = *targets;
    }
    if (!(guide.rate > 0)) return local_force(context, Nothing(), 0, (*body)->name);
    return local_force(context, guide, 0, (*body)->name);
}

}  // namespace

NodeType guide_node() {
    NodeDescription d{
        .type = "guide",
        .label = "Guide",
        .category = "simulation",
        .sentence =
            "Draws the fragments of a body to a pose: back to where they were, or to where they shall be. What "
            "pins hold stays."};
    d.inputs = {
        {.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The body that is drawn"},
        {.name = "state",
         .label = "State",
         .type = SocketType::state,
         .required = false,
         .sentence = "Of another solver that moves the same body: a frame of it is where fragments are drawn to"}};
    d.outputs = {force_output()};
    d.parameters = {{.name = "strength",
                     .label = "Strength",
                     .unit = "1/s",
                     .min = 0,
                     .max = 1e3,
                     .default_value = 2.0,
                     .sentence = "How fast: what is free has come most of the way in 4 / strength; 0: not at all",
                     .animatable = true},
                    {.name = "target",
                     .label = "Target",
                     .type = ParameterType::choice,
                     .default_value = "rest",
                     .sentence = "rest: as placed at the first frame; state: as at a frame of the state",
                     .choices = {"rest", "state"}},
                    {.name = "target_frame",
                     .label = "Target Frame",
                     .type = ParameterType::integer,
                     .default_value = 1,
                     .sentence = "Of the state",
                     .needs = {{is("target", {"state"})}}},
                    position_parameter(Animation::animatable, "How far the target is moved from there"),
                    rotation_parameter(Animation::animatable, "How far the target is turned about the pivot"),
                    {.name = "pivot",
                     .label = "Pivot",
                     .type = ParameterType::vector3,
                     .unit = "m",
                     .default_value = {0.0, 0.0, 0.0},
                     .sentence = "Point about which the rotation turns"}};
    gather(d.parameters, "Motion", {"position", "rotation", "pivot"});
    return {.description = d, .cook = cook_guide, .depends_on_frame = true};
}

}  // namespace sunder
