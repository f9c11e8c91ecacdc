// The only file that includes CGAL's alpha wrap.
#include "fracture_tools/repair/repair_wrap.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/mesh/unit_box.h"
#include "fracture_tools/repair/repair_surface.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

/// The wrap's distance from the triangles, as a share of the detail; and how much of it is drawn back. Drawn back
/// altogether, triangles along sharp edges would have no area.
constexpr double kOffset = 1 / 20.0, kDrawBack = 0.95;
constexpr size_t kPointsAReport = 1000;

struct Cancelled {};
struct TooMany {};

/// Called by CGAL for each point that it adds: what can run long looks here.
struct Watch : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
    const Progress* progress = nullptr;
    size_t* n_points = nullptr;

    template <class Wrapper, class Point>
    void before_Steiner_point_insertion(const Wrapper&, const Point&) {
        if (++*n_points > kMostWrapPoints) throw TooMany();
        const double share = double(*n_points) / (double(*n_points) + 20 * kPointsAReport);  // the end is not known
        if (*n_points % kPointsAReport == 0 && !progress->report(0.9 * share, "wrapping the mesh")) throw Cancelled();
    }
};

TriMesh run(const MeshView& mesh, double detail, const Progress& progress) {
    const UnitBox unit(mesh);
    std::vector<Kernel::Point_3> points;
    for (const Vec3& p : mesh.positions) {
        const Vec3 q = unit.to_unit(p);
        points.emplace_back(q.x(), q.y(), q.z());
    }
    std::vector<std::array<size_t, 3>> triangles;
    for (const Triangle& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
    size_t n_points = 0;
    Watch watch;
    watch.progress = &progress, watch.n_points = &n_points;
    const double alpha = detail * unit.scale;
    Surface surface;
    const auto watched = CGAL::parameters::visitor(watch);
    CGAL::alpha_wrap_3(points, triangles, alpha, kOffset * alpha, surface, watched, watched);  // of CGAL 6, of CGAL 5
    TriMesh wrap;
    for (const auto v : surface.vertices()) {
        const auto& p = surface.point(v);
        wrap.positions.push_back(unit.to_world(Vec3(p.x(), p.y(), p.z())));
    }
    for (const auto f : surface.faces()) {
        const auto h = surface.halfedge(f);
        wrap.triangles.push_back(
            {uint32_t(surface.source(h)), uint32_t(surface.target(h)), uint32_t(surface.target(surface.next(h)))});
    }
    return wrap;
}

/// Moves vertices most of their way to the mesh, unless triangles cross then.
void draw_back(const MeshView& mesh, TriMesh& io_wrap) {
    const SurfaceLookup lookup(mesh);
    std::vector<Vec3> moved;
    for (const Vec3& p : io_wrap.positions) moved.push_back(p + kDrawBack * (lookup.nearest(p).position - p));
    if (crossing_triangles(MeshView(moved, io_wrap.triangles)).empty()) io_wrap.positions = std::move(moved);
}

}  // namespace

Result<TriMesh> wrap_surface(const MeshView& mesh, double detail, const std::string& where, const Progress& progress) {
    try {
        TriMesh wrap = run(mesh, detail, progress);
        if (!progress.report(0.9, "drawing the wrap back")) return cancelled();
        draw_back(mesh, wrap);
        return wrap;
    } catch (const Cancelled&) {
        return cancelled();
    } catch (const TooMany&) {
        return bad_input(where, "its wrap needs more than " + std::to_string(kMostWrapPoints) + " vertices",
                         "set wrap_detail higher");
    } catch (const std::bad_alloc&) {
        return Error{
            ErrorCode::internal, "memory ran out while wrapping the mesh", where, "set wrap_detail higher", {}, {}};
    } catch (const std::exception&) {  // CGAL::Failure_exception: what it holds tells only those who know its sources
        return bad_input(where, "it could not be wrapped",
                         "clean it in a modelling program, or set wrap_detail higher");
    }
}

}  // namespace sunder
