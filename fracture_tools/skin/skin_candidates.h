// Which particles may have a say at a visual vertex.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/simulation_mesh.h"

namespace sunder {

/// One-rings through the edges that are intact.
class IntactRings {
public:
    /// `rest`: the body's slice. Rings are there after the first update.
    explicit IntactRings(const SimulationMesh& rest)
        : edges_(rest.edges),
          group_offset_(rest.group_offset),
          group_member_(rest.group_member),
          member_edge_(rest.member_edge),
          ring_(rest.group_member.size()),
          ring_size_(rest.n_particles(), 0) {}

    /// Takes the state of the edges (n_edges).
    void update(std::span<const uint8_t> edge_intact);

    size_t n_particles() const { return ring_size_.size(); }
    /// The particle itself and its neighbours, ascending.
    std::span<const uint32_t> operator[](uint32_t particle) const {
        return {ring_.data() + group_offset_[particle], ring_size_[particle]};
    }
    /// Whether the last update took or gave an edge; all have at the first one. (n_particles)
    std::span<const uint8_t> changed() const { return changed_; }

private:
    std::vector<Edge> edges_;
    std::vector<uint32_t> group_offset_;
    std::vector<ParticleId> group_member_;
    std::vector<EdgeId> member_edge_;
    std::vector<uint8_t> edge_intact_;  // of the last update
    std::vector<uint8_t> changed_;
    std::vector<uint32_t> ring_, ring_size_;  // ring of i: the first ring_size_[i] entries from group_offset_[i] on
};

/// Candidates of one set of connected fragments after the other: all that is in the ring of one of them. Neighbouring
/// vertices often have the same fragments connected, so those of the sets met last are kept. Of one thread, for one
/// state of the rings.
class CandidateLists {
public:
    /// `multiple`: lists are filled up to whole multiples of it, with `n_particles` as the particle.
    CandidateLists(const IntactRings& rings, uint32_t multiple);

    /// Of the fragments that are connected (ascending, one at least), ascending; valid until the next call.
    std::span<const uint32_t> find(std::span<const uint32_t> connected);

private:
    struct List {
        uint32_t begin = 0, n_connected = 0, n_candidates = 0;  // in `listed_`: fragments connected, then candidates
    };
    static constexpr uint32_t kLists = 512;

    List& place_of(std::span<const uint32_t> connected);
    void gather(std::span<const uint32_t> connected);

    const IntactRings& rings_;
    const uint32_t multiple_;
    std::vector<List> of_one_;   // of the fragment alone                           (n_particles)
    std::vector<List> of_many_;  // at the place that a set hashes to               (kLists)
    std::vector<uint32_t> listed_;
    std::vector<uint32_t> united_, more_;  // scratch
};

}  // namespace sunder
