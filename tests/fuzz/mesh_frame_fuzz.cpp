// Bytes as a mesh frame that a bake wrote: read, or refused; what was read names nothing that is not there.
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/mesh_frame_reader.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    const auto frame = decode_mesh_ply(std::string(text_of(data, size)), "file");
    if (!frame) return require_refusal(frame.error(), "file"), 0;

    const VisualMesh& mesh = frame->mesh;
    const size_t n = mesh.triangles.size();
    for (const Triangle& t : mesh.triangles)
        for (const uint32_t v : t) require(v < mesh.positions.size(), "a face names a vertex that is not there");
    for (const int32_t material : mesh.triangle_material)
        require(material >= 0 && static_cast<size_t>(material) < frame->materials.size(), "a face names no material");
    require(mesh.triangle_material.size() == n && mesh.corner_normals.size() == 3 * n, "faces do not fit");
    require(mesh.vertex_fragment.size() == mesh.positions.size(), "fragments do not fit");
    FragmentSet names;
    names.material_names.assign(frame->materials.begin(), frame->materials.end() - 1);
    names.interior_material = frame->interior_material();
    const std::string written(encode_mesh_ply(mesh, names).view());
    const auto again = decode_mesh_ply(written, "again");
    require(static_cast<bool>(again), "what was written is refused");
    require(encode_mesh_ply(again->mesh, names).view() == written, "what was written is another mesh");
    return 0;
}
