// The only file that includes CGAL's corefinement.
#include "fracture_tools/repair/repair_union.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <boost/optional.hpp>
#include <optional>
#include <set>
#include <vector>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/repair/repair_attributes.h"
#include "fracture_tools/repair/repair_shells.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Solid = CGAL::Surface_mesh<Kernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

/// Edges that a union leaves with more than this share of the farthest coordinate stay when they are written as floats.
constexpr double kShortest = 0x1p-22;
/// Of the volume of a union, as a share of those of its parts.
constexpr double kRounding = 1e-9;

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

void append(const TriMesh& part, TriMesh& io_mesh) {
    const auto base = static_cast<uint32_t>(io_mesh.positions.size());
    io_mesh.positions.insert(io_mesh.positions.end(), part.positions.begin(), part.positions.end());
    for (const auto& [a, b, c] : part.triangles) io_mesh.triangles.push_back({a + base, b + base, c + base});
}

TriMesh to_tri_mesh(const Solid& solid) {
    TriMesh mesh;
    std::vector<uint32_t> number(solid.number_of_vertices() + solid.number_of_removed_vertices());
    for (const auto v : solid.vertices()) {
        number[v.idx()] = static_cast<uint32_t>(mesh.positions.size());
        const auto& p = solid.point(v);
        mesh.positions.push_back(Vec3(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())));
    }
    for (const auto f : solid.faces()) {
        const auto h = solid.halfedge(f);
        mesh.triangles.push_back(
            {number[solid.source(h).idx()], number[solid.target(h).idx()], number[solid.target(solid.next(h)).idx()]});
    }
    return mesh;
}

/// Joins the ends of edges shorter than `shortest`, m, where that keeps the surface a manifold and turns no triangle
/// round. Vertices of the source stay where they are.
void collapse_short_edges(const std::set<std::array<double, 3>>& source, double shortest, Solid& io_solid) {
    constexpr int kMostPasses = 8;
    const auto place = [&](Solid::Vertex_index v) {
        const auto& p = io_solid.point(v);
        return Vec3(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z()));
    };
    // Whether triangles around a vertex, but for those of the edge, would face another way.
    const auto turns = [&](Solid::Vertex_index moved, Solid::Vertex_index other) {
        const Vec3 from = place(moved), to = place(other);
        for (const auto h : CGAL::halfedges_around_target(moved, io_solid)) {
            const auto v = io_solid.source(h), w = io_solid.target(io_solid.next(h));
            if (v == other || w == other) continue;
            const Vec3 p = place(v), q = place(w);
            const Vec3 before = (p - from).cross(q - from), after = (p - to).cross(q - to);
            if (before.norm() > shortest * (p - q).norm() && before.dot(after) <= 0) return true;
        }
        return false;
    };
    for (int pass = 0; pass < kMostPasses; ++pass) {
        bool any = false;
        const std::vector<Solid::Edge_index> edges(io_solid.edges().begin(), io_solid.edges().end());
        for (const Solid::Edge_index e : edges) {
            if (io_solid.is_removed(e)) continue;
            auto h = io_solid.halfedge(e);
            if ((place(io_solid.source(h)) - place(io_solid.target(h))).norm() >= shortest) continue;
            const auto is_source = [&](Solid::Vertex_index v) {
                const Vec3 p = place(v);
                return source.contains({p.x(), p.y(), p.z()});
            };
            if (is_source(io_solid.source(h))) h = io_solid.opposite(h);
            const Solid::Vertex_index from = io_solid.source(h), to = io_solid.target(h);
            if (is_source(from) || turns(from, to) || !CGAL::Euler::does_satisfy_link_condition(e, io_solid)) continue;
            const Kernel::Point_3 kept = io_solid.point(to);
            io_solid.point(CGAL::Euler::collapse_edge(e, io_solid)) = kept;
            any = true;
        }
        if (!any) return;
    }
}

/// Solids and the cavities in them that must become one.
struct Group {
    std::vector<uint32_t> solids;                 // shells, ascending
    std::vector<std::vector<uint32_t>> cavities;  // of each solid
    size_t n_crossings = 0;
};

/// Shells that cross, and solids with a cavity that does. A cavity belongs to the smallest solid around it.
std::vector<Group> crossing_groups(const TriMesh& mesh, const Shells& shells,
                                   std::span<const std::array<uint32_t, 2>> crossing) {
    std::vector<uint32_t> set = disjoint_sets(shells.n);
    std::vector<uint8_t> crosses(shells.n, 0), is_cavity(shells.n, 0);
    for (const auto& [t, u] : crossing) {
        const uint32_t a = shells.of_triangle[t], b = shells.of_triangle[u];
        if (a != b) crosses[a] = crosses[b] = 1;
        unite(set, a, b);
    }
    bool any_cavity = false;
    for (uint32_t s = 0; s < shells.n; ++s)
        any_cavity |= is_cavity[s] = crosses[s] && mesh_volume(shell_of(mesh, shells, s)) < 0;
    std::vector<uint32_t> owner(shells.n, kNone);
    if (any_cavity) {
        const std::vector<std::vector<uint32_t>> around = surrounding_shells(mesh, crossing);
        for (uint32_t s = 0; s < shells.n; ++s) {
            if (!is_cavity[s]) continue;
            const auto solid = std::ranges::find_if(
                around[s], [&](uint32_t outer) { return mesh_volume(shell_of(mesh, shells, outer)) > 0; });
            if (solid == around[s].end()) continue;  // it takes nothing away
            owner[s] = *solid;
            unite(set, s, *solid);
        }
    }
    std::vector<Group> groups(shells.n);
    for (const auto& [t, u] : crossing) ++groups[lowest(set, shells.of_triangle[t])].n_crossings;
    for (uint32_t s = 0; s < shells.n; ++s)
        if (!is_cavity[s]) groups[lowest(set, s)].solids.push_back(s);
    for (Group& g : groups) g.cavities.resize(g.solids.size());
    for (uint32_t s = 0; s < shells.n; ++s) {
        if (owner[s] == kNone) continue;
        Group& g = groups[lowest(set, s)];
        g.cavities[std::ranges::lower_bound(g.solids, owner[s]) - g.solids.begin()].push_back(s);
    }
    std::erase_if(groups,
                  [](const Group& g) { return g.solids.size() + (g.cavities.empty() ? 0 : g.cavities[0].size()) < 2; });
    return groups;
}

