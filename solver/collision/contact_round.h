// A round over the contacts of a substep: projected Gauss-Seidel passes on impulses, four contacts side by side. What
// they move is only added up while the round lasts, linear in the impulses and packed island by island, and given to
// the pieces when it ends.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact_batches.h"
#include "solver/collision/contact_islands.h"
#include "solver/collision/contact_kernels.h"
#include "solver/parallel.h"

namespace sunder {

/// What a round moves a piece by, besides what it moves particles by alone.
struct PieceMotion {
    Vec3 shift = Vec3::Zero();  // m
    Vec3 turn = Vec3::Zero();   // of the particles' centres about the piece's, rad
    Vec3 spin = Vec3::Zero();   // of the particles about their own centres, rad
};

/// What a round gives to a movable thing.
struct RoundPush {
    Vec3 own = Vec3::Zero();     // displacement of it alone, m
    Vec3 shift = Vec3::Zero();   // impulse over its mass, m
    Vec3 torque = Vec3::Zero();  // angular impulse times the substep, kg m2
};

class ContactRound {
public:
    enum class Which {
        first,    // impulses that contacts have are still to be given
        between,  // they were; pushes divide as in the round before
        last      // they were, and no shape matching follows: contacts within a piece, which no motion of the whole can
                  // part, are left alone
    };
    /// Takes up contacts as they are and where their things are.
    void begin(const ContactBodies& bodies, const ContactIslands& islands, Which which, const WorkerPool& workers,
               std::span<const ActiveContact> contacts);

    /// Displacement of a's touching point less that of b's since the start of the substep, m; of the contact at `place`
    /// of the islands' list.
    Vec3 motion(size_t place) const;

    /// Solves every island to where no pass changes a gap by more than `enough` (m), within so many passes as pay: 60,
    /// or 12 where something hangs on hinges; accelerated like nonlinear conjugate gradients (Silcowitz-Hansen,
    /// Niebuhr, Erleben 2010), so that tall stacks and heavy on light stand. Threads share out islands.
    void relax(double enough, const WorkerPool& workers);

    /// Writes back impulses, and what they moved; `io_push` and `io_motion` must be zero, and stay so where the islands
    /// touch nothing.
    void end(const ContactBodies& bodies, const WorkerPool& workers, std::span<ActiveContact> io_contacts,
             std::span<RoundPush> io_push, std::span<PieceMotion> io_motion) const;

private:
    struct Range {
        uint32_t begin, end;
    };

    template <class Body>
    void for_islands(const WorkerPool& workers, size_t grain, const Body& body) const;
    void take_up_movables(const ContactBodies& bodies, const WorkerPool& workers);
    bool goes_with_its_piece(uint32_t movable, uint32_t piece, const Vec3& arm) const;
    BatchMember member_of(const ContactBodies& bodies, const ActiveContact& contact) const;
    void describe(const ContactBodies& bodies, std::span<const ActiveContact> contacts, size_t batch);
    void start(std::span<const ActiveContact> contacts, size_t batch);
    Vec3 moved(const ContactBatch& batch, int side, uint32_t lane) const;
    ContactImpulse impulse_of(uint32_t place) const;
    ContactArrays arrays();
    void relax_island(size_t island, double enough);

    const ContactIslands* islands_ = nullptr;
    Which which_ = Which::first;
    std::vector<uint32_t> by_size_;  // islands, those with most contacts first
    ContactBatches batches_;
    std::vector<BatchMember> members_;    // as the islands' contacts
    std::vector<ContactBatch> contacts_;  // as batches_
    std::vector<uint8_t> idle_;           // batches without impulses
    std::vector<uint32_t> all_, active_;  // batches, island by island
    std::vector<RoundMovable> movables_;  // by slot; then what colliders are, one an island, which never moves
    std::vector<RoundPiece> pieces_;
    std::vector<RoundBegan> began_;  // as movables
    // Of movables and pieces: where the last pass began, and the direction that passes follow.
    std::vector<double> movable_before_, movable_direction_, piece_before_, piece_direction_;
    std::vector<uint8_t> hinged_;  // (n_islands)
};

}  // namespace sunder
