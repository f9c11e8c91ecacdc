// Which particles of one piece may touch one another.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/collision/piece_frame.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Remembers the pairs of each piece in a frame that moves and turns with it: a body that falls or spins as a whole
/// finds its pairs once. A piece that breaks leaves what it knows to its parts. What is remembered changes no contact.
class PiecePairs {
public:
    /// Call when a state was set from outside.
    void reset();
    /// Call when edges broke.
    void edges_broke() { are_known_ = false; }
    /// Call when particles were numbered anew; `former` (n_particles): as who they were known before, with the same
    /// ring, or kNone; ascending. Pieces whose particles are all still there keep their pairs.
    void renumber(std::span<const ParticleId> former);

    /// Superset of the pairs of particles of one piece that touch on straight paths, but for those that `filter`
    /// excludes, in no order. `piece` (n_particles) numbers pieces by their first particle; until the next reset it
    /// only loses edges.
    std::span<const Pair> update(const ParticleMotion& motion, std::span<const PieceId> piece, const PairFilter& filter,
                                 const WorkerPool& workers);

    size_t n_rebuilds() const { return n_rebuilds_; }

private:
    struct Piece {
        std::vector<ParticleId> member;
        std::vector<ParticleId> ring;    // one after the other, for which `pairs` hold
        std::vector<uint32_t> ring_end;  // in it (as member)
        std::vector<Vec3> remembered;    // positions when its boxes were grown, from their centre (as member), m
        std::vector<Aabb> grown;         // in the frame of then, about the centre (as member), m
        std::vector<Pair> pairs;         // of overlapping boxes, not near one another, first < second
        Quat turn = Quat::Identity();    // since then
        bool is_changed = false;         // its pairs were changed in this update
        bool is_fresh = false;           // all of them were found in it

        std::span<const ParticleId> ring_of(size_t place) const {
            const uint32_t begin = place == 0 ? 0 : ring_end[place - 1];
            return std::span(ring).subspan(begin, ring_end[place] - begin);
        }
    };
    void take_pieces(std::span<const PieceId> piece, const LiveRings& rings, const WorkerPool& workers);
    static void inherit(Piece& io_parent, std::span<const PieceId> piece, Piece& io_child);
    static void remember_rings(const LiveRings& rings, Piece& io_piece);
    static void take_in(const LiveRings& rings, std::span<const PieceId> piece, Piece& io_piece);
    static void refresh(const PieceFrameKernels& kernels, const ParticleMotion& motion, const LiveRings& rings,
                        const WorkerPool& workers, Piece& io_piece);
    static void find_again(const LiveRings& rings, std::span<const uint32_t> places, const WorkerPool& workers,
                           Piece& io_piece);
    static void find_pairs(const LiveRings& rings, const WorkerPool& workers, Piece& io_piece);

    std::vector<Piece> pieces_;  // of three particles or more: two are joined
    std::vector<Pair> pairs_;
    bool are_known_ = false, self_collision_ = true;
    size_t n_rebuilds_ = 0;
};

}  // namespace sunder
