// Bytes as a PLY or OFF file: read, or refused by a sentence.
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/polygon_files.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using sunder::testing::require;

void check(const sunder::Result<sunder::TriMesh>& mesh) {
    if (!mesh) return sunder::testing::require_refusal(mesh.error(), "file");
    const size_t n = mesh->triangles.size();
    require(n > 0, "success without a triangle");
    require(mesh->corner_uvs.empty() || mesh->corner_uvs.size() == 3 * n, "UVs do not fit");
    require(mesh->corner_normals.empty() || mesh->corner_normals.size() == 3 * n, "normals do not fit");
    require(mesh->triangle_material.empty() || mesh->triangle_material.size() == n, "materials do not fit");
    const sunder::MeshReport report = check_mesh(*mesh);
    require(report.is_usable(), "a mesh that cannot be used");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view bytes = sunder::testing::text_of(data, size);
    check(sunder::read_ply(bytes, "file", 1.0));
    check(sunder::read_off(bytes, "file", 0.01));
    return 0;
}
