// The only file that includes CGAL's polygon mesh processing for repair.
#include "fracture_tools/mesh_repair.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "fracture_tools/mesh_checks.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

/// A border longer than this share of the bounding box's diagonal is no hole in a solid but the rim of a sheet.
constexpr double kLargestHole = 0.5;

std::string place(const Kernel::Point_3& p) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.6g %.6g %.6g)", p.x(), p.y(), p.z());
    return text;
}

/// Closes holes. Errors: one that is too large, or that CGAL cannot fill.
Status close_holes(Surface& io_surface, double diagonal, const std::string& where, size_t& out_closed) {
    std::vector<Surface::Halfedge_index> borders;
    PMP::extract_boundary_cycles(io_surface, std::back_inserter(borders));
    size_t open_edges = 0;
    double largest = 0;
    for (const auto start : borders) {
        double perimeter = 0;
        for (const auto h : CGAL::halfedges_around_face(start, io_surface)) {
            ++open_edges;
            perimeter += std::sqrt(
                CGAL::squared_distance(io_surface.point(io_surface.source(h)), io_surface.point(io_surface.target(h))));
        }
        largest = std::max(largest, perimeter);
    }
    if (borders.empty()) return {};
    const std::string open = "the mesh is open: " + std::to_string(open_edges) + " boundary edges, first near " +
                             place(io_surface.point(io_surface.source(borders.front())));
    if (largest > kLargestHole * diagonal) return bad_input(where, open, "close it, or give a sheet thickness");
    for (const auto start : borders) {
        std::vector<Surface::Face_index> faces;
        PMP::triangulate_hole(io_surface, start, std::back_inserter(faces));
        if (faces.empty()) return bad_input(where, open + ", and a hole could not be filled", "close it by hand");
    }
    out_closed = borders.size();
    return {};
}

struct Chain {
    Surface surface;
    size_t n_holes = 0, n_self_intersections = 0;
};

Result<Chain> run_chain(const TriMesh& mesh, double diagonal, const std::string& where) {
    std::vector<Kernel::Point_3> points;
    for (const Vec3& p : mesh.positions) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<std::vector<size_t>> triangles;
    for (const Triangle& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});

    PMP::repair_polygon_soup(points, triangles);
    if (triangles.empty()) return bad_input(where, "no triangle of the mesh has an area");
    PMP::orient_polygon_soup(points, triangles);
    if (!PMP::is_polygon_soup_a_polygon_mesh(triangles))
        return bad_input(where, "triangles of the mesh cannot be joined into a surface");
    Chain chain;
    PMP::polygon_soup_to_polygon_mesh(points, triangles, chain.surface);
    PMP::stitch_borders(chain.surface);
    if (Status s = close_holes(chain.surface, diagonal, where, chain.n_holes); !s) return s.error();

    std::vector<std::pair<Surface::Face_index, Surface::Face_index>> crossing;
    PMP::self_intersections(chain.surface, std::back_inserter(crossing));
    chain.n_self_intersections = crossing.size();
    // Nested shells (cavities) are told apart only where surfaces do not cross; else each one faces outward.
    if (crossing.empty())
        PMP::orient_to_bound_a_volume(chain.surface);
    else
        PMP::orient(chain.surface);
    return chain;
}

/// Corner attributes of the source, found again by position: the chain drops, reverses and duplicates.
class Attributes {
public:
    explicit Attributes(const TriMesh& source) : source_(source) {
        for (uint32_t t = 0; t < source.triangles.size(); ++t) {
            triangle_.try_emplace(key(corners(source, t)), t);
            for (int c = 0; c < 3; ++c)
                corner_.try_emplace(as_array(source.positions[source.triangles[t][c]]), 3 * t + c);
        }
    }

    /// Gives `io_mesh`, which has positions and triangles, the attributes that the source has.
    void carry(TriMesh& io_mesh) const {
        for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
            const std::array<Vec3, 3> at = corners(io_mesh, t);
            const auto known = triangle_.find(key(at));
            const uint32_t from = known != triangle_.end() ? known->second : neighbour(at);
            const bool kept = known != triangle_.end();
            if (!source_.triangle_material.empty())
                io_mesh.triangle_material.push_back(source_.triangle_material[from]);
            for (int c = 0; c < 3; ++c) {
                const uint32_t corner = kept ? corner_of(from, at[c]) : near_corner(at[c], 3 * from);
                if (!source_.corner_uvs.empty()) io_mesh.corner_uvs.push_back(source_.corner_uvs[corner]);
                if (!source_.corner_colors.empty()) io_mesh.corner_colors.push_back(source_.corner_colors[corner]);
                if (!source_.corner_normals.empty()) io_mesh.corner_normals.push_back(normal(at, corner, kept));
            }
        }
        io_mesh.material_names = source_.material_names;
    }

