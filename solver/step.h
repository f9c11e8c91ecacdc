// One substep of the whole scene.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/contact_round.h"
#include "solver/contacts/scene_contacts.h"
#include "solver/matching/bending_shape.h"
#include "solver/matching/jacobi_sweep.h"
#include "solver/matching/newton_step.h"
#include "solver/material/fracture.h"
#include "solver/momentum.h"
#include "solver/scene/scene.h"
#include "solver/sleeping.h"
#include "solver/standing_loads.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Where a substep stands in its pair (`Substep::pair_up`).
enum class Stage { alone, first, second };

/// The second where one has begun.
inline Stage stage_of(bool begun, bool last) { return begun ? Stage::second : last ? Stage::alone : Stage::first; }

/// A substep of h seconds; `begin` and `end` say where in the frame it is, in [0, 1]. `measure`: it also writes the
/// strain of groups that neither flow nor break.
struct SubstepTime {
    Stage stage;
    double h, begin, end;
    bool measure;
};

/// How far a mode exp(i w t) of a piece that touches nothing gets out of phase in pairs of substeps of h seconds, over
/// (w h)^2, -.
double phase_error(double damping_time, double h);

struct Workspace;

/// Whether substeps of h seconds are short enough for a piece that touches nothing to be in pairs.
bool resolves_waves(const Workspace& work, std::span<const ParticleId> particles, double h);

/// What the second substep of a pair needs of the first, of those that are `smooth`: that touched nothing (n_movables).
struct SubstepPair {
    std::vector<uint8_t> smooth;
    std::vector<Vec3> begin_velocity, begin_spin;  // at the start of the pair
    std::vector<Vec3> position, velocity, spin;    // after the first implicit step
    std::vector<Quat> rotation;

    /// The same in a scene that was numbered anew; `former` (n_movables): the number in the scene before, or kNone.
    SubstepPair renumbered(std::span<const MovableId> former, const WorkerPool& workers) const;
};

/// Scratch of the solver: derived from rest data and the state alone, so it may be rebuilt at any time without
/// changing a bit of the result, but for `pair`, which goes on from the first to the second substep of a pair. Arrays
/// of "movables" hold the particles, then the rigid bodies.
struct Workspace {
    LiveTopology live;
    GroupShapes shapes;
    std::vector<uint8_t> synced_edges;  // what `live` was built from

