// body: gives fragments a material and a place.
#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

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
    return body;
}

ContentKey placed_key(CookContext& context, const Parameters& p) {
    KeyHasher hasher;
    hasher.add(context.node()).add(context.input_key("fragments")).add(p.number("density"));
    for (const char* name : {"position", "rotation", "velocity", "angular_velocity"}) hasher.add(p.vector3(name));
    return hasher.key();
}

Material material_of(const Parameters& p) {
    Material m;
    m.youngs_modulus = p.number("youngs_modulus");
    m.poisson_ratio = p.number("poisson_ratio");
    m.damping_time = p.number("damping_time");
    m.yield = p.number_or("yield", kNever);
    m.flow_rate = p.number("flow_rate");
    m.hardening = p.number("hardening");
    m.toughness = p.number_or("toughness", kNever);
    m.compressive_toughness = p.number_or("compressive_toughness", kNever);
    m.stiffness = p.number("stiffness");
    m.friction = p.number("friction");
    m.restitution = p.number("restitution");
    return m;
}

Result<Value> cook(CookContext& context) {
    const Parameters& p = context.parameters();
    Placed& placed = context.store().get<Placed>();
    const ContentKey key = placed_key(context, p);
    if (placed.key != key || !placed.value.rest) {
        Result<BodyValue> value = place(context, p, key);
        if (!value) return value.error();
        placed = {key, value.take()};
    }
    BodyValue body = placed.value;
    body.material = material_of(p);
    if (Status ok = body.material.check("node '" + context.node() + "'"); !ok) return ok.error();
    return make_value(std::move(body));
}

ParameterDescription material(ParameterDescription parameter) {
    parameter.animatable = true;
    return parameter;
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
        {.name = "density",
         .label = "Density",
         .unit = "kg/m3",
         .min = 0,
         .max = 1e6,
         .min_excluded = true,
         .default_value = 1000.0,
         .sentence = "Mass per volume"},
        material({.name = "youngs_modulus",
                  .label = "Young's Modulus",
                  .unit = "Pa",
                  .min = 0,
                  .max = 1e12,
                  .min_excluded = true,
                  .default_value = 2e5,
                  .sentence = "Stiffness: stress per stretch (rubber 1e6, wood 1e10, steel 2e11)"}),
        material({.name = "poisson_ratio",
                  .label = "Poisson's Ratio",
                  .min = 0,
                  .max = 0.45,
                  .default_value = 0.0,
                  .sentence = "Thinning across per stretch along; solids keep their volume better as it nears 0.5"}),
        material({.name = "damping_time",
                  .label = "Damping Time",
                  .unit = "s",
                  .min = 0,
                  .max = 1,
                  .default_value = 2e-3,
                  .sentence = "Damping inside the material, stress by strain rate over stiffness: a free vibration of "
                              "period T falls by exp(-2 pi^2 x this / T) each time. Where something touches, "
                              "substeps longer than this damp more by themselves; none in gauss_seidel"}),
        // Not animatable: it is where each group's own yield starts, which then lives in the state and hardens.
        {.name = "yield",
         .label = "Yield",
         .min = 0,
         .min_excluded = true,
         .default_value = nullptr,
         .sentence = "Change of shape (logarithmic strain without its change of volume) from which it stays dented; "
                     "null: never",
         .nullable = true},
        material({.name = "flow_rate",
                  .label = "Flow Rate",
                  .unit = "1/s",
                  .min = 0,
                  .max = 1e6,
                  .default_value = 30.0,
                  .sentence = "How fast strain beyond the yield becomes permanent: its share per second"}),
        material({.name = "hardening",
                  .label = "Hardening",
                  .min = 0,
                  .max = 1e3,
                  .default_value = 0.0,
                  .sentence = "Growth of the yield per permanent strain"}),
        material({.name = "toughness",
                  .label = "Toughness",
                  .min = 0,
                  .min_excluded = true,
                  .default_value = nullptr,
                  .sentence = "Stretch (principal logarithmic strain) at which it tears; null: never",
                  .nullable = true}),
        material({.name = "compressive_toughness",
                  .label = "Compressive Toughness",
                  .min = 0,
                  .min_excluded = true,
                  .default_value = nullptr,
                  .sentence = "Squeeze (principal logarithmic strain) at which it is crushed; null: never",
                  .nullable = true}),
        material({.name = "stiffness",
                  .label = "Stiffness",
                  .min = 0,
                  .max = 1,
                  .default_value = 1.0,
                  .sentence =
                      "Of the solver's method gauss_seidel alone: share of the way to the goal shape per iteration"}),
        friction_parameter(Animation::animatable),
        restitution_parameter(Animation::animatable)};
    return {.description = d, .cook = cook};
}

}  // namespace sunder
