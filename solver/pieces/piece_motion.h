// How pieces and rigid bodies move as wholes in a substep, and what contacts add to it.
#pragma once

#include <span>

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Fills `whole` and `angular` from the start of the step, its predicted velocities and what contacts pushed so far; of
/// what is held, or bound and `smooth` (second_order.h; n_movables), that it is so. Call before contacts are prepared.
void remember_pieces(const StepContext& context, double h, const LiveTopology& live, std::span<const uint8_t> smooth,
                     const Movables& movables, Pieces& io_pieces);

/// A turn of a substep above which ways of it are no velocities: at its end they point outwards, and the next step
/// begins with what they tear, rad.
inline constexpr double kFarTurn = 0.5;
/// Whether something bends in these particles, one piece, whose waves steps of h seconds do not resolve.
bool bends_stiffly(const LiveModel& model, std::span<const ParticleId> particles, double h);

/// Where inertia takes a free piece that bends, whose waves are not resolved, and that turns by more than 0.5 rad in
/// the substep: its particles turn with it, as a free rigid body turns, and go their own ways within it. Straight ways
/// lead it apart, to a strain of 1 where it turns by a radian, and no Newton step leads back to a bent shape from
/// there. `smooth`: of what is in a pair (second_order.h; n_movables). Call after `predict`.
void predict_turns(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                   std::span<const uint8_t> smooth, Movables& io_movables);

/// The same of velocities, once contacts are settled, of what turned so far: they become those of a rigid body. None
/// with these momenta has less energy. `position`: of particles at the end of the substep, m (n_particles).
void keep_rigid_motion(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                       std::span<const uint8_t> smooth, std::span<const Vec3> position, Movables& io_movables);

/// Before the first Newton step: a free piece that bends, that nothing touches, and whose waves are not resolved,
/// starts with the shape that it has, turned as a whole as far as its particles' ways turn it. Straight ways swell what
/// spins, and velocities against each other, which stiffness takes up within the step, strain it: what ends the solve
/// is measured by what it begins with, and beside such strains what a bar resists its bend with is nothing.
void start_in_shape(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                    const Pieces& pieces, Movables& io_movables);

/// Of free pieces of several particles that nothing touches: what is so stiff that its waves are not resolved turns as
/// a rigid body turns. An implicit step of it ends with a torque that is small beside those within it, but not beside
/// what turns all of it: with all of its angular momentum it came to spin about its longest axis, at 1.35 times
/// its energy. Turns of 0.02 rad a substep and more; of what does not bend up to 0.5. Call after shape matching.
void tumble_pieces(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                   const Pieces& pieces, std::span<GroupGoal> io_goals, Movables& io_movables);

/// After the last round, before `move_pieces`: of what contacts gave to held pieces, what went beyond the particle that
/// was pushed is the pins' as far as positions go. What of it the piece still has in its own motion
/// (`slow_held_pieces`) it loses.
void note_what_pins_take(const SimulationMesh& rest, double h, const LiveTopology& live, const ContactProblem& problem,
                         IslandId island, const Movables& movables, Pieces& io_pieces);

/// Takes from the velocities of held pieces the momentum that their contacts took and no particle gave, as far as that
/// takes energy: what swings into its contacts is slowed by them, and what they press on at rest stays.
void slow_held_pieces(const StepContext& context, const LiveTopology& live, const Movables& movables,
                      Pieces& io_pieces);

/// Fills `turned` of these pieces, before a round: the rotation of the whole that has their angular
/// momentum, of what they moved by since the start of the substep.
void turn_pieces(const SimulationMesh& rest, const LiveTopology& live, std::span<const PieceId> which,
                 const Movables& movables, Pieces& io_pieces);

/// After a round over the contacts of an island: hands what they added to the pieces on to their particles.
/// `as_wholes`: to where inertia takes these, and to where they are only what moves all of a piece. A Newton step is to
/// start from a shape that the material knows: under a load a particle alone would go by many times its spacing before
/// the material, too, pulls, and no rotation fits what is left of its group.
void move_pieces(const SimulationMesh& rest, const LiveTopology& live, const ContactProblem& problem, IslandId island,
                 bool as_wholes, Movables& io_movables, Pieces& io_pieces);

/// After the last round: lone fragments and rigid bodies turn freely with the angular momentum that they had and were
/// given, and get their angular velocity.
void turn_rigid_things(const StepContext& context, double h, const LiveTopology& live, const Pieces& pieces,
                       Movables& io_movables);

/// Gives its `change` to all of each piece.
void change_velocities(const StepContext& context, const LiveTopology& live, const Pieces& pieces,
                       Movables& io_movables);

}  // namespace sunder
