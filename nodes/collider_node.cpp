// collider: a solid that moves as it is told and is pushed by nothing.
#include "nodes/common_parameters.h"
#include "nodes/node_list.h"

namespace sunder {
namespace {

ShapeKind kind_of(const std::string& name) {
    if (name == "sphere") return ShapeKind::sphere;
    if (name == "box") return ShapeKind::box;
    if (name == "capsule") return ShapeKind::capsule;
    return ShapeKind::plane;
}

Result<Value> cook(CookContext& context) {
    const Parameters& p = context.parameters();
    ColliderValue value;
    value.collider.name = context.node();
    value.collider.shape.kind = kind_of(p.text("shape"));
    value.collider.shape.radius = p.number("radius");
    value.collider.shape.half_extents = p.vector3("size") / 2;
    value.collider.shape.half_height = p.number("height") / 2;
    value.collider.friction = p.number("friction");
    value.collider.restitution = p.number("restitution");
    value.pose = pose_of(p);
    return make_value(std::move(value));
}

}  // namespace

NodeType collider_node() {
    NodeDescription d{
        .type = "collider",
        .label = "Collider",
        .category = "simulation",
        .sentence = "A solid that moves as its keys tell it and is pushed by nothing: floor, wall, tool."};
    d.outputs = {{.name = "collider", .label = "Collider", .type = SocketType::collider, .sentence = "For a solver"}};
    d.parameters = {{.name = "shape",
                     .label = "Shape",
                     .type = ParameterType::choice,
                     .default_value = "plane",
                     .sentence = "plane: all below z = 0 of its own frame; sphere takes `radius`; box takes `size`; "
                                 "capsule takes `radius` and "
                                 "`height` along its z axis",
                     .choices = {"plane", "sphere", "box", "capsule"}},
                    position_parameter(Animation::animatable, "Of its centre, or of a point of the plane"),
                    rotation_parameter(Animation::animatable, "About its position"),
                    {.name = "radius",
                     .label = "Radius",
                     .unit = "m",
                     .min = 0,
                     .max = 1e5,
                     .min_excluded = true,
                     .default_value = 0.5,
                     .sentence = "Of sphere and capsule"},
                    {.name = "size",
                     .label = "Size",
                     .type = ParameterType::vector3,
                     .unit = "m",
                     .min = 0,
                     .max = 1e5,
                     .min_excluded = true,
                     .default_value = {1.0, 1.0, 1.0},
                     .sentence = "Lengths of the box's sides"},
                    {.name = "height",
                     .label = "Height",
                     .unit = "m",
                     .min = 0,
                     .max = 1e5,
                     .min_excluded = true,
                     .default_value = 1.0,
                     .sentence = "Of the capsule between the centres of its two caps"},
                    friction_parameter(Animation::constant),
                    restitution_parameter(Animation::constant)};
    return {.description = d, .cook = cook};
}

}  // namespace sunder
