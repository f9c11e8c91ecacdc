// A round over the contacts of a substep: projected Gauss-Seidel passes on impulses, eight contacts side by side. What
// they move is only added up while the round lasts, linear in the impulses and packed island by island, in single
// precision; when it ends, what is given to the pieces is found from the impulses in double precision, equal and
// opposite.
#pragma once

#include <algorithm>
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
                  // part, are left alone, and the others start from no less than `before`
    };
    /// Takes up where things are, and, to begin with, contacts. `length`: a typical small one, such as the contact
    /// margin, the same in all rounds of a substep, m.
    void begin(const ContactBodies& bodies, const ContactIslands& islands, Which which, double length,
               const WorkerPool& workers, std::span<const ActiveContact> contacts);

    /// Displacement of a's touching point less that of b's since the start of the substep, m; of the contact at `place`
    /// of the islands' list.
    Vec3 motion(size_t place) const;

    /// Solves every island to where no pass changes a gap by more than `enough` (m), within so many passes as pay: 106
    /// in all where everything is rigid, 26 where something hangs on hinges; accelerated like nonlinear conjugate
    /// gradients (Silcowitz-Hansen, Niebuhr, Erleben 2010), so that tall stacks and heavy on light stand. Threads share
    /// out islands.
    void relax(double enough, const WorkerPool& workers);

    /// What the round's impulses moved; `io_push` and `io_motion` must be zero, and stay so where the islands touch
    /// nothing.
    void end(const ContactBodies& bodies, const WorkerPool& workers, std::span<RoundPush> io_push,
             std::span<PieceMotion> io_motion);

    /// After the last round: writes impulses back.
    void hand_over(const WorkerPool& workers, std::span<ActiveContact> io_contacts) const;

private:
    struct Range {
        uint32_t begin, end;
    };
    enum class Gives { nowhere, softly, on_hinges };
    // Of an island; powers of two, so that numbers come back as they were.
    struct Units {
        double length = 1, mass = 1;  // m, kg
        double impulse() const { return length * mass; }
    };
    // What a contact gives to its movables is found from these.
    struct Exact {
        Vec3 normal, arm_a, arm_b;  // -, m
    };
    // What a contact gave in former rounds, in units of its island.
    struct RoundImpulse {
        float normal = 0, friction[3] = {}, rolling[3] = {};
    };
    // Sums of impulses (units of the island) and of their couples (times m).
    struct Given {
        Vec3 impulse = Vec3::Zero(), couple = Vec3::Zero();
    };

    static Vec3 vector(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

    // Calls body(island) for each, the largest first, by whichever thread is free.
    template <class Body>
    void for_islands(const WorkerPool& workers, size_t grain, const Body& body) const {
        if (islands_->contact.size() < 2 * grain)
            std::ranges::for_each(by_size_, body);
        else
            workers.for_each(by_size_.size(), [&](size_t k) { body(by_size_[k]); });
    }
    // Calls body(place, island) for all contacts, shared out.
    template <class Body>
    void for_places(const WorkerPool& workers, const Body& body) const {
        const std::vector<uint32_t>& offset = islands_->offset;
        workers.for_range(islands_->contact.size(), kRowGrain, [&](size_t first, size_t end) {
            auto island = static_cast<uint32_t>(std::ranges::upper_bound(offset, first) - offset.begin() - 1);
            for (size_t place = first; place < end; ++place) {
                while (offset[island + 1] <= place) ++island;
                body(place, island);
            }
        });
    }
    // contact_round_start.cpp
    void order_islands();
    Units units_of(const ContactBodies& bodies, uint32_t island) const;
    void take_up_movables(const ContactBodies& bodies, const WorkerPool& workers);
    Gives how_it_gives(const ContactBodies& bodies, uint32_t island, std::span<const ActiveContact> contacts) const;
    void take_up_contacts(const ContactBodies& bodies, const WorkerPool& workers,
                          std::span<const ActiveContact> contacts);
    void note_what_was_given(const WorkerPool& workers);
    void start_from_before(const WorkerPool& workers, std::span<const ActiveContact> contacts);
    void give(const WorkerPool& workers);
    bool goes_with_its_piece(uint32_t movable, uint32_t piece, const float (&arm)[3]) const;
    BatchMember member_of(const ContactBodies& bodies, size_t place) const;
    void form_batches(const ContactBodies& bodies, const WorkerPool& workers);
    ContactArrays arrays();
    // contact_round.cpp
    Vec3 moved(const ContactBatch& batch, int side, uint32_t lane) const;
    void end_contacts(uint32_t island);
    void end_island(const ContactBodies& bodies, uint32_t island, std::span<RoundPush> io_push,
                    std::span<PieceMotion> io_motion);
    void relax_island(size_t island, double enough);

    // Fewest contacts that threads are worth waking for: to solve, to set up, and to hand over what was solved.
    static constexpr size_t kGrain = 16, kRowGrain = 256, kHandOverGrain = 1024;

    const ContactIslands* islands_ = nullptr;
    Which which_ = Which::first;
    double length_ = 1;              // units of all islands, m
    std::vector<Units> units_;       // (n_islands)
    std::vector<Gives> gives_;       // (n_islands)
    std::vector<uint32_t> by_size_;  // islands, those with most contacts first
    ContactBatches batches_;
    std::vector<RoundContact> taken_;      // as the islands' contacts, with the impulses that the last round left them;
                                           // then what stands for none, one an island
    std::vector<RoundImpulse> already_;    // as the islands' contacts
    std::vector<Exact> exact_;             // as the islands' contacts
    std::vector<uint8_t> separate_;        // as the islands' contacts: between separate pieces
    std::vector<BatchMember> members_;     // as the islands' contacts
    std::vector<uint32_t> taken_of_lane_;  // eight a batch
    std::vector<ContactBatch> contacts_;   // as batches_
    std::vector<BatchStart> starts_;       // as batches_
    std::vector<uint8_t> idle_;            // batches without impulses
    std::vector<uint32_t> all_, active_;   // batches, island by island
    std::vector<RoundMovable> movables_;   // by slot; then what colliders are, one an island, which never moves
    std::vector<RoundPiece> pieces_;
    std::vector<RoundBegan> began_;       // as movables
    std::vector<PushDivision> division_;  // (n_movables)
    // Of movables and pieces: where the last pass began, and the direction that passes follow.
    std::vector<float> movable_before_, movable_direction_, piece_before_, piece_direction_;
    std::vector<Given> given_;  // as movables; of colliders: anything
};

}  // namespace sunder
