// The only file that includes CGAL's Triangulation_3 for cutting.
#include "fracture_tools/voronoi/voronoi_diagram.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>
#include <numeric>

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using CellBase = CGAL::Triangulation_cell_base_with_info_3<uint32_t, Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

/// Sorts three sites; true when that took an odd number of swaps.
bool sort_is_odd(std::array<uint32_t, 3>& io) {
    bool odd = false;
    auto order = [&](int x, int y) {
        if (io[x] > io[y]) std::swap(io[x], io[y]), odd = !odd;
    };
    order(0, 1), order(1, 2), order(0, 1);
    return odd;
}

/// Numbers the tetrahedra by their sites: CGAL's own order goes by addresses.
void list_vertices(Delaunay& io_delaunay, VoronoiDiagram& out) {
    std::vector<std::pair<std::array<uint32_t, 4>, Delaunay::Cell_handle>> tets;
    for (auto cell = io_delaunay.all_cells_begin(); cell != io_delaunay.all_cells_end(); ++cell) {
        cell->info() = VoronoiDiagram::kInfinity;
        if (io_delaunay.is_infinite(cell)) continue;
        std::array<uint32_t, 4> sites;
        for (int k = 0; k < 4; ++k) sites[k] = cell->vertex(k)->info();
        std::sort(sites.begin(), sites.end());
        tets.emplace_back(sites, cell);
    }
    std::sort(tets.begin(), tets.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    for (const auto& [sites, cell] : tets) {
        cell->info() = static_cast<uint32_t>(out.vertices.size());
        out.vertices.push_back(sites);
    }
}

/// The dual of the facet of `cell` opposite its k-th vertex.
VoronoiEdge dual_edge(const Delaunay::Cell_handle& cell, int k) {
    VoronoiEdge edge;
    for (int m = 0, n = 0; m < 4; ++m)
        if (m != k) edge.sites[n++] = cell->vertex(m)->info();
    // CGAL's cells are positive: the fourth vertex is on the positive side of the first three. Taking vertex k out of
    // its place to the end is 3 - k swaps.
    const bool on_positive_side = ((3 - k) % 2 == 1) == sort_is_odd(edge.sites);
    edge.from = cell->neighbor(k)->info(), edge.to = cell->info();
    if (!on_positive_side) std::swap(edge.from, edge.to);
    return edge;
}

void list_neighbours(std::span<const Vec3> sites, VoronoiDiagram& io) {
    std::vector<std::array<uint32_t, 2>> pairs;
    for (const VoronoiEdge& e : io.edges)
        for (int x = 0; x < 3; ++x)
            for (int y = 0; y < 3; ++y)
                if (x != y) pairs.push_back({e.sites[x], e.sites[y]});
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    auto distance = [&](const auto& pair) { return (sites[pair[1]] - sites[pair[0]]).squaredNorm(); };
    std::sort(pairs.begin(), pairs.end(), [&](const auto& x, const auto& y) {
        return std::tuple(x[0], distance(x), x[1]) < std::tuple(y[0], distance(y), y[1]);
    });
    io.neighbour_offset.assign(sites.size() + 1, 0);
    for (const auto& [site, other] : pairs) {
        ++io.neighbour_offset[site + 1];
        io.neighbour.push_back(other);
    }
    std::partial_sum(io.neighbour_offset.begin(), io.neighbour_offset.end(), io.neighbour_offset.begin());
}

Result<VoronoiDiagram> run(std::span<const Vec3> sites) {
    std::vector<std::pair<Delaunay::Point, uint32_t>> points;
    for (uint32_t i = 0; i < sites.size(); ++i)
        points.emplace_back(Delaunay::Point(sites[i].x(), sites[i].y(), sites[i].z()), i);
    Delaunay delaunay(points.begin(), points.end());
    if (delaunay.dimension() < 3 || delaunay.number_of_vertices() != sites.size())
        return bad_input("sites", "they lie in one plane, or two of them in one place");
    VoronoiDiagram diagram;
    list_vertices(delaunay, diagram);
    for (auto facet = delaunay.finite_facets_begin(); facet != delaunay.finite_facets_end(); ++facet) {
        auto [cell, k] = *facet;
        if (delaunay.is_infinite(cell)) std::tie(cell, k) = delaunay.mirror_facet(*facet);
        diagram.edges.push_back(dual_edge(cell, k));
    }
    std::sort(diagram.edges.begin(), diagram.edges.end(),
              [](const VoronoiEdge& x, const VoronoiEdge& y) { return x.sites < y.sites; });
    list_neighbours(sites, diagram);
    return diagram;
}

}  // namespace

Result<VoronoiDiagram> make_voronoi_diagram(std::span<const Vec3> sites) {
    try {
        return run(sites);
    } catch (const CGAL::Failure_exception& failure) {
        return Error{ErrorCode::internal,
                     "the Voronoi diagram failed: " + failure.expression().substr(0, 80),
                     "sites",
                     {},
                     {},
                     {}};
    }
}

}  // namespace sunder
