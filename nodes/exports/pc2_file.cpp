// PC2 point caches: positions of every vertex in every frame, as Blender's Mesh Cache modifier and others read them.
//
//   char[12] "POINTCACHE2\0"   int32 version 1   int32 points   float first frame   float frames a sample (1, or part)
//   int32 samples              then float x y z of each point, sample after sample
//
// Beside it goes the mesh of the first frame, whose vertices have the order of the cache.
#include "nodes/exports/shot_export.h"
#include "nodes/files/byte_buffer.h"
#include "nodes/files/mesh_frame_file.h"

namespace sunder {

Result<ExportReport> export_pc2(const Shot& shot, const ExportSettings& settings, const Progress& progress) {
    if (shot.meshes.size() != 1)
        return bad_input(settings.file.string(),
                         "a point cache holds one mesh, the shot has " + std::to_string(shot.meshes.size()),
                         "choose one with --node");
    const ShotMesh& source = shot.meshes[0];
    auto cache = FileWriter::open(settings.file);
    if (!cache) return cache.error();
    VisualMesh first;
    FragmentSet names;
    for (size_t i = 0; i < shot.frames.size(); ++i) {
        if (!progress.report(double(i) / double(shot.frames.size()), "exporting")) return cancelled();
        auto frame = source.read(i);
        if (!frame) return frame.error();
        ByteBuffer bytes;
        if (i == 0) {
            first = frame->mesh;
            bytes.append("POINTCACHE2", 12);
            bytes.number(int32_t{1}), bytes.number(static_cast<int32_t>(first.positions.size()));
            bytes.number(static_cast<float>(shot.frames[0]));
            bytes.number(static_cast<float>(1.0 / shot.subframes));
            bytes.number(static_cast<int32_t>(shot.frames.size()));
            names = material_names_of(source, *frame);
        } else if (Status s = check_constant_topology(first, frame->mesh, source.name, shot.frames[i], ".pc2"); !s) {
            return s.error();
        }
        bytes.append(frame->mesh.positions.data(), sizeof(Vec3f) * frame->mesh.positions.size());
        if (Status s = cache->append(bytes.view()); !s) return s.error();
    }
    ExportReport report;
    const std::filesystem::path mesh = companions(settings.file)[0];
    const auto mesh_stamp = write_file(mesh, encode_mesh_obj(first, names).view());
    if (!mesh_stamp) return mesh_stamp.error();
    report.files.emplace_back(mesh, *mesh_stamp);
    const auto stamp = cache->commit();
    if (!stamp) return stamp.error();
    report.files.emplace_back(settings.file, *stamp);
    return report;
}

}  // namespace sunder
