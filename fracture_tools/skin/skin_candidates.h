// Which particles may have a say at a visual vertex.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/simulation_mesh.h"

namespace sunder {

/// Who may have a say at the vertices of each fragment: its one-ring through the edges that are intact. In what lies
/// one fragment thick a skin bends sharply, and whoever has a say on one side of a border between fragments has to have
/// it on the other: there neighbours of neighbours, too, joined at rest by way of a third, as long as all such ways are
/// intact. So none reaches across a crack.
class IntactRings {
public:
    /// `rest`: the body's slice. Rings are there after the first update.
    explicit IntactRings(const SimulationMesh& rest);

    /// Takes the state of the edges (n_edges).
    void update(std::span<const uint8_t> edge_intact);

    size_t n_particles() const { return ring_size_.size(); }
    /// The particle itself and the others, ascending.
    std::span<const uint32_t> operator[](uint32_t particle) const {
        return {ring_.data() + member_offset_[particle], ring_size_[particle]};
    }
    /// Whether the last update may have changed the ring; all have at the first one. (n_particles)
    std::span<const uint8_t> changed() const { return changed_; }

private:
    bool is_joined(uint32_t member) const;

    std::vector<Edge> edges_;
    std::vector<uint32_t> member_offset_;             // CSR                            (n_particles + 1)
    std::vector<uint32_t> member_;                    // at rest, ascending in a ring   (member_offset_.back())
    std::vector<uint32_t> gate_offset_ = {0}, gate_;  // edges that a member needs, CSR (as member_, + 1)
    std::vector<uint8_t> edge_intact_;                // of the last update
    std::vector<uint8_t> changed_;
    std::vector<uint32_t> ring_, ring_size_;  // ring of i: the first ring_size_[i] entries from member_offset_[i] on
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
