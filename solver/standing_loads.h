// What stands on something soft, and something soft that lies on what does not give, are matched together.
//
// Rounds over contacts and Newton steps take turns, and neither sees the other's inertia: what carries a weight springs
// back as if it carried none, and the round that follows lifts the weight by all that it had sunk in. So a weight sank
// by up to half too far, or not at all, as the substep had it, and trembled; where a Newton step was all of the
// substep what was ten times as heavy as a plank was thrown off it.
#pragma once

#include "solver/contacts/contact_islands.h"

namespace sunder {

struct StepContext;
struct Workspace;

/// A contact at which a load, or ground, presses on a particle of a piece that gives. A load is a lone fragment or a
/// rigid body that one such piece holds up, and nothing else that gives, nor ground; ground is what nothing moves: a
/// collider, a sleeper.
struct Bearing {
    enum class Of : uint8_t { nothing, load, ground };
    Of of = Of::nothing;
    bool of_a = true;           // the particle is the contact's a
    double mass = 0;            // of what presses, its share; 0: it does not press, kg
    Vec3 given = Vec3::Zero();  // in a Newton step, to the contact's a, kg m
};

/// The loads of a substep.
struct StandingLoads {
    enum class How : uint8_t {
        not_at_all,
        kept,     // contacts start from a part of their last forces
        together  // likewise, but bearings start from nothing: what presses there is matched with what bears it
    };
    struct OfMovable {
        double pressure = 0;             // of its bearings, kg m
        Vec3 held_up = Vec3::Zero();     // by them, kg m
        double pull = 0;                 // of their particles' groups on these, kg
        PieceId on;                      // the piece that bears it
        bool is_load = true;
        double mass = 0, ground = 0;    // of what presses on it, and of that ground's, kg
        Vec3 begin = Vec3::Zero();      // where it is before shape matching, m
        Vec3 to_ground = Vec3::Zero();  // times `ground`, kg m
        Vec3 impulse = Vec3::Zero();    // kg m
        Vec3 torque = Vec3::Zero();     // times the substep, kg m2
        Mat3 inertia = Mat3::Zero();    // of the masses of its bearings about it, kg m2
    };
    struct OfPiece {
        Vec3 by_loads = Vec3::Zero(), by_ground = Vec3::Zero();  // impulses, kg m
        double share = 1;                                        // of by_ground that it takes
    };
    std::vector<How> how;             // (n_islands)
    std::vector<int> newton_steps;    // a substep takes so many at least (n_islands)
    std::vector<Bearing> bearings;    // as the islands' contacts
    std::vector<OfMovable> movables;  // as the islands' movables
    std::vector<OfPiece> pieces;      // as the islands' pieces

    /// Makes room; nothing stands yet.
    void open(const ContactIslands& islands);
};

/// Before the first round, where Newton steps are taken: how the loads of an island stand, and what its contacts start
/// from then; its first round is left with that. Some piece must give, none hang on hinges, and something have been
/// carried at the end of the last substep. Where nothing closes faster than what fell by half of the smallest fragment
/// loads of a single piece that gives are taken together; also the rounds between Newton steps are left with what they
/// are given then. Several that give take four Newton steps at least, with a round between each two; so does what is
/// crushed, which closes faster as it trembles. Else forces are kept where nothing closes faster than what lies still
/// and another round comes before the last: what gives pushes back by how it is bent, which no round knows of before
/// shape matching, and would take the load from it. `strain`: FrameState::strain.
void find_standing_loads(const StepContext& context, double h, std::span<const double> strain, IslandId island,
                         Workspace& io_work);

/// After a round that shape matching follows, where loads stand: what bears them is braced with their masses, shared
/// out as they press on it, and begins where the ground is.
void brace_bearers(const StepContext& context, double h, bool first, IslandId island, Workspace& io_work);

/// After shape matching, before pieces get back their momentum: what the masses resisted with is what these contacts
/// push. It goes to both sides, as far as something is pushed and friction holds, so that nothing is lost.
void pass_loads_on(const StepContext& context, IslandId island, Workspace& io_work);

}  // namespace sunder
