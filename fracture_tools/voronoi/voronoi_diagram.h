// The combinatorial Voronoi diagram of sites in space, as the dual of their Delaunay triangulation.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "solver/data/math.h"
#include "solver/data/result.h"

namespace sunder {

/// A side of a Voronoi face: points equally far from three sites.
struct VoronoiEdge {
    std::array<uint32_t, 3> sites;  // ascending
    uint32_t from, to;              // vertices, in the direction of (s_1 - s_0) x (s_2 - s_0); kInfinity
};

struct VoronoiDiagram {
    static constexpr uint32_t kInfinity = 0xffffffffu;

    std::vector<std::array<uint32_t, 4>> vertices;  // sites that a vertex is equally far from, ascending; ascending
    std::vector<VoronoiEdge> edges;                 // ascending by sites
    std::vector<uint32_t> neighbour_offset;         // (n_sites + 1)
    std::vector<uint32_t> neighbour;                // sites whose cells share a face, nearest first
};

/// Needs sites in general position: four of them not in one plane, none twice (bad_input). Where five lie on one sphere
/// a vertex is listed more than once. Depends on the sites alone, not on how they are stored.
Result<VoronoiDiagram> make_voronoi_diagram(std::span<const Vec3> sites);

}  // namespace sunder
