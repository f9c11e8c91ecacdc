// What must hold for every cut along Voronoi cells, told as sentences.
#pragma once

#include <algorithm>
#include <map>
#include <sstream>
#include <string>

#include "fracture_tools/cells/cell_complex.h"
#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"

namespace sunder::testing {

/// Coordinates are rounded once or twice on their way: a dozen units in the last place of the box's size.
constexpr double kRounding = 1e-12;

/// First fault of the pieces: closed, manifold, in one part, and together the solid's volume and surface. Empty: none.
inline std::string fault_of_pieces(const TriMesh& solid, const FragmentSet& set) {
    std::ostringstream fault;
    double volume = 0;
    for (uint32_t i = 0; i < set.fragments.size(); ++i) {
        const TriMesh piece = fragment_mesh(set, FragmentId(i));
        const MeshReport r = check_mesh(piece);
        if (!r.is_solid()) fault << "piece " << i << ": " << (r.faults.empty() ? "no volume" : r.faults[0]) << "; ";
        volume += r.volume;
    }
    if (std::abs(volume - mesh_volume(solid)) > 1e-10 * mesh_volume(solid))
        fault << "volume " << volume << " instead of " << mesh_volume(solid) << "; ";
    TriMesh outer;
    outer.positions = set.vertices, outer.triangles = set.outer_triangles;
    const MeshReport r = check_mesh(outer);
    if (r.open_edges + r.non_manifold_edges + r.inconsistent_edges > 0)
        fault << "the outer surface: " << r.faults[0] << "; ";
    if (std::abs(r.area - mesh_area(solid)) > 1e-10 * mesh_area(solid)) fault << "area " << r.area << "; ";
    for (size_t k = 0; k < set.interfaces.size(); ++k)
        if (!(set.interfaces[k].a < set.interfaces[k].b) || std::abs(set.interfaces[k].normal.norm() - 1) > kRounding)
            fault << "interface " << k << "; ";
    return fault.str();
}

/// First fault of a complex before cells are merged: each vertex is nearest to the sites of the cells that have it
/// (looked up among all sites), interfaces are in their planes, outer corners where their weights say and on the mesh.
inline std::string fault_of_cells(const TriMesh& solid, const CellComplex& complex) {
    std::ostringstream fault;
    Aabb box;
    for (const Vec3& p : solid.positions) box.extend(p);
    // Far from the origin coordinates are rounded by their own size, not by the solid's.
    const double size = box.max.cwiseAbs().cwiseMax(box.min.cwiseAbs()).maxCoeff(),
                 near = 1e-11 * size;  // distances: roots of rounded squares
    std::vector<double> nearest(complex.vertices.size(), HUGE_VAL);
    auto distance = [&](uint32_t v, const Vec3& site) { return (complex.vertices[v] - site).norm(); };
    for (const CellFace& f : complex.faces)
        for (uint32_t v : f.vertices)
            if (nearest[v] == HUGE_VAL)
                for (const Vec3& s : complex.cell_site) nearest[v] = std::min(nearest[v], distance(v, s));
    std::map<uint32_t, double> covered;  // area of each source triangle
    for (size_t k = 0; k < complex.faces.size(); ++k) {
        const CellFace& f = complex.faces[k];
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = f.vertices[c];
            if (distance(v, complex.cell_site[f.cell]) > nearest[v] + near) fault << "face " << k << " is far out; ";
            if (f.neighbour != CellFace::kOutside) {
                const Vec3 &a = complex.cell_site[f.cell], &b = complex.cell_site[f.neighbour];
                const double off = (complex.vertices[v] - 0.5 * (a + b)).dot((b - a).normalized());
                if (std::abs(off) > kRounding * std::max(size, a.norm() + b.norm()))
                    fault << "face " << k << " is off its plane; ";
                continue;
            }
            const Triangle& t = solid.triangles[f.source_triangle];
            Vec3 p = Vec3::Zero();
            for (int m = 0; m < 3; ++m) p += complex.source_weights[k][c][m] * solid.positions[t[m]];
            const double sum = complex.source_weights[k][c].sum();
            if ((p - complex.vertices[v]).norm() > kRounding * size || std::abs(sum - 1) > kRounding ||
                complex.source_weights[k][c].minCoeff() < 0)
                fault << "corner " << c << " of face " << k << " has left its triangle; ";
        }
        if (f.neighbour == CellFace::kOutside)
            covered[f.source_triangle] += complex.face_area(f);
        else if (!(f.cell < f.neighbour))
            fault << "face " << k << " is the wrong way round; ";
    }
    for (uint32_t t = 0; t < solid.triangles.size(); ++t) {
        const auto& [a, b, c] = solid.triangles[t];
        const double area =
            0.5 * (solid.positions[b] - solid.positions[a]).cross(solid.positions[c] - solid.positions[a]).norm();
        if (std::abs(covered[t] - area) > kRounding * size * size) fault << "triangle " << t << " is not covered; ";
    }
    return fault.str();
}

}  // namespace sunder::testing
