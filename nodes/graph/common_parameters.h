// Parameters that several nodes have, described once, and the values that they make.
#pragma once

#include "nodes/graph/node.h"
#include "solver/data/math.h"

namespace sunder {

enum class Animation { constant, animatable };

ParameterDescription position_parameter(Animation animation, std::string sentence);  // "position", m
ParameterDescription rotation_parameter(Animation animation, std::string sentence);  // "rotation", degrees
ParameterDescription surface_parameter(std::string_view name);  // "friction" or "restitution", as bodies have them
ParameterDescription velocity_parameter();                      // "velocity", m/s, at the start
ParameterDescription angular_velocity_parameter();              // "angular_velocity", degrees/s, at the start
ParameterDescription settle_parameter();                        // "settle", before the start

ParameterDescription radius_parameter(std::string sentence);  // "radius", m
ParameterDescription size_parameter();                        // "size" of a box, m

/// "region" with its choices, and what "box" ("box_min", "box_max"), "sphere" ("center", "radius") and "group" take.
std::vector<ParameterDescription> region_parameters(std::string sentence, std::vector<JsonValue> choices,
                                                    std::string group_sentence);

/// A direction as a parameter; `check_direction` refuses one of no length.
ParameterDescription direction_parameter(Animation animation, const char* name, const char* label,
                                         std::string sentence);
Status check_direction(const std::string& node, const Parameters& parameters, std::string_view name);

ParameterDescription cluster_parameter();  // "cluster" of a region

/// "compression" of a bake node's files.
constexpr int kMostSubFrames = 64;            // steps a frame that names of files tell apart
ParameterDescription sub_frames_parameter();  // "subframes", steps a frame
ParameterDescription compression_parameter();
/// What it adds to their names.
std::string compressed_suffix(const std::string& compression);

/// Euler angles XYZ in degrees, as Blender means them: about the fixed x axis first, then y, then z; R = R_z R_y R_x.
Quat euler_xyz(const Vec3& degrees);

/// Of the parameters "position" and "rotation".
Pose pose_of(const Parameters& parameters);

/// Degrees to radians, of each component.
Vec3 radians(const Vec3& degrees);

}  // namespace sunder
