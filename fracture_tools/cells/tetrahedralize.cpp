// The only file that includes CGAL's Mesh_3, which takes a minute and a half to compile.
#include "fracture_tools/cells/tetrahedralize.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/refine_mesh_3.h>

#include <algorithm>
#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <cstdio>
#include <tuple>
#include <unordered_map>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/mesh/unit_box.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace Param = CGAL::parameters;

/// Facets and cells are shaped no worse than this (Delaunay refinement ends surely for angles up to 30 degrees).
constexpr double kFacetAngle = 25;
constexpr double kCellRadiusEdge = 3;
/// Points that each shell is meshed from, if there are several; half the length of the segments that find them, as a
/// share of their triangle's size; and how near to the ball of a sharp edge they may be, in its squared radii.
constexpr size_t kSeeds = 24;
constexpr double kReach = 1e-3, kNearBall = 4;
/// Measured with plates: meshing ends with 0.65 squares for each vertex permitted, not with 2.
constexpr double kSquaresPerVertex = 2;
constexpr const char* kMend = "set source to voronoi";

Result<Surface> make_surface(const MeshView& mesh, const UnitBox& unit, const std::string& where) {
    // Vertices without a triangle are left out: CGAL follows the edges of each vertex, also where there are none.
    std::vector<size_t> number(mesh.positions.size(), 0);
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) number[v] = 1;
    std::vector<Kernel::Point_3> points;
    for (size_t v = 0; v < number.size(); ++v) {
        if (number[v] == 0) continue;
        const Vec3 q = unit.to_unit(mesh.positions[v]);
        number[v] = points.size();
        points.emplace_back(q.x(), q.y(), q.z());
    }
    std::vector<std::array<size_t, 3>> triangles;
    for (const Triangle& t : mesh.triangles) triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    if (!CGAL::Polygon_mesh_processing::is_polygon_soup_a_polygon_mesh(triangles))
        return bad_input(where, "the surface is not a manifold");
    Surface surface;
    CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, triangles, surface);
    if (surface.empty() || !CGAL::is_closed(surface)) return bad_input(where, "the surface is not closed");
    return surface;
}

TetMesh to_plain(const Complex& complex, const UnitBox& unit) {
    TetMesh out;
    std::unordered_map<Triangulation::Vertex_handle, uint32_t, CGAL::Handle_hash_function> number;  // looked up only
    for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
        std::array<uint32_t, 4> tet;
        for (int k = 0; k < 4; ++k) {
            const auto [at, is_new] = number.try_emplace(cell->vertex(k), uint32_t(out.vertices.size()));
            if (is_new) {
                const auto& p = at->first->point().point();
                out.vertices.push_back(unit.to_world(Vec3(p.x(), p.y(), p.z())));
            }
            tet[k] = at->second;
        }
        out.tets.push_back(tet);
    }
    return out;
}

/// Sharp edges are protected by balls before anything else is meshed. Where edges cross or nearly touch the balls
/// shrink without end, at a cost that grows with the square of their number: tried on their own first, with a limit on
/// it.
bool can_protect_edges(const Domain& domain, const Criteria& criteria, double edge_size) {
    double length = 0;
    domain.get_curves(boost::make_function_output_iterator(
        [&](const auto& curve) { length += domain.curve_length(std::get<0>(curve)); }));
    const auto max_balls = static_cast<size_t>(2000 + 4 * length / edge_size);
    Complex trial;
    CGAL::Mesh_error_code code = CGAL::CGAL_MESH_3_NO_ERROR;
    CGAL::Mesh_3::internal::init_c3t3_with_features(trial, domain, criteria, false, max_balls, &code);
    return code == CGAL::CGAL_MESH_3_NO_ERROR;
}

/// Points on every shell of the surface, for it is meshed from points outward, and those that CGAL finds with rays from
/// its middle may miss shells. None near a sharp edge: that one is a beginning itself.
void seed_shells(const MeshView& mesh, const Shells& shells, const UnitBox& unit, const Domain& domain,
                 Complex& io_complex) {
    Triangulation& points = io_complex.triangulation();
    std::vector<std::vector<uint32_t>> members(shells.n);
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) members[shells.of_triangle[t]].push_back(t);
    for (const std::vector<uint32_t>& triangles : members) {
        std::vector<Vec3> middle, across;
        for (uint32_t t : triangles) {
            const auto& [a, b, c] = mesh.triangles[t];
            const Vec3 p = unit.to_unit(mesh.positions[a]), q = unit.to_unit(mesh.positions[b]),
                       r = unit.to_unit(mesh.positions[c]);
            const Vec3 n = (q - p).cross(r - p);
            middle.push_back((p + q + r) / 3);
            across.push_back(n.norm() > 0 ? Vec3(kReach * n / std::sqrt(n.norm())) : Vec3::Zero());
        }
        // Each as far as can be from those before it.
        std::vector<double> distance(triangles.size(), HUGE_VAL);
        size_t next = 0;
        for (size_t n = 0; n < kSeeds && distance[next] > 0; ++n) {
            const Vec3 from = middle[next] - across[next], to = middle[next] + across[next];
            const Kernel::Segment_3 segment(Kernel::Point_3(from.x(), from.y(), from.z()),
                                            Kernel::Point_3(to.x(), to.y(), to.z()));
            for (size_t k = 0; k < triangles.size(); ++k)
                distance[k] = std::min(distance[k], (middle[k] - middle[next]).squaredNorm());
            next = std::ranges::max_element(distance) - distance.begin();
            if (segment.is_degenerate() || !domain.do_intersect_surface_object()(segment)) continue;
            const Domain::Intersection at = domain.construct_intersection_object()(segment);
            const Triangulation::Weighted_point point(std::get<0>(at));
            if (points.dimension() == 3) {
                const auto ball = points.nearest_power_vertex(point.point())->point();
                if (CGAL::squared_distance(ball.point(), point.point()) <= kNearBall * ball.weight()) continue;
            }
            const Triangulation::Vertex_handle v = points.insert(point);
            if (v == Triangulation::Vertex_handle()) continue;
            io_complex.set_dimension(v, 2);
            io_complex.set_index(v, std::get<1>(at));
        }
    }
}

