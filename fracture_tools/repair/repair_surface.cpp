// The only file that includes CGAL's polygon mesh processing for repair.
#include "fracture_tools/repair/repair_surface.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <boost/iterator/function_output_iterator.hpp>

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

struct Soup {
    std::vector<Kernel::Point_3> points;
    std::vector<std::vector<size_t>> triangles;

    explicit Soup(const MeshView& mesh) {
        for (const Vec3& p : mesh.positions) points.emplace_back(p.x(), p.y(), p.z());
        for (const Triangle& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
    }
};

TriMesh to_tri_mesh(const Surface& surface) {
    TriMesh mesh;
    std::vector<uint32_t> number(surface.number_of_vertices() + surface.number_of_removed_vertices());
    for (const auto v : surface.vertices()) {
        number[v.idx()] = static_cast<uint32_t>(mesh.positions.size());
        const auto& p = surface.point(v);
        mesh.positions.push_back(Vec3(p.x(), p.y(), p.z()));
    }
    for (const auto f : surface.faces()) {
        const auto h = surface.halfedge(f);
        mesh.triangles.push_back({number[surface.source(h).idx()], number[surface.target(h).idx()],
                                  number[surface.target(surface.next(h)).idx()]});
    }
    return mesh;
}

Result<TriMesh> join(const MeshView& mesh, const std::string& where) {
    Soup soup(mesh);
    PMP::repair_polygon_soup(soup.points, soup.triangles);
    if (soup.triangles.empty()) return bad_input(where, "no triangle of the mesh has an area");
    PMP::orient_polygon_soup(soup.points, soup.triangles);
    if (!PMP::is_polygon_soup_a_polygon_mesh(soup.triangles))
        return bad_input(where, "triangles of the mesh cannot be joined into a surface");
    Surface surface;
    PMP::polygon_soup_to_polygon_mesh(soup.points, soup.triangles, surface);
    PMP::stitch_borders(surface);
    return to_tri_mesh(surface);
}

struct Enough {};

/// Whether triangles that CGAL says to meet, having different vertices, do so beyond vertices in the same place.
class Meeting {
public:
    explicit Meeting(const MeshView& mesh) : mesh_(mesh) {}

    bool counts(uint32_t t, uint32_t u) const {
        if (is_flat(t) || is_flat(u)) return false;
        std::array<int, 3> at_t{}, at_u{};  // corners in the same place, then the others
        int n = 0;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (corner(t, i) == corner(u, j)) at_t[n] = i, at_u[n++] = j;
        if (n == 0 || n == 3) return true;
        for (int m = n, i = 0; i < 3; ++i)
            if (std::find(at_t.begin(), at_t.begin() + n, i) == at_t.begin() + n) at_t[m++] = i;
        for (int m = n, j = 0; j < 3; ++j)
            if (std::find(at_u.begin(), at_u.begin() + n, j) == at_u.begin() + n) at_u[m++] = j;
        const std::array<Point, 3> p = {point(t, at_t[0]), point(t, at_t[1]), point(t, at_t[2])};
        const std::array<Point, 3> q = {point(u, at_u[0]), point(u, at_u[1]), point(u, at_u[2])};
        if (n == 2)  // an edge: they overlap if one lies on the other
            return CGAL::coplanar(p[0], p[1], p[2], q[2]) &&
                   CGAL::coplanar_orientation(p[0], p[1], p[2], q[2]) == CGAL::POSITIVE;
        return CGAL::do_intersect(Kernel::Segment_3(p[1], p[2]), Kernel::Triangle_3(q[0], q[1], q[2])) ||
               CGAL::do_intersect(Kernel::Segment_3(q[1], q[2]), Kernel::Triangle_3(p[0], p[1], p[2]));
    }

private:
    using Point = Kernel::Point_3;
    const Vec3& corner(uint32_t t, int c) const { return mesh_.positions[mesh_.triangles[t][c]]; }
    Point point(uint32_t t, int c) const { return {corner(t, c).x(), corner(t, c).y(), corner(t, c).z()}; }
    /// Less high than a millionth of a millionth of its length: rounding, or what closes a seam.
    bool is_flat(uint32_t t) const {
        const Vec3 a = corner(t, 1) - corner(t, 0), b = corner(t, 2) - corner(t, 0);
        return a.cross(b).norm() <= 1e-12 * std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    }
    MeshView mesh_;
};

}  // namespace

Result<TriMesh> join_triangles(const MeshView& mesh, const std::string& where) {
    const char* const mend = "clean it in a modelling program, or set repair to wrap";
    try {
        return join(mesh, where);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::internal, "memory ran out while repairing the mesh", where, {}, {}, {}};
    } catch (const std::exception&) {  // CGAL::Failure_exception: what it holds tells only those who know its sources
        return bad_input(where, "its triangles cannot be joined", mend);
    }
}

std::vector<std::array<uint32_t, 2>> crossing_triangles(const MeshView& mesh) {
    const Soup soup(mesh);
    Surface surface;
    PMP::polygon_soup_to_polygon_mesh(soup.points, soup.triangles, surface);
    std::vector<std::array<uint32_t, 2>> pairs;
    const Meeting meeting(mesh);
    const auto collect = [&](const std::pair<Surface::Face_index, Surface::Face_index>& pair) {
        const auto a = static_cast<uint32_t>(pair.first.idx()), b = static_cast<uint32_t>(pair.second.idx());
        if (!meeting.counts(a, b)) return;
        pairs.push_back({std::min(a, b), std::max(a, b)});
        if (pairs.size() == kMostCrossings) throw Enough();
    };
    try {
        PMP::self_intersections(surface, boost::make_function_output_iterator(collect));
    } catch (const Enough&) {
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

std::vector<Triangle> fill_hole(std::span<const Vec3> outline) {
    std::vector<Kernel::Point_3> points;
    for (const Vec3& p : outline) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<CGAL::Triple<int, int, int>> found;
    try {
        // Over all triangulations, where those of the Delaunay kind do not do, the search is cubic.
        constexpr size_t kMostForCubic = 200;
        PMP::triangulate_hole_polyline(points, std::back_inserter(found),
                                       CGAL::parameters::do_not_use_cubic_algorithm(outline.size() > kMostForCubic));
    } catch (const CGAL::Failure_exception&) {
        found.clear();
    }
    std::vector<Triangle> triangles;
    for (const auto& t : found) {
        // In any triangulation of a polygon ascending corners run round as the polygon does.
        Triangle corners = {uint32_t(t.first), uint32_t(t.second), uint32_t(t.third)};
        std::sort(corners.begin(), corners.end());
        triangles.push_back(corners);
    }
    return triangles;
}

}  // namespace sunder
