// Shells that meshing lost (tetrahedralize.h).
#include <cmath>

#include "fracture_tools/cells/tetrahedralize.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/disjoint_sets.h"

namespace sunder {
namespace {

/// Tetrahedra are coarse: a shell is there if they have more than this share of its volume.
constexpr double kThere = 0.5;

double volume_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    return (b - a).cross(c - a).dot(d - a) / 6;
}

}  // namespace

std::vector<LostShell> find_lost_shells(const MeshView& mesh, const TetMesh& tets) {
    const Shells shells = find_shells(mesh);
    if (shells.n < 2) return {};
    std::vector<uint32_t> first(shells.n, 0);
    for (size_t t = mesh.triangles.size(); t-- > 0;) first[shells.of_triangle[t]] = mesh.triangles[t][0];
    const std::vector<double> volume = shell_volumes(mesh, shells);
    // What hangs together has the nearest shells of all its vertices as its surface.
    const SurfaceLookup lookup(mesh);
    std::vector<uint32_t> shell_at;
    for (const Vec3& p : tets.vertices) shell_at.push_back(shells.of_triangle[lookup.nearest(p).triangle]);
    std::vector<uint32_t> body = disjoint_sets(shells.n);
    std::vector<uint8_t> is_met(shells.n, 0);
    for (const auto& tet : tets.tets)
        for (uint32_t v : tet) unite(body, shell_at[tet[0]], shell_at[v]), is_met[shell_at[v]] = 1;
    std::vector<double> wanted(shells.n, 0), found(shells.n, 0);
    for (uint32_t s = 0; s < shells.n; ++s) wanted[lowest(body, s)] += volume[s];
    for (const auto& [a, b, c, d] : tets.tets)
        found[lowest(body, shell_at[a])] +=
            volume_of(tets.vertices[a], tets.vertices[b], tets.vertices[c], tets.vertices[d]);
    std::vector<LostShell> lost;
    for (uint32_t s = 0; s < shells.n; ++s) {
        const uint32_t root = lowest(body, s);
        if (is_met[s] && found[root] > kThere * wanted[root]) continue;
        lost.push_back({std::abs(volume[s]), mesh.positions[first[s]]});
    }
    return lost;
}

}  // namespace sunder
