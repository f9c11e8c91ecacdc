// body: gives fragments a material and a place.
#include <algorithm>
#include <iterator>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/field_parameters.h"
#include "nodes/graph/node_list.h"
#include "solver/scene/scales.h"
#include "solver/scene/scene_fields.h"

namespace sunder {
namespace {

/// What does not change from frame to frame, kept because masses and frames are dear to compute.
struct Placed {
    ContentKey key = 0;
    BodyValue value;
};

/// Density, place and start; the material is left at its default.
Result<BodyValue> place(CookContext& context, const Parameters& p, ContentKey key) {
    Result<std::shared_ptr<const FragmentSet>> fragments = context.input<FragmentSet>("fragments");
    if (!fragments) return fragments.error();
    Result<SimulationMesh> mesh = build_simulation_mesh(**fragments, {.density = p.number("density")});
    if (!mesh) return mesh.error();
    BodyValue body;
    body.name = context.node();
    body.key = key;
    body.fragments = *fragments;
    body.pose = pose_of(p);
    SimulationMesh placed;
    append_body(placed, *mesh, body.pose);
    build_one_rings(placed);
    body.rest = std::make_shared<const SimulationMesh>(std::move(placed));
    body.velocity = p.vector3("velocity");
    body.angular_velocity = radians(p.vector3("angular_velocity"));
    body.settles = p.boolean("settle");
    return body;
}

ContentKey placed_key(CookContext& context, const Parameters& p) {
    KeyHasher hasher;
    hasher.add(context.node()).add(context.input_key("fragments")).add(p.number("density"));
    for (const char* name : {"position", "rotation", "velocity", "angular_velocity"}) hasher.add(p.vector3(name));
    if (p.boolean("settle")) hasher.add(std::string("settles"));
    return hasher.key();
}

/// All but `slender`, the last, which is a choice.
std::span<const Field<Material>> plain_fields() { return material_fields().first(material_fields().size() - 1); }

// What only shatters does so before one sees it bend.
int slender_of(const std::string& choice, const Material& m) {
    if (choice == kAutomatic) return m.yield < kNever || m.toughness == kNever ? 1 : 0;
    return choice == "always" ? 2 : 0;
}

Material material_of(const Parameters& p, const SimulationMesh& rest) {
    Material m;
    read_fields(p, plain_fields(), m);
    m.slender = slender_of(p.text("slender"), m);
    if (p.is_automatic("fracture_energy"))
        m.fracture_energy = automatic_fracture_energy(rest, m.youngs_modulus, m.toughness);
    if (p.is_automatic("damping_time")) m.damping_time = automatic_damping_time(rest, m.youngs_modulus);
    return m;
}

Result<Value> cook_body(CookContext& context) {
    const Parameters& p = context.parameters();
    Placed& placed = context.store().get<Placed>();
    const ContentKey key = placed_key(context, p);
    if (placed.key != key || !placed.value.rest) {
        Result<BodyValue> value = place(context, p, key);
        if (!value) return value.error();
        placed = {key, value.take()};
    }
    BodyValue body = placed.value;
    body.material = material_of(p, *body.rest);
    body.energy_is_automatic = p.is_automatic("fracture_energy");
    if (Status ok = body.material.check("node '" + context.node() + "'"); !ok) return ok.error();
    return make_value(std::move(body));
}

std::vector<ParameterDescription> material_parameters() {
    std::vector<ParameterDescription> parameters = parameters_of(plain_fields());
    const FieldDescription& slender = material_fields().back().description;
    parameters.push_back(
        {.name = slender.name,
         .label = slender.label,
         .type = ParameterType::choice,
         .default_value = kAutomatic,
         .sentence =
             slender.sentence +
             std::string(". \"auto\": where two to four fragments lie through the thickness of a body that yields or "
                         "never tears; \"always\": all of it"),
         .choices = {kAutomatic, "always", "never"}});
    ParameterDescription& damping_time = at(parameters, "damping_time");
    damping_time.automatic = true;
    damping_time.former_defaults = {{1, damping_time.default_value}};
    damping_time.default_value = kAutomatic;
    damping_time.sentence +=
        ". \"auto\": 0.3 of the time that a wave takes through a fragment of the body's mean size, so that what a hit "
        "sets ringing dies away as soon in stiff bodies as in soft ones, and not before they bounce";
    ParameterDescription& fracture_energy = at(parameters, "fracture_energy");
    fracture_energy.automatic = true;
    fracture_energy.former_defaults = {{1, fracture_energy.default_value}};
    fracture_energy.default_value = kAutomatic;
    fracture_energy.sentence += ". \"auto\": E toughness^2 L / 2, L a quarter of the body's longest side";
    for (const char* name : {"flow_rate", "hardening"}) at(parameters, name).needs = {{is_not_null("yield")}};
    fracture_energy.needs = {{is_not_null("toughness")}, {is_not_null("compressive_toughness")}};
    gather(
        parameters, "Material",
        {"poisson_ratio", "damping_time", "flow_rate", "compressive_toughness", "stiffness", "curvature", "slender"});
    gather(parameters, "Contact", {"friction", "restitution"});
    return parameters;
}

}  // namespace

NodeType body_node() {
    NodeDescription d{
        .type = "body",
        .label = "Body",
        .category = "simulation",
        .sentence = "Gives fragments a material, a place and a start; one set of fragments may serve many bodies."};
    d.inputs = {{.name = "fragments",
                 .label = "Fragments",
                 .type = SocketType::fragments,
                 .sentence = "What the body is made of"}};
    d.outputs = {
        {.name = "body", .label = "Body", .type = SocketType::body, .sentence = "For a solver, pins and a deformer"}};
    d.parameters = {
        position_parameter(Animation::constant, "Where the origin of the fragments is put at the first frame"),
        rotation_parameter(Animation::constant, "How the fragments are turned about their origin at the first frame"),
        velocity_parameter(),
        angular_velocity_parameter(),
        settle_parameter(),
        {.name = "density",
         .label = "Density",
         .unit = "kg/m3",
         .min = 0,
         .max = 1e6,
         .min_excluded = true,
         .default_value = 1000.0,
         .sentence = "Mass per volume"}};
    gather(d.parameters, "Start", {"position", "rotation", "velocity", "angular_velocity", "settle"});
    std::ranges::move(material_parameters(), std::back_inserter(d.parameters));
    return {.description = d, .cook = cook_body};
}

}  // namespace sunder
