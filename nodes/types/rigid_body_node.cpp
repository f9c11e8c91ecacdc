// rigid_body: a sphere or box that pushes and is pushed.
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Result<Value> cook_rigid_body(CookContext& context) {
    const Parameters& p = context.parameters();
    RigidBody body;
    body.name = context.node();
    body.shape.kind = p.text("shape") == "box" ? ShapeKind::box : ShapeKind::sphere;
    body.shape.radius = p.number("radius");
    body.shape.half_extents = p.vector3("size") / 2;
    body.mass = p.number("mass");
    body.pose = pose_of(p);
    body.velocity = p.vector3("velocity");
    body.angular_velocity = radians(p.vector3("angular_velocity"));
    body.settles = p.boolean("settle");
    body.friction = p.number("friction");
    body.restitution = p.number("restitution");
    return make_value(std::move(body));
}

}  // namespace

NodeType rigid_body_node() {
    NodeDescription d{.type = "rigid_body",
                      .label = "Rigid Body",
                      .category = "simulation",
                      .sentence = "A sphere or box that keeps its shape, pushes with its mass and is pushed."};
    d.outputs = {
        {.name = "rigid_body", .label = "Rigid Body", .type = SocketType::rigid_body, .sentence = "For a solver"}};
    d.parameters = {{.name = "shape",
                     .label = "Shape",
                     .type = ParameterType::choice,
                     .default_value = "sphere",
                     .sentence = "sphere takes `radius`, box takes `size`",
                     .choices = {"sphere", "box"}},
                    needing({{is("shape", {"sphere"})}}, radius_parameter("Of the sphere")),
                    needing({{is("shape", {"box"})}}, size_parameter()),
                    {.name = "mass",
                     .label = "Mass",
                     .unit = "kg",
                     .min = 0,
                     .max = 1e12,
                     .min_excluded = true,
                     .default_value = 1.0,
                     .sentence = "Spread evenly over the shape"},
                    position_parameter(Animation::constant, "Of the centre at the first frame"),
                    rotation_parameter(Animation::constant, "About the centre at the first frame"),
                    velocity_parameter(),
                    angular_velocity_parameter(),
                    settle_parameter(),
                    surface_parameter("friction"),
                    surface_parameter("restitution")};
    gather(d.parameters, "Start", {"position", "rotation", "velocity", "angular_velocity", "settle"});
    return {.description = d, .cook = cook_rigid_body};
}

}  // namespace sunder
