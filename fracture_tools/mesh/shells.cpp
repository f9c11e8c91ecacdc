#include "fracture_tools/mesh/shells.h"

#include <Eigen/Geometry>
#include <utility>

#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"

namespace sunder {

Shells find_shells(const MeshView& mesh) {
    std::vector<uint32_t> part = disjoint_sets(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) unite(part, t[0], t[1]), unite(part, t[1], t[2]);
    std::vector<uint32_t> number(mesh.positions.size(), kNone);
    Shells shells;
    for (const Triangle& t : mesh.triangles) {
        uint32_t& n = number[lowest(part, t[0])];
        if (n == kNone) n = shells.n++;
        shells.of_triangle.push_back(n);
    }
    return shells;
}

std::vector<double> shell_volumes(const MeshView& mesh, const Shells& shells) {
    std::vector<double> volume(shells.n, 0);
    std::vector<Vec3> start(shells.n);  // each shell about a point of its own
    std::vector<uint8_t> is_begun(shells.n, 0);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const uint32_t s = shells.of_triangle[t];
        const auto& [i, j, k] = mesh.triangles[t];
        if (!std::exchange(is_begun[s], 1)) start[s] = mesh.positions[i];
        const Vec3 a = mesh.positions[i] - start[s], b = mesh.positions[j] - start[s], c = mesh.positions[k] - start[s];
        volume[s] += a.dot(b.cross(c)) / 6;
    }
    return volume;
}

}  // namespace sunder
