// Meshes through the whole repair, in tests of its parts.
#pragma once

#include <gtest/gtest.h>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/repair/mesh_repair.h"

namespace sunder::testing {

constexpr RepairSettings kKeep{.mode = RepairMode::keep};

struct Repaired {
    TriMesh mesh;
    std::vector<std::string> warnings;
};

/// A solid, or the test fails.
inline Repaired repaired(const TriMesh& mesh, const RepairSettings& settings = kKeep) {
    Repaired r;
    Result<RepairedMesh> result = repair_mesh(mesh, settings, "mesh", r.warnings);
    EXPECT_TRUE(result) << (result ? "" : result.error().text());
    if (result) r.mesh = std::move(result->mesh);
    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
    return r;
}

inline Error refused(const TriMesh& mesh, const RepairSettings& settings = kKeep) {
    std::vector<std::string> warnings;
    const Result<RepairedMesh> result = repair_mesh(mesh, settings, "mesh", warnings);
    EXPECT_FALSE(result);
    return result ? Error() : result.error();
}

inline bool tells(const Repaired& r, const std::string& text) {
    for (const std::string& warning : r.warnings)
        if (warning.find(text) != std::string::npos) return true;
    return false;
}

}  // namespace sunder::testing
