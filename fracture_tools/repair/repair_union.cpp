// The only file that includes CGAL's corefinement.
#include "fracture_tools/repair/repair_union.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <vector>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/repair/repair_attributes.h"
#include "fracture_tools/repair/repair_holes.h"
#include "solver/data/disjoint_sets.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Solid = CGAL::Surface_mesh<Kernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

/// One shell, with vertices of its own.
TriMesh shell_of(const TriMesh& mesh, const Shells& shells, uint32_t shell) {
    TriMesh out;
    out.positions = mesh.positions, out.triangles = mesh.triangles;
    std::vector<uint8_t> mark;
    for (uint32_t s : shells.of_triangle) mark.push_back(s == shell);
    keep_marked(out, mark);
    return out;
}

Solid to_solid(const TriMesh& mesh) {
    std::vector<Kernel::Point_3> points;
    for (const Vec3& p : mesh.positions) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<std::array<size_t, 3>> triangles;
    for (const Triangle& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
    Solid solid;
    PMP::polygon_soup_to_polygon_mesh(points, triangles, solid);
    return solid;
}

void append(const Solid& solid, TriMesh& io_mesh) {
    const auto base = static_cast<uint32_t>(io_mesh.positions.size());
    std::vector<uint32_t> number(solid.number_of_vertices() + solid.number_of_removed_vertices());
    uint32_t n = 0;
    for (const auto v : solid.vertices()) {
        number[v.idx()] = base + n++;
        const auto& p = solid.point(v);
        io_mesh.positions.push_back(Vec3(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())));
    }
    for (const auto f : solid.faces()) {
        const auto h = solid.halfedge(f);
        io_mesh.triangles.push_back(
            {number[solid.source(h).idx()], number[solid.target(h).idx()], number[solid.target(solid.next(h)).idx()]});
    }
}

/// Groups of shells that cross, each ascending; empty where that is more than a union can do.
std::vector<std::vector<uint32_t>> crossing_groups(const TriMesh& mesh, const Shells& shells,
                                                   std::span<const std::array<uint32_t, 2>> crossing) {
    std::vector<uint32_t> group = disjoint_sets(shells.n);
    std::vector<uint8_t> crosses_itself(shells.n, 0);
    for (const auto& [t, u] : crossing) {
        const uint32_t a = shells.of_triangle[t], b = shells.of_triangle[u];
        if (a == b) crosses_itself[a] = 1;
        unite(group, a, b);
    }
    std::vector<std::vector<uint32_t>> groups(shells.n);
    for (uint32_t s = 0; s < shells.n; ++s) groups[lowest(group, s)].push_back(s);
    std::erase_if(groups, [](const auto& members) { return members.size() < 2; });
    for (const auto& members : groups)
        for (uint32_t s : members)
            if (crosses_itself[s] || mesh_volume(shell_of(mesh, shells, s)) <= 0) return {};
    return groups;
}

}  // namespace

size_t unite_shells(TriMesh& io_mesh, std::span<const std::array<uint32_t, 2>> crossing) {
    if (crossing.empty() || crossing.size() > kMostUnionCrossings) return 0;
    const Shells shells = find_shells(io_mesh);
    const std::vector<std::vector<uint32_t>> groups = crossing_groups(io_mesh, shells, crossing);
    if (groups.empty()) return 0;
    TriMesh united;
    std::vector<uint8_t> is_united(shells.n, 0);
    size_t n = 0;
    try {
        for (const std::vector<uint32_t>& members : groups) {
            Solid sum;
            for (uint32_t s : members) {
                Solid next = to_solid(shell_of(io_mesh, shells, s));
                if (!is_united[members[0]])
                    sum = std::move(next);
                else if (!PMP::corefine_and_compute_union(sum, next, sum,
                                                          CGAL::parameters::throw_on_self_intersection(true)))
                    return 0;
                is_united[s] = 1;
                ++n;
            }
            append(sum, united);
        }
    } catch (const std::exception&) {  // PMP::Corefinement::Self_intersection_exception, CGAL::Failure_exception
        return 0;
    }
    // The other shells, as they are.
    for (uint32_t s = 0; s < shells.n; ++s) {
        if (is_united[s]) continue;
        const TriMesh shell = shell_of(io_mesh, shells, s);
        const auto base = static_cast<uint32_t>(united.positions.size());
        united.positions.insert(united.positions.end(), shell.positions.begin(), shell.positions.end());
        for (const auto& [a, b, c] : shell.triangles) united.triangles.push_back({a + base, b + base, c + base});
    }
    if (!check_mesh(united).is_solid()) return 0;
    carry_cut_attributes(io_mesh, united);
    io_mesh = std::move(united);
    return n;
}

}  // namespace sunder
