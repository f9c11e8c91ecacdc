#include "fracture_tools/voronoi/restricted_voronoi.h"

#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/parallel_chunks.h"
#include "fracture_tools/mesh/unit_box.h"
#include "fracture_tools/voronoi/interface_loops.h"
#include "fracture_tools/voronoi/interface_triangulation.h"
#include "solver/data/rotations.h"

namespace sunder {
namespace {

/// How far out the sites lie that bound the cells of all others, in radii of everything. Points of the mesh are at most
/// 2 radii from some site and at least 29 from these: their cells stay clear of it.
constexpr double kFarAway = 30;
constexpr size_t kInterfacesAChunk = 16;

/// Sites in the unit box, and four far around them: every cell of the mesh has an end, and one site is enough.
std::vector<Vec3> unit_sites(std::span<const Vec3> sites, const UnitBox& unit, const std::vector<Vec3>& mesh_points) {
    std::vector<Vec3> out;
    double radius = 0;
    for (const Vec3& s : sites) out.push_back(unit.to_unit(s));
    for (const auto* points : std::initializer_list<const std::vector<Vec3>*>{&out, &mesh_points})
        for (const Vec3& p : *points) radius = std::max(radius, p.norm());
    // A regular tetrahedron turned out of the axes: sites on a grid are in general position to it.
    const Quat turn = rotation_about(Vec3(0.31, -0.57, 0.76).normalized(), 0.7);
    for (const Vec3& corner : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
        out.push_back(turn * (kFarAway * radius * corner.normalized()));
    return out;
}

/// Cuts a convex polygon into triangles, the shortest diagonal first.
void cut_polygon(const std::vector<Vec3>& points, std::vector<uint32_t>& io_polygon, std::vector<Triangle>& out) {
    while (io_polygon.size() > 3) {
        const size_t n = io_polygon.size();
        size_t best = 0;
        double shortest = HUGE_VAL;
        for (size_t c = 0; c < n; ++c) {
            const double d = (points[io_polygon[(c + n - 1) % n]] - points[io_polygon[(c + 1) % n]]).squaredNorm();
            if (d < shortest) shortest = d, best = c;
        }
        out.push_back({io_polygon[(best + n - 1) % n], io_polygon[best], io_polygon[(best + 1) % n]});
        io_polygon.erase(io_polygon.begin() + static_cast<std::ptrdiff_t>(best));
    }
    out.push_back({io_polygon[0], io_polygon[1], io_polygon[2]});
}

void add_outer_faces(const TriMesh& mesh, const ClippedSurface& surface, const SurfaceVertices& vertices,
                     CellComplex& io_complex) {
    std::vector<uint32_t> polygon;
    std::vector<Triangle> triangles;
    for (const SurfacePolygon& part : surface.polygons) {
        polygon.assign(vertices.corner.begin() + part.begin, vertices.corner.begin() + part.end);
        triangles.clear();
        cut_polygon(io_complex.vertices, polygon, triangles);
        const Triangle& source = mesh.triangles[part.triangle];
        for (const Triangle& t : triangles) {
            io_complex.faces.push_back({t, part.cell, CellFace::kOutside, part.triangle});
            io_complex.source_weights.push_back(
                {vertices.weights(source, t[0]), vertices.weights(source, t[1]), vertices.weights(source, t[2])});
        }
    }
}

/// Gives the number of interfaces with overlapping triangles; kCancelled when that is what happened.
constexpr size_t kCancelled = ~size_t{0};
size_t add_inner_faces(const InterfaceOutlines& outlines, std::span<const Vec3> unit_points,
                       std::span<const Vec3> sites, int threads, const Progress& progress, CellComplex& io_complex) {
    std::vector<FilledOutline> filled(outlines.interfaces.size());
    const bool whole = for_chunks(filled.size(), kInterfacesAChunk, threads, progress, "filling interfaces",
                                  [&](size_t, size_t begin, size_t end) {
                                      std::vector<std::span<const uint32_t>> loops;
                                      for (size_t k = begin; k < end; ++k) {
                                          const InterfaceOutline& face = outlines.interfaces[k];
                                          loops.clear();
                                          for (uint32_t l = face.loop_begin; l < face.loop_end; ++l)
                                              loops.emplace_back(outlines.vertex.data() + outlines.loop_offset[l],
                                                                 outlines.loop_offset[l + 1] - outlines.loop_offset[l]);
                                          filled[k] = fill_outline(unit_points, loops, sites[face.b] - sites[face.a]);
                                      }
                                  });
    if (!whole) return kCancelled;
    size_t overlapping = 0;
    for (size_t k = 0; k < filled.size(); ++k) {
        const InterfaceOutline& face = outlines.interfaces[k];
        for (const Triangle& t : filled[k].triangles) io_complex.faces.push_back({t, face.a, face.b});
        overlapping += filled[k].may_overlap;
    }
    return overlapping;
}

/// Vertices of the surface, then those within.
std::vector<Vec3> skeleton_points(const VoronoiDiagram& diagram, const InsideSkeleton& skeleton,
                                  std::span<const Vec3> sites, PredicateCount& io_count) {
    std::vector<Vec3> points;
    for (uint32_t v : skeleton.vertices) {
        const auto& [i, j, k, l] = diagram.vertices[v];
        points.push_back(circumcenter({sites[i], sites[j], sites[k], sites[l]}, io_count));
    }
    return points;
}

}  // namespace

Result<RestrictedVoronoi> restrict_voronoi(const TriMesh& mesh, std::span<const Vec3> sites, int threads,
                                           const Progress& progress) {
    const UnitBox unit(mesh);
    std::vector<Vec3> unit_points;
    for (const Vec3& p : mesh.positions) unit_points.push_back(unit.to_unit(p));
    const MeshView unit_mesh(unit_points, mesh.triangles);
    const std::vector<Vec3> all_sites = unit_sites(sites, unit, unit_points);

    if (!progress.report(0, "making Voronoi cells")) return cancelled();
    const Result<VoronoiDiagram> diagram = make_voronoi_diagram(all_sites);
    if (!diagram) return diagram.error();

    RestrictedVoronoi out;
    const auto own_sites = std::span<const Vec3>(all_sites).first(sites.size());
    const Result<ClippedSurface> surface =
        clip_surface(unit_mesh, own_sites, *diagram, threads, progress.part(0.2, 0.6));
    if (!surface) return surface.error();
    out.predicates = surface->count;
    if (!out.is_generic()) return out;
    const SurfaceVertices vertices = number_surface_vertices(unit_mesh, own_sites, *surface, out.predicates);
    const InsideSkeleton skeleton = find_inside_sections(unit_mesh, all_sites, *diagram, vertices, out.predicates);
    if (!out.is_generic()) return out;
    const InterfaceOutlines outlines = chain_interface_loops(*diagram, *surface, vertices, skeleton);
    out.mismatches = skeleton.mismatches + outlines.broken + !vertices.is_whole;
    out.overlaps = skeleton.overlaps;

    const std::vector<Vec3> inner = skeleton_points(*diagram, skeleton, all_sites, out.predicates);
    std::vector<Vec3> filled_points = vertices.positions(unit_mesh);
    filled_points.insert(filled_points.end(), inner.begin(), inner.end());
    out.complex.vertices = vertices.positions(mesh);
    for (const Vec3& p : inner) out.complex.vertices.push_back(unit.to_world(p));
    out.complex.cell_site.assign(sites.begin(), sites.end());
    add_outer_faces(mesh, *surface, vertices, out.complex);
    out.overlapping = add_inner_faces(outlines, filled_points, all_sites, threads, progress.part(0.6, 1), out.complex);
    if (out.overlapping == kCancelled) return cancelled();
    return out;
}

}  // namespace sunder