private:
    using Key = std::array<double, 3>;
    static Key as_array(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
    static std::array<Vec3, 3> corners(const TriMesh& m, uint32_t t) {
        return {m.positions[m.triangles[t][0]], m.positions[m.triangles[t][1]], m.positions[m.triangles[t][2]]};
    }
    static std::array<Key, 3> key(const std::array<Vec3, 3>& at) {
        std::array<Key, 3> k = {as_array(at[0]), as_array(at[1]), as_array(at[2])};
        std::sort(k.begin(), k.end());
        return k;
    }
    uint32_t near_corner(const Vec3& p, uint32_t otherwise) const {
        const auto found = corner_.find(as_array(p));
        return found == corner_.end() ? otherwise : found->second;
    }
    uint32_t neighbour(const std::array<Vec3, 3>& at) const { return near_corner(at[0], 0) / 3; }
    uint32_t corner_of(uint32_t triangle, const Vec3& p) const {
        for (uint32_t c = 0; c < 3; ++c)
            if (source_.positions[source_.triangles[triangle][c]] == p) return 3 * triangle + c;
        return 3 * triangle;
    }
    /// The artist's normal on the outer side, whichever side that is now; a new triangle has its own.
    Vec3f normal(const std::array<Vec3, 3>& at, uint32_t corner, bool kept) const {
        const Vec3f own = (at[1] - at[0]).cross(at[2] - at[0]).normalized().cast<float>();
        if (!kept) return own;
        const Vec3f& artist = source_.corner_normals[corner];
        const std::array<Vec3, 3> before = corners(source_, corner / 3);
        const bool reversed =
            (before[1] - before[0]).cross(before[2] - before[0]).dot((at[1] - at[0]).cross(at[2] - at[0])) < 0;
        return reversed ? Vec3f(-artist) : artist;
    }

    const TriMesh& source_;
    std::map<std::array<Key, 3>, uint32_t> triangle_;
    std::map<Key, uint32_t> corner_;
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

/// Groups name vertices by number; their positions find them again.
void carry_groups(const TriMesh& source, TriMesh& io_mesh) {
    if (source.vertex_groups.empty()) return;
    std::map<std::array<double, 3>, std::vector<uint32_t>> at;
    for (uint32_t v = 0; v < io_mesh.positions.size(); ++v)
        at[{io_mesh.positions[v].x(), io_mesh.positions[v].y(), io_mesh.positions[v].z()}].push_back(v);
    for (const auto& [name, vertices] : source.vertex_groups) {
        std::vector<uint32_t>& out = io_mesh.vertex_groups[name];
        for (uint32_t v : vertices) {
            const Vec3& p = source.positions[v];
            if (const auto found = at.find({p.x(), p.y(), p.z()}); found != at.end())
                out.insert(out.end(), found->second.begin(), found->second.end());
        }
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
    }
}

std::string counted(size_t n, const char* one, const char* many) {
    return std::to_string(n) + " " + (n == 1 ? one : many);
}

Result<TriMesh> repair(const TriMesh& mesh, const std::string& where, std::vector<std::string>& io_warnings) {
    const MeshReport before = check_mesh(mesh);
    if (!before.is_usable()) return bad_input(where, before.faults.front());
    Result<Chain> chain = run_chain(mesh, before.bounds.diagonal(), where);
    if (!chain) return chain.error();
    if (chain->n_self_intersections > 0)
        io_warnings.push_back(where + ": the surface crosses itself at " +
                              counted(chain->n_self_intersections, "pair of triangles", "pairs of triangles"));

    TriMesh repaired = to_tri_mesh(chain->surface);
    const double volume = mesh_volume(repaired);
    const bool same = before.is_solid() && before.degenerate_triangles + before.duplicate_triangles == 0 &&
                      std::abs(volume - before.volume) <= 1e-9 * std::abs(before.volume);
    if (same) return mesh;
    if (Status s = require_solid(repaired, where); !s) return s.error();

    if (chain->n_holes > 0) io_warnings.push_back(where + ": " + counted(chain->n_holes, "hole", "holes") + " closed");
    const size_t dropped = before.degenerate_triangles + before.duplicate_triangles;
    if (dropped > 0)
        io_warnings.push_back(
            where + ": " + counted(dropped, "degenerate or duplicate triangle", "degenerate or duplicate triangles") +
            " dropped");
    if (before.inconsistent_edges > 0 || before.volume < 0) io_warnings.push_back(where + ": triangles turned outward");
    if (before.non_manifold_edges + before.non_manifold_vertices > 0)
        io_warnings.push_back(where + ": the surface was parted where it touched itself");
    Attributes(mesh).carry(repaired);
    carry_groups(mesh, repaired);
    return repaired;
}

}  // namespace

Result<TriMesh> repair_mesh(const TriMesh& mesh, const std::string& where, std::vector<std::string>& io_warnings) {
    try {
        return repair(mesh, where, io_warnings);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::internal, "memory ran out while repairing the mesh", where, {}, {}, {}};
    } catch (const CGAL::Failure_exception& failure) {  // its what() is a page; the expression tells experts enough
        return bad_input(where, "the mesh could not be repaired: " + failure.expression().substr(0, 80),
                         "close and clean it in a modelling program");
    } catch (const std::exception& failure) {
        return bad_input(where, std::string("the mesh could not be repaired: ") + failure.what(),
                         "close and clean it in a modelling program");
    }
}

}  // namespace sunder
