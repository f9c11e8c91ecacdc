// What it takes to break a fragment off.
#pragma once

#include <span>
#include <vector>

#include "solver/scene/scene.h"

namespace sunder {

/// Of each particle, the least tensile strain at which its group may part an edge that is still intact, -; kNever where
/// it has none, or glued ones alone. `materials`: one a body, as of the frame.
std::vector<double> fragment_toughness(const SimulationMesh& rest, std::span<const Material> materials,
                                       std::span<const uint8_t> edge_intact, std::span<const double> bonds = {});

/// What edges are stronger or weaker by in a frame.
class EdgeBonds {
public:
    explicit EdgeBonds(size_t n_edges) : n_edges_(n_edges) {}
    void scale(EdgeId edge, double factor);
    void hold(EdgeId edge) { scale(edge, kNever); }
    /// Of an edge that something holds kNever, whatever weakens it; empty: all 1. (n_edges), -
    std::vector<double> take() { return std::move(factor_); }

private:
    size_t n_edges_;
    std::vector<double> factor_;
};

/// For seams (of each its factor, FrameInput::seams), for what is glued, and for what a source carries along, which
/// bears nothing; empty: all 1. Of edges that are intact. (n_edges), -
std::vector<double> edge_bonds(const Scene& scene, std::span<const double> seams, const FrameState& state);

/// Tension over E at which an edge begins to tear, without what seams and glue make of it: the mean of its fragments'
/// toughness times its own factor, -. `of_a`, `of_b`: the materials of their bodies.
double sound_toughness(const SimulationMesh& rest, const Material& of_a, const Material& of_b, EdgeId edge);

/// With that: times its bond. kNever of what is held.
inline double toughness_of_edge(double sound, double bond) { return bond < kNever ? sound * bond : kNever; }

/// Of all edges, -. `material(particle)`: of its body, as of the frame; `bonds`: EdgeBonds.
template <class MaterialOf>
std::vector<double> edge_toughness(const SimulationMesh& rest, std::span<const double> bonds,
                                   const MaterialOf& material) {
    std::vector<double> toughness;
    for (EdgeId e(0); e < rest.n_edges(); ++e) {
        const Edge& edge = rest.edges[e];
        const double sound = sound_toughness(rest, material(edge.a), material(edge.b), e);
        toughness.push_back(toughness_of_edge(sound, bonds.empty() ? 1 : bonds[e]));
    }
    return toughness;
}

}  // namespace sunder
