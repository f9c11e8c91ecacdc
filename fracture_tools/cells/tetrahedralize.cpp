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

#include <cmath>
#include <tuple>
#include <unordered_map>

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
    std::vector<std::tuple<Domain::Curve_index, std::pair<Kernel::Point_3, Domain::Index>,
                           std::pair<Kernel::Point_3, Domain::Index>>>
        curves;
    domain.get_curves(std::back_inserter(curves));
    double length = 0;
    for (const auto& curve : curves) length += domain.curve_length(std::get<0>(curve));
    const auto max_balls = static_cast<size_t>(2000 + 4 * length / edge_size);
    Complex trial;
    CGAL::Mesh_error_code code = CGAL::CGAL_MESH_3_NO_ERROR;
    CGAL::Mesh_3::internal::init_c3t3_with_features(trial, domain, criteria, false, max_balls, &code);
    return code == CGAL::CGAL_MESH_3_NO_ERROR;
}

Result<TetMesh> run(const MeshView& mesh, const TetrahedralizeSettings& settings, const std::string& where) {
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
    const Complex complex =
        CGAL::make_mesh_3<Complex>(domain, criteria, has_features ? Param::features(domain) : Param::no_features(),
                                   Param::no_perturb(), Param::no_exude(), options);
    if (code != CGAL::CGAL_MESH_3_NO_ERROR)
        return bad_input(where, "filling it with tetrahedra does not settle", "look for self-intersections");
    TetMesh out = to_plain(complex, unit);
    if (out.tets.empty()) return bad_input(where, "it holds no tetrahedron", "look for a surface without inside");
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
    } catch (const CGAL::Failure_exception& failure) {  // its what() is a page; the expression tells experts enough
        return bad_input(where, "filling it with tetrahedra failed: " + failure.expression().substr(0, 80),
                         "look for self-intersections");
    } catch (const std::exception& failure) {
        return bad_input(where, std::string("filling it with tetrahedra failed: ") + failure.what(),
                         "look for self-intersections");
    }
}

}  // namespace sunder
