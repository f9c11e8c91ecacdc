// Groups and pieces as they stand: the rest edges less those that broke.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "solver/data/simulation_mesh.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// The living members of group g are slots [begin(g), end(g)), a prefix of its rest range, particles ascending.
class LiveTopology {
public:
    void reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact);
    void reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact, const WorkerPool& workers);

    /// Takes broken edges out of the groups of their ends; `broken` in any order. Returns the groups that changed,
    /// ascending.
    std::vector<ParticleId> remove_edges(const SimulationMesh& rest, std::span<const EdgeId> broken);

    uint32_t begin(ParticleIndex g) const { return offset_[g]; }
    uint32_t end(ParticleIndex g) const { return end_[g]; }
    uint32_t count(ParticleIndex g) const { return end_[g] - offset_[g]; }
    ParticleId member(size_t slot) const { return member_[slot]; }
    EdgeId edge(size_t slot) const { return edge_[slot]; }           // none for the centre
    uint32_t twin(size_t slot) const { return twin_[slot]; }         // slot of the centre in the member's group
    bool joined(ParticleIndex i, ParticleIndex j) const;             // by an intact edge
    std::span<const uint32_t> begins() const { return offset_; }     // (n_particles + 1)
    std::span<const uint32_t> ends() const { return end_; }          // (n_particles)
    std::span<const ParticleId> members() const { return member_; }  // by slot
    std::span<const EdgeId> edges() const { return edge_; }          // by slot
    std::span<const uint32_t> twins() const { return twin_; }        // by slot
    size_t n_slots() const { return member_.size(); }
    uint64_t version() const { return version_; }  // another after every change

    /// Pieces: connected sets of particles, numbered by their first particle; their particles, piece after piece.
    size_t n_pieces() const { return piece_offset_.size() - 1; }
    PieceId piece(ParticleIndex particle) const { return piece_[particle]; }
    std::span<const PieceId> pieces() const { return piece_; }  // (n_particles)
    std::span<const ParticleId> piece_particles(PieceIndex p) const {
        return {piece_particle_.data() + piece_offset_[p], piece_offset_[p + 1] - piece_offset_[p]};
    }
    /// The first piece that begins there or later; places are counted through the particles of all pieces.
    size_t piece_from(size_t place) const {
        return static_cast<size_t>(std::ranges::lower_bound(piece_offset_, place) - piece_offset_.begin());
    }

private:
    void drop_from_group(ParticleId g);
    void find_pieces();

    std::vector<uint32_t> offset_, end_, twin_;
    std::vector<ParticleId> member_, piece_particle_;
    std::vector<EdgeId> edge_;
    std::vector<PieceId> piece_;
    std::vector<uint32_t> piece_offset_;
    std::vector<uint8_t> gone_;    // scratch: edges to drop
    std::vector<uint32_t> place_;  // scratch of reset: where slots go
    std::vector<uint32_t> set_;    // scratch: of particles that hang together
    uint64_t version_ = 0;
};

}  // namespace sunder