/// Plates have about as many vertices as there are squares with their thickness on them: many more than permitted.
bool is_too_thin(const MeshView& mesh, double max_vertices, double& out_thickness) {
    const double area = mesh_area(mesh);
    out_thickness = 2 * std::abs(mesh_volume(mesh)) / area;
    return max_vertices > 0 && area > kSquaresPerVertex * max_vertices * out_thickness * out_thickness;
}

/// As refine_mesh_3 takes it: a named parameter like the others from CGAL 5.6 on.
auto as_parameter(const Param::internal::Mesh_3_options& options) {
#if CGAL_VERSION_NR >= 1050600000
    return CGAL::Named_function_parameters<Param::internal::Mesh_3_options, CGAL::internal_np::mesh_param_t,
                                           CGAL::internal_np::No_property>(options);
#else
    return options;
#endif
}

Result<TetMesh> run(const MeshView& mesh, const TetrahedralizeSettings& settings, const std::string& where) {
    double thickness = 0;
    if (is_too_thin(mesh, double(settings.max_vertices), thickness)) {
        char text[100];
        std::snprintf(text, sizeof text, "it is too thin (about %.3g m) to be filled with tetrahedra", thickness);
        return bad_input(where, text, kMend);
    }
    const UnitBox unit(mesh);
    Result<Surface> surface = make_surface(mesh, unit, where);
    if (!surface) return surface.error();

    CGAL::get_default_random() = CGAL::Random(0);  // a thread's generator goes on from call to call
    CGAL::Random random(0);
    Domain domain(*surface, &random);
    const bool has_features = settings.sharp_angle > 0;
    if (has_features) domain.detect_features(settings.sharp_angle);

    const double cell = settings.cell_size * unit.scale;
    const Criteria criteria(Param::edge_size = cell, Param::facet_angle = kFacetAngle, Param::facet_size = cell,
                            Param::facet_distance = settings.surface_distance * unit.scale,
                            Param::cell_radius_edge_ratio = kCellRadiusEdge, Param::cell_size = cell);
    if (has_features && !can_protect_edges(domain, criteria, cell))
        return bad_input(where, "its sharp edges cross or nearly touch", "merge them, or set the sharp angle to 180");
    CGAL::Mesh_error_code code = CGAL::CGAL_MESH_3_NO_ERROR;
    Param::internal::Mesh_3_options options;
    options.maximal_number_of_vertices = settings.max_vertices;
    options.pointer_to_error_code = &code;
    options.pointer_to_stop_atomic_boolean = settings.stop;
    Complex complex;
    const Shells shells = find_shells(mesh);
    const size_t n_seeds = shells.n > 1 ? kSeeds * shells.n : 0;
    if (options.maximal_number_of_vertices > 0) options.maximal_number_of_vertices += 2 * n_seeds;
    CGAL::Mesh_3::internal::C3t3_initializer<Complex, Domain, Criteria, true>()(complex, domain, criteria, has_features,
                                                                                options);
    if (code == CGAL::CGAL_MESH_3_NO_ERROR) {
        if (shells.n > 1) seed_shells(mesh, shells, unit, domain, complex);
        CGAL::refine_mesh_3(complex, domain, criteria, Param::no_perturb(), Param::no_exude(), Param::no_reset_c3t3(),
                            as_parameter(options));
    }
    if (code != CGAL::CGAL_MESH_3_NO_ERROR)
        return bad_input(where, "filling it with tetrahedra does not end: it is too thin somewhere, or crosses itself",
                         kMend);
    TetMesh out = to_plain(complex, unit);
    if (out.tets.empty()) return bad_input(where, "it holds no tetrahedron", kMend);
    return out;
}

}  // namespace

Result<TetMesh> tetrahedralize(const MeshView& mesh, const TetrahedralizeSettings& settings, const std::string& where) {
    if (!(settings.cell_size > 0) || !(settings.surface_distance > 0) || !std::isfinite(settings.cell_size))
        return bad_input(where, "sizes of tetrahedra must be above 0");
    try {
        return run(mesh, settings, where);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::internal,
                     "memory ran out while filling the mesh with tetrahedra",
                     where,
                     "ask for fewer pieces",
                     {},
                     {}};
    } catch (const std::exception&) {  // CGAL::Failure_exception: what it holds tells only those who know its sources
        return bad_input(where, "it cannot be filled with tetrahedra", kMend);
    }
}

}  // namespace sunder
