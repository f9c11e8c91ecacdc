// A round over the contacts of a substep: projected Gauss-Seidel passes on impulses, eight contacts side by side. What
// they move is only added up while the round lasts, linear in the impulses and packed island by island, in single
// precision; when it ends, what is given to the pieces is found from the impulses in double precision, equal and
// opposite.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/solve/contact_batches.h"
#include "solver/contacts/solve/contact_islands.h"
#include "solver/contacts/solve/contact_kernels.h"

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
    /// Makes room. `length`: a typical small one, such as the contact margin, the same in all rounds of a substep, m.
    /// After it come `take_up` for every island, `lay_out`, and for every island `start`, `relax`, `end` and, in the
    /// last round, `hand_over`; or for some islands, the same ones in all rounds of a substep. Islands have nothing in
    /// common: each may be taken through these by any thread, and stays in its caches where it is the same one.
    void open(const ContactBodies& bodies, const ContactIslands& islands, Which which, double length,
              std::span<const ActiveContact> contacts);

    /// Where things of the island are, and in the first round its contacts.
    void take_up(IslandId island);

    /// Where batches of islands lie in memory.
    void lay_out();

    /// Moves things by what contacts are to start from and did not give before.
    void start(IslandId island);

    /// Displacement of a's touching point less that of b's since the start of the substep, m; of the contact at `place`
    /// of the islands' list.
    Vec3 motion(size_t place) const;

    /// Solves the island to where no pass changes a gap by more than `enough` (m), within so many passes as pay: 106 in
    /// all where everything is rigid, 26 where something hangs on hinges; accelerated like nonlinear conjugate
    /// gradients (Silcowitz-Hansen, Niebuhr, Erleben 2010), so that tall stacks and heavy on light stand.
    void relax(IslandId island, double enough);

    /// Of the contact at `place` of the islands' list, between rounds: what it pushes with.
    double pressure(IslandId island, size_t place) const {
        return units_[island].impulse() * taken_[place].normal_impulse;
    }
    ContactImpulse impulse(IslandId island, size_t place) const;
    /// What was not yet given of it is taken to be.
    void set_impulse(IslandId island, size_t place, const ContactImpulse& impulse);

    /// What the island's impulses moved. Of the island's are written: `io_push` (as the islands' movables), and
    /// `io_brace` (n_movables): by how many times its mass a movable that is pushed is to be kept where it is while it
    /// is matched; after the last round, 0. `io_motion` (n_pieces) must be zero.
    void end(IslandId island, std::span<RoundPush> io_push, std::span<PieceMotion> io_motion,
             std::span<double> io_brace);

    /// After the last round: writes impulses back.
    void hand_over(IslandId island, std::span<ActiveContact> io_contacts) const;

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
    // Sums of impulses (units of the island), of their couples (times m) and of what pushes along normals.
    struct Given {
        Vec3 impulse = Vec3::Zero(), couple = Vec3::Zero();
        double normal = 0;
        double met = 0;  // of the masses of what pushes it, its shares (units of the island); where pins hold something
    };

    static Vec3 vector(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

    Range places_of(IslandId island) const { return {islands_->offset[island], islands_->offset[island + 1]}; }
    // contact_round_start.cpp
    Units units_of(IslandId island) const;
    void take_up_movables(IslandId island);
    void take_up_contacts(IslandId island);
    Gives how_it_gives(IslandId island) const;
    void note_what_was_given(IslandId island);
    void start_from_before(IslandId island);
    bool goes_with_its_piece(uint32_t movable, uint32_t piece, const float (&arm)[3]) const;
    BatchMember member_of(size_t place) const;
    void form_batches(IslandId island);
    BatchForm form_of(uint32_t batch) const;
    void place_batches(IslandId island);
    void give(IslandId island);
    ContactArrays arrays();
    // contact_round.cpp
    Vec3 moved(const ContactBatch& batch, int side, uint32_t lane) const;
    void end_contacts(IslandId island);
    void share_masses_out(IslandId island);

    ContactBodies b_;                      // of the round that was opened last
    std::span<const ActiveContact> from_;  // likewise
    const ContactIslands* islands_ = nullptr;
    Which which_ = Which::first;
    double length_ = 1;         // units of all islands, m
    std::vector<Units> units_;  // (n_islands)
    std::vector<Gives> gives_;  // (n_islands)
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
    std::vector<BatchForm> form_;          // as batches_
    std::vector<uint32_t> all_, active_;   // batches, island by island
    std::vector<RoundMovable> movables_;   // by slot; then what colliders are, one an island, which never moves
    std::vector<RoundPiece> pieces_;
    std::vector<RoundBegan> began_;       // as movables
    std::vector<PushDivision> division_;  // (n_movables)
    // Of movables and pieces: where the last pass began, and the direction that passes follow.
    std::vector<float> movable_before_, movable_direction_, piece_before_, piece_direction_;
    std::vector<Given> given_;  // as movables
};

}  // namespace sunder