    std::vector<MovingParticle> moving;            // (n_movables)
    std::vector<Vec3> start_position;              // (n_movables)
    std::vector<Quat> start_rotation;              // (n_movables), since rest
    std::vector<Vec3> velocity, angular_velocity;  // (n_movables)
    std::vector<double> span;                      // of the implicit step, s (n_movables)
    std::vector<Vec3> base;                        // where it starts from, m (n_movables)
    std::vector<Quat> base_rotation;               // (n_movables)
    std::vector<double> gamma;                     // of what is in a pair: see Substep::pair_up (n_bodies)
    SubstepPair pair;
    std::vector<double> inverse_mass;  // held: 0 (n_movables)
    std::vector<PieceId> piece;        // of `pieces` (n_movables)
    std::vector<ContactPush> push;     // (n_movables)
    std::vector<ContactPiece> pieces;  // pieces, then rigid bodies (n_pieces + n_rigid_bodies)
    ContactRound round;
    StandingLoads loads;
    std::vector<RoundPush> round_push;        // of the last round (as the islands' movables)
    std::vector<double> brace;                // of what contacts push, while it is matched (n_movables)
    std::vector<PieceMotion> piece_motion;    // zero between rounds (as pieces)
    std::vector<PieceVelocity> piece_change;  // what settling contacts gave them (as pieces)
    std::vector<Sym3> inertia;                // of particles, world (n_particles)
    std::vector<uint8_t> thin;                // groups that bend by their curvature (n_particles), or empty: none do
    std::vector<uint8_t> pinned;              // wholly held by a pin (n_particles)
    BendingShapes bending;                    // of `thin`
    std::vector<GroupStiffness> stiffness;    // (n_particles)
    std::vector<GroupGoal> goals;             // (n_particles)
    NewtonStep newton;
    JacobiSweep jacobi;
    std::vector<uint8_t> starts_unloaded;  // (n_pieces)
    std::vector<GroupStrain> strains;      // (n_particles)
    std::vector<uint8_t> flowed;           // (n_particles)
    std::vector<uint8_t> held;             // by a pin, or fixed: kFree, kHeldWhole, kHeldPlace (n_movables)
    // Of pins that are letting go: the stiffness that draws a particle to its pin, beside its inertia's, and where that
    // is at the end of the substep (n_particles), or empty: there are none.
    std::vector<double> tether;
    std::vector<Pose> tether_pose;
    std::vector<uint8_t> piece_held;       // (n_pieces)
    std::vector<uint8_t> kept;             // is where a pass before took it: Substep::break_in_hit (n_movables)
    std::vector<uint8_t> unmoved;          // held or kept (n_particles)
    std::vector<uint8_t> piece_unmoved;    // likewise (n_pieces)
    std::vector<uint8_t> is_touched;       // a contact may push it (as pieces)
    std::vector<Vec3> piece_angular;       // L the piece must have (n_pieces)
    std::vector<ActiveContact> contacts;
    // Where a substep is taken again (Substep::break_in_hit), of the pass before:
    bool is_taken_again = false;
    std::vector<ActiveContact> former_contacts;
    std::vector<PieceId> former_piece;
    std::vector<ContactPiece> former_pieces;
    std::vector<PieceVelocity> former_change;
    ContactIslands islands;  // of `contacts`
    SceneContacts detection;
    std::vector<Woken> woken;  // what is fixed and felt something
    // Where a hit asks for a substep in parts:
    int parts = 1;
    std::vector<uint8_t> hit;  // what is to take them: all that hangs together with a hit or is near (n_movables)
};

/// The movable things of a step, as contacts see them.
inline ContactBodies bodies_of(Workspace& w) {
    return {w.inverse_mass, w.piece, w.start_position, w.start_rotation, w.moving, w.pieces};
}

struct StepContext {
    const Scene& scene;
    const FrameInput& input;
    const SolverSettings& settings;
    const WorkerPool& workers;
    double contact_margin;  // how far beyond touching contacts reach, m
    // Sleepers, and what stands by: there to be touched, and nothing moves them (n_movables), or empty.
    std::span<const uint8_t> fixed = {};
    bool wakes = true;  // a substep that is felt by what is fixed ends there and tells what to wake
};

/// In `FrameState::asleep` and `StepContext::fixed`, of what moves, but not in this substep: it feels whatever may come
/// to touch it.
constexpr uint8_t kStandsBy = 2;

/// s; no substep is longer: frames of less than 24 a second are divided, whatever the settings say. Newton steps and
/// contacts take turns, and what a contact leaves to a stiff body over a longer step can be more energy than all of the
/// scene had.
constexpr double kLongestStep = 0.042;

/// Brings the workspace in line with a state that was set from outside.
void synchronise(const StepContext& context, const FrameState& state, Workspace& io_work);
/// The rest shapes of thin groups as they stand.
void take_up_bending(const StepContext& context, const FrameState& state, Workspace& io_work);

/// The same for a scene that was numbered anew; `former` (n_particles): the number in the scene before, or kNone,
/// ascending. What a particle that kept its ring had is taken over.
void renumber(const StepContext& context, const FrameState& state, std::span<const ParticleId> former,
              Workspace& io_work);

/// Advances by a substep. On an error the state is spoilt: keep a copy. Where `woken` is not empty afterwards the state
/// is as before: wake those, and take the substep again; and where `parts` is above 1: take it in so many.
Status substep(const StepContext& context, const SubstepTime& time, Workspace& io_work, FrameState& io_state,
               StepReport& io_report);

}  // namespace sunder
