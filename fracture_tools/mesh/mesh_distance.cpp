#include "fracture_tools/mesh/mesh_distance.h"

#include <openvdb/tools/MeshToVolume.h>
#include <tbb/task_arena.h>

namespace sunder {
namespace {

using openvdb::Vec3I;
using openvdb::Vec3s;

std::vector<float> convert(const MeshView& mesh, const GridNodes& grid, float band, int flags) {
    // In voxels from the first node, in doubles until there: coordinates of 1e6 lose nothing.
    std::vector<Vec3s> points;
    std::vector<Vec3I> triangles;
    points.reserve(mesh.positions.size());
    triangles.reserve(mesh.triangles.size());
    for (const Vec3& p : mesh.positions) {
        const Vec3f x = ((p - grid.origin) / grid.voxel_size).cast<float>();
        points.emplace_back(x.x(), x.y(), x.z());
    }
    for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);

    const auto& [nx, ny, nz] = grid.nodes;
    std::vector<float> distance;
    distance.reserve(size_t(nx) * ny * nz);
    // One thread, whatever there are: two gave the same bits when tried, but OpenVDB does not promise it. The adapter
    // and the grid are of the types that the library holds compiled.
    tbb::task_arena(1).execute([&] {
        openvdb::util::NullInterrupter never;
        const auto volume = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
            never, openvdb::tools::QuadAndTriangleDataAdapter<Vec3s, Vec3I>(points, triangles),
            *openvdb::math::Transform::createLinearTransform(1.0), band, band,
            flags | openvdb::tools::DISABLE_RENORMALIZATION);
        const auto values = volume->getConstAccessor();
        for (int i = 0; i < int(nx); ++i)
            for (int j = 0; j < int(ny); ++j)
                for (int k = 0; k < int(nz); ++k) distance.push_back(values.getValue({i, j, k}));
    });
    return distance;
}

}  // namespace

std::vector<float> signed_distances(const MeshView& mesh, const GridNodes& grid, float band) {
    return convert(mesh, grid, band, 0);
}

std::vector<float> unsigned_distances(const MeshView& mesh, const GridNodes& grid, float band) {
    return convert(mesh, grid, band, openvdb::tools::UNSIGNED_DISTANCE_FIELD);
}

}  // namespace sunder