#if CGAL_VERSION_NR >= 1060000000
using Output = std::optional<Solid*>;
#else
using Output = boost::optional<Solid*>;
#endif
using Outputs = std::array<Output, 4>;
constexpr auto kUnion = PMP::Corefinement::UNION, kIntersection = PMP::Corefinement::INTERSECTION;

/// False: the result would not be a manifold.
bool take_away(Solid& io_solid, Solid& io_other) {
    return PMP::corefine_and_compute_difference(io_solid, io_other, io_solid,
                                                CGAL::parameters::throw_on_self_intersection(true));
}

/// What unites with what: solids that only touch, along an edge or in a point, stay two.
enum class Union { one, two, none };

Union unite_two(Solid& io_solid, Solid& io_other) {
    Solid all, both;
    Outputs outputs;
    outputs[kUnion] = &all, outputs[kIntersection] = &both;
    const auto named = CGAL::parameters::throw_on_self_intersection(true);
    const std::array<bool, 4> made = PMP::corefine_and_compute_boolean_operations(io_solid, io_other, outputs, named);
    if (made[kUnion]) {
        io_solid = std::move(all);
        return Union::one;
    }
    return made[kIntersection] && both.is_empty() ? Union::two : Union::none;
}

/// The solids that a group makes; empty where CGAL refuses.
std::vector<Solid> unite_group(const TriMesh& mesh, const Shells& shells, const Group& group) {
    std::vector<Solid> parts;
    for (size_t k = 0; k < group.solids.size(); ++k) {
        Solid next = to_solid(shell_of(mesh, shells, group.solids[k]));
        for (uint32_t cavity : group.cavities[k]) {
            Solid hole = to_solid(shell_of(mesh, shells, cavity));
            PMP::reverse_face_orientations(hole);
            if (!take_away(next, hole)) return {};
        }
        for (size_t p = parts.size(); p-- > 0;) {
            const Union result = unite_two(next, parts[p]);
            if (result == Union::none) return {};
            if (result == Union::one) parts.erase(parts.begin() + static_cast<ptrdiff_t>(p));
        }
        if (!next.is_empty()) parts.push_back(std::move(next));
    }
    return parts;
}

/// The group as triangles; empty where CGAL refuses, or gives what cannot be.
TriMesh united(const TriMesh& mesh, const Shells& shells, const Group& group) {
    if (group.n_crossings > kMostUnionCrossings) return {};
    double largest = 0, sum = 0;  // m3
    for (size_t k = 0; k < group.solids.size(); ++k) {
        double volume = mesh_volume(shell_of(mesh, shells, group.solids[k]));
        sum += volume;
        for (uint32_t cavity : group.cavities[k]) volume += mesh_volume(shell_of(mesh, shells, cavity));
        largest = std::max(largest, volume);
    }
    std::set<std::array<double, 3>> corners;
    double farthest = 0;  // m
    for (const Vec3& p : mesh.positions) {
        corners.insert({p.x(), p.y(), p.z()});
        farthest = std::max(farthest, p.cwiseAbs().maxCoeff());
    }
    TriMesh out;
    try {
        for (Solid& solid : unite_group(mesh, shells, group)) {
            collapse_short_edges(corners, kShortest * farthest, solid);
            append(to_tri_mesh(solid), out);
        }
    } catch (const std::exception&) {  // PMP::Corefinement::Self_intersection_exception, CGAL::Failure_exception
        return {};
    }
    if (out.triangles.empty() || !check_mesh(out).is_solid()) return {};
    const double volume = mesh_volume(out);
    return volume >= largest - kRounding * sum && volume <= sum + kRounding * sum ? out : TriMesh();
}

}  // namespace

UnionReport unite_shells(TriMesh& io_mesh, std::span<const std::array<uint32_t, 2>> crossing) {
    UnionReport report;
    if (crossing.empty()) return report;
    const Shells shells = find_shells(io_mesh);
    TriMesh next;
    std::vector<uint8_t> is_united(shells.n, 0);
    for (const Group& group : crossing_groups(io_mesh, shells, crossing)) {
        size_t n = group.solids.size();
        for (const auto& cavities : group.cavities) n += cavities.size();
        const TriMesh part = united(io_mesh, shells, group);
        if (part.triangles.empty()) {
            if (report.left == 0) {
                const auto first = std::ranges::find(shells.of_triangle, group.solids[0]) - shells.of_triangle.begin();
                report.first_left = io_mesh.positions[io_mesh.triangles[first][0]];
            }
            report.left += n;
            continue;
        }
        append(part, next);
        report.united += n;
        for (uint32_t s : group.solids) is_united[s] = 1;
        for (const auto& cavities : group.cavities)
            for (uint32_t s : cavities) is_united[s] = 1;
    }
    if (report.united == 0) return report;
    for (uint32_t s = 0; s < shells.n; ++s)
        if (!is_united[s]) append(shell_of(io_mesh, shells, s), next);
    carry_cut_attributes(io_mesh, next);
    io_mesh = std::move(next);
    return report;
}

}  // namespace sunder
