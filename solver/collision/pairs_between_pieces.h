// Which movable things of different pieces may touch one another.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Remembers the pairs of boxes that were grown when they were looked for, in a frame that goes with all of them: while
/// most things stay within their grown boxes, only those that left, or came off a piece, are looked for again. Where
/// most leave at once, as tumbling bodies do, nothing is remembered for a while: then of pieces whose boxes meet, the
/// particles that meet the other's box. A rigid body is a piece. What is remembered changes no contact.
class PairsBetweenPieces {
public:
    /// Call when a state was set from outside.
    void reset() { *this = {}; }
    /// Call when edges broke.
    void edges_broke() { are_known_ = false; }
    /// Call when particles were numbered anew; `former` (n_particles): as who they were known before, or kNone;
    /// ascending.
    void renumber(std::span<const ParticleId> former);

    /// Superset of the pairs of movables of different pieces whose `boxes` (n_movables) overlap, but for those that
    /// `filter` excludes, each once, first < second, in no order. `piece` (n_particles) numbers pieces from 0; until
    /// the next reset it only loses edges.
    std::span<const Pair> update(std::span<const Aabb> boxes, std::span<const PieceId> piece, PairFilter filter,
                                 const WorkerPool& workers);

    size_t n_rebuilds() const { return n_rebuilds_; }

private:
    void take_pieces(std::span<const PieceId> piece, size_t n_movables);
    size_t find_who_left(std::span<const Aabb> boxes, const WorkerPool& workers);
    void find_again(std::span<const Aabb> boxes, const PairFilter& filter, const WorkerPool& workers);
    void find_all(std::span<const Aabb> boxes, const PairFilter& filter, const WorkerPool& workers);
    void bound_pieces(std::span<const Aabb> boxes, const WorkerPool& workers);
    std::span<const MovableId> members(PieceIndex piece) const {
        return std::span(member_).subspan(begin_[piece], begin_[piece + 1] - begin_[piece]);
    }
    MovableId first_of_piece(MovableIndex i) const { return member_[begin_[piece_[i]]]; }

    bool are_known_ = false, is_renumbered_ = false, self_collision_ = true;
    std::vector<PieceId> piece_;     // of each movable (n_movables)
    std::vector<uint32_t> begin_;    // of pieces in `member_`
    std::vector<MovableId> member_;  // piece after piece
    std::vector<Aabb> box_;          // of pieces (n_pieces and rigid bodies)
    std::vector<Pair> pairs_;

    Vec3 origin_ = Vec3::Zero();     // of the frame in which boxes were grown, m
    std::vector<Aabb> grown_;        // (n_movables), or empty: nothing is remembered
    std::vector<MovableId> with_;    // the first of its piece when its pairs were found (as grown_)
    std::vector<uint8_t> has_left_;  // (as grown_)
    size_t n_remembered_particles_ = 0;
    int age_ = 0, pause_ = 0;  // updates since all pairs were found; that nothing is to be remembered yet
    size_t n_rebuilds_ = 0;

    std::vector<uint32_t> partners_;  // (as box_)
    std::vector<Aabb> exposed_;       // what meets another piece's box, else empty (n_movables)
    OverlapScratch of_pieces_, of_movables_;
    std::vector<Pair> meetings_;
    std::vector<MovableId> left_;
    std::vector<std::vector<uint32_t>> met_;  // pieces, by each thread
};

}  // namespace sunder
