// Values as hosts read them: arrays by name with shape and type, and what is not an array as JSON.
//
// Particles come as (w, x, y, z) quaternions and row-major matrices. A name means the same thing in every value:
//   state        position orientation velocity angular_velocity plastic_deformation plastic_curvature yield strain
//                group_rotation body fragment piece asleep edges edge_intact edge_damage edge_toughness toughness (of
//                particles, what tears them: body_edges.h) broken_edge broken_time
//                broken_strain broken_toughness broken_by (kind as Pusher::Kind, number; of nothing -1) rigid_position
//                rigid_orientation rigid_velocity rigid_angular_velocity, and of the scene at rest what a body has
//   body         rest_position rest_orientation radii volume mass edges edge_area edge_toughness_factor
//                edge_toughness edge_middle edge_normal edge_share (body_edges.h) cluster
//   fragments    rest_position rest_orientation radii volume cluster toughness_factor yield_factor density_factor
//                edges interface_area interface_normal interface_centroid interface_toughness_factor
//   mesh, visual_mesh   positions triangles normals uvs colors (by corner) face_material;
//                visual: rim (by corner) face_interface face_fragment face_hidden vertex_fragment velocities
//                accelerations
//                layers: point_float:NAME corner_uv:NAME ..., whole numbers as int32
//                (fracture_tools/mesh/layer_property.h)
//   pin          particles
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/files/state_file.h"
#include "nodes/graph/description.h"
#include "nodes/graph/value.h"
#include "solver/data/result.h"

namespace sunder {

enum class ArrayType { uint8, int32, uint32, float32, float64 };

struct ArrayView {
    ArrayType type = ArrayType::float64;
    std::vector<uint64_t> shape;        // row-major, without gaps
    const void* data = nullptr;         // of the value, or of `owner`; nullptr if there are no elements
    std::shared_ptr<const void> owner;  // keeps `data`
};

std::vector<std::string> array_names(const Value& value);

/// The view holds as long as `value` (or its copies) and the view's owner live. Errors: unknown name (permitted ones
/// named).
Result<ArrayView> value_array(const Value& value, std::string_view name);

/// Names, counts, poses, materials: whatever is no array.
Json value_info(const Value& value);

/// A value made of one: "fragment_mesh" of fragments gives fragment `index` as a mesh. Errors: unknown name, index out
/// of range.
Result<Value> value_part(const Value& value, std::string_view name, uint64_t index);

/// A state frame from disk as a value, its scene holding only what the file tells: particles, edges, bodies.
Value state_value(StateFile file);

}  // namespace sunder
