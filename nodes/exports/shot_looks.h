// looks.json beside a bake: what a host shows for what is simulated. Exports read it; nothing that is baked depends on
// it.
#pragma once

#include <array>
#include <compare>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "solver/data/result.h"

namespace sunder {

inline constexpr const char* kLooksName = "looks.json";

/// A material as every format has it.
struct Surface {
    std::string name;
    std::array<double, 4> color = {0.7, 0.7, 0.7, 1};        // linear red, green, blue; alpha
    double metallic = 0, roughness = 0.8, transmission = 0;  // 0 .. 1
    bool takes_vertex_colors = true;                         // instead of `color`, where the mesh has some
    bool takes_vertex_alpha = false;  // and some of those are seen through; surfaces_of() finds out

    auto operator<=>(const Surface&) const = default;
};

/// Of one node: a body, rigid body or collider.
struct Look {
    std::string name;                 // what artists call it; empty: as the node
    std::string mesh;                 // file below the bake folder, in the frame of the node's shape; empty: the shape
    std::vector<Surface> surfaces;    // by material number; may be too few
    std::optional<Surface> interior;  // of a body's break surfaces
};

/// By node. Empty if there is no looks.json. Errors: it is no JSON, or a field has another type than docs/files.md
/// says.
Result<std::map<std::string, Look>> read_looks(const std::filesystem::path& bake_folder);

}  // namespace sunder
