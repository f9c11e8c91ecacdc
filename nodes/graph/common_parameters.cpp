#include "nodes/graph/common_parameters.h"

#include <numbers>

#include "nodes/files/compression.h"
#include "nodes/graph/field_parameters.h"
#include "solver/data/rotations.h"
#include "solver/scene/scene_fields.h"

namespace sunder {

ParameterDescription position_parameter(Animation animation, std::string sentence) {
    return {.name = "position",
            .label = "Position",
            .type = ParameterType::vector3,
            .unit = "m",
            .default_value = {0.0, 0.0, 0.0},
            .sentence = std::move(sentence),
            .animatable = animation == Animation::animatable};
}

ParameterDescription rotation_parameter(Animation animation, std::string sentence) {
    return {.name = "rotation",
            .label = "Rotation",
            .type = ParameterType::vector3,
            .unit = "degrees",
            .default_value = {0.0, 0.0, 0.0},
            .sentence = std::move(sentence) + "; Euler angles XYZ: about x first, then y, then z",
            .animatable = animation == Animation::animatable};
}

ParameterDescription surface_parameter(std::string_view name) {
    ParameterDescription parameter = in_group("Contact", parameter_of(*find_field(material_fields(), name)));
    parameter.animatable = false;
    return parameter;
}

ParameterDescription velocity_parameter() {
    return {.name = "velocity",
            .label = "Velocity",
            .type = ParameterType::vector3,
            .unit = "m/s",
            .min = -1e4,
            .max = 1e4,
            .default_value = {0.0, 0.0, 0.0},
            .sentence = "Velocity at the first frame"};
}

ParameterDescription angular_velocity_parameter() {
    return {
        .name = "angular_velocity",
        .label = "Angular Velocity",
        .type = ParameterType::vector3,
        .unit = "degrees/s",
        .min = -1e6,
        .max = 1e6,
        .default_value = {0.0, 0.0, 0.0},
        .sentence = "Rate of turning at the first frame, about the centre of mass: its axis times degrees per second"};
}

ParameterDescription settle_parameter() {
    return {.name = "settle",
            .label = "Settle",
            .type = ParameterType::boolean,
            .default_value = false,
            .sentence =
                "Comes to rest under its own weight before the first frame, where nothing breaks and what does "
                "not settle stands still. Else its weight arrives all at once"};
}

Vec3 radians(const Vec3& degrees) { return degrees * (std::numbers::pi / 180); }

ParameterDescription radius_parameter(std::string sentence) {
    return {.name = "radius",
            .label = "Radius",
            .unit = "m",
            .min = 0,
            .max = 1e5,
            .min_excluded = true,
            .default_value = 0.5,
            .sentence = std::move(sentence)};
}

ParameterDescription size_parameter() {
    return {.name = "size",
            .label = "Size",
            .type = ParameterType::vector3,
            .unit = "m",
            .min = 0,
            .max = 1e5,
            .min_excluded = true,
            .default_value = {1.0, 1.0, 1.0},
            .sentence = "Lengths of the box's sides"};
}

std::vector<ParameterDescription> region_parameters(std::string sentence, std::vector<JsonValue> choices,
                                                    std::string group_sentence) {
    return {{.name = "region",
             .label = "Region",
             .type = ParameterType::choice,
             .default_value = "box",
             .sentence = std::move(sentence),
             .choices = std::move(choices)},
            {.name = "box_min",
             .label = "Box Min",
             .type = ParameterType::vector3,
             .unit = "m",
             .default_value = {-1.0, -1.0, -1.0},
             .sentence = "Lowest corner of the box",
             .needs = {{is("region", {"box"})}}},
            {.name = "box_max",
             .label = "Box Max",
             .type = ParameterType::vector3,
             .unit = "m",
             .default_value = {1.0, 1.0, 1.0},
             .sentence = "Highest corner of the box",
             .needs = {{is("region", {"box"})}}},
            {.name = "center",
             .label = "Center",
             .type = ParameterType::vector3,
             .unit = "m",
             .default_value = {0.0, 0.0, 0.0},
             .sentence = "Of the sphere",
             .needs = {{is("region", {"sphere"})}}},
            needing({{is("region", {"sphere"})}}, radius_parameter("Of the sphere")),
            {.name = "group",
             .label = "Group",
             .type = ParameterType::text,
             .default_value = "",
             .sentence = std::move(group_sentence),
             .needs = {{is("region", {"group"})}}}};
}

ParameterDescription direction_parameter(Animation animation, const char* name, const char* label,
                                         std::string sentence) {
    return {.name = name,
            .label = label,
            .type = ParameterType::vector3,
            .min = -1e6,
            .max = 1e6,
            .default_value = {0.0, 0.0, 1.0},
            .sentence = std::move(sentence),
            .animatable = animation == Animation::animatable};
}

Status check_direction(const std::string& node, const Parameters& p, std::string_view name) {
    if (p.vector3(name).squaredNorm() > 0) return {};
    return node_error(node, std::string(name), "has no length: it is no direction",
                      "any of its numbers above or below 0");
}

ParameterDescription cluster_parameter() {
    return {.name = "cluster",
            .label = "Cluster",
            .type = ParameterType::integer,
            .min = 0,
            .default_value = 0,
            .sentence = "Number of a cluster, as pre-fracture gathered them",
            .needs = {{is("region", {"cluster"})}}};
}

ParameterDescription sub_frames_parameter() {
    return {.name = "subframes",
            .label = "Sub-Frames",
            .type = ParameterType::integer,
            .min = 1,
            .max = kMostSubFrames,
            .default_value = 1,
            .sentence =
                "Steps from one frame to the next, each of which is written: 4 has frames 12, 12.25, 12.5, 12.75, "
                "13. What lies between is blended, and its file stands behind the frame's: 0012_250"};
}

ParameterDescription compression_parameter() {
    return {.name = "compression",
            .label = "Compression",
            .type = ParameterType::choice,
            .default_value = "none",
            .sentence =
                "zstd: files are compressed and their names end in .zst; everything of Sunder reads them as "
                "they are, other programs once `zstd -d` has unpacked them",
            .choices = {"none", "zstd"}};
}

std::string compressed_suffix(const std::string& compression) {
    return compression == "zstd" ? std::string(kCompressedSuffix) : std::string();
}

Quat euler_xyz(const Vec3& degrees) {
    const Vec3 angle = radians(degrees);
    return (rotation_about(Vec3::UnitZ(), angle.z()) * rotation_about(Vec3::UnitY(), angle.y()) *
            rotation_about(Vec3::UnitX(), angle.x()))
        .normalized();
}

Pose pose_of(const Parameters& parameters) {
    return {parameters.vector3("position"), euler_xyz(parameters.vector3("rotation"))};
}

}  // namespace sunder
