// How pieces and rigid bodies move as wholes in a substep, and what contacts add to it.
#pragma once

#include "solver/step.h"

namespace sunder {

/// Fills `pieces` and `piece_angular` from the start of the substep, its predicted velocities and what contacts pushed
/// so far; of what is held, or bound and in a pair, that it is so. Call before contacts are prepared.
void remember_pieces(const StepContext& context, double h, Workspace& io_work);

/// Of free pieces of several particles that nothing touches: what is so stiff that its waves are not resolved turns as
/// a rigid body turns. An implicit step of it ends with a torque that is small beside those within it, but not beside
/// what turns all of it: with all of its angular momentum it came to spin about its longest axis, at 1.35 times
/// its energy. Call after shape matching.
void tumble_pieces(const StepContext& context, double h, Workspace& io_work);

/// The sum of b = h^2 k over the groups of a particle: what they hold it with in a substep, over its mass.
double sum_of_pulls(const Workspace& work, double h, ParticleIndex particle);

/// Fills `own_share` of the pieces of an island of contacts. A push on a bound particle in an implicit
/// step moves the particle by (H^-1)_jj, which lies between 1/(m_j (1 + sum_g b_g)), were its neighbours held, and
/// 1/m_j, were they absent. Before another sweep of shape matching the upper bound is taken for pieces with broken
/// edges: the sweep finds the true motion, and a contact that took less would have pushed too hard (a fragment on a
/// hinge gives like a free one). In unbroken pieces a particle that is pushed together with those beside it, as where
/// bodies lie on one another, gives more than alone: a load on a face moves all that waves of speed c reach in the
/// step, d / (c h) of 1/m_j, and no more than the piece is thick. Contacts that took less would push harder than what
/// they carry weighs, and a stack would throw itself off. After the last sweep nothing would mend the strain that this
/// makes in stiff bodies, so there a particle moves by little more than the lower bound and its piece as a whole by the
/// rest; contacts within a piece, which no motion of the whole can part, are left as the sweep found them.
void divide_pushes(const StepContext& context, double h, bool last, IslandId island, Workspace& io_work);

/// After the last round, before `move_pieces`: of what contacts gave to held pieces, what went beyond the particle that
/// was pushed is the pins' as far as positions go. What of it the piece still has in its own motion
/// (`slow_held_pieces`) it loses.
void note_what_pins_take(const StepContext& context, double h, IslandId island, Workspace& io_work);

/// Takes from the velocities of held pieces the momentum that their contacts took and no particle gave, as far as that
/// takes energy: what swings into its contacts is slowed by them, and what they press on at rest stays.
void slow_held_pieces(const StepContext& context, Workspace& io_work);

/// Fills `turned` of the pieces of an island, before a round: the rotation of the whole that has their angular
/// momentum, of what they moved by since the start of the substep.
void turn_pieces(const StepContext& context, IslandId island, Workspace& io_work);

/// After a round over the contacts of an island: hands what they added to the pieces on to their particles.
/// `as_wholes`: to where inertia takes these, and to where they are only what moves all of a piece. A Newton step is to
/// start from a shape that the material knows: under a load a particle alone would go by many times its spacing before
/// the material, too, pulls, and no rotation fits what is left of its group.
void move_pieces(const StepContext& context, bool as_wholes, IslandId island, Workspace& io_work);

/// After the last round: lone fragments and rigid bodies turn freely with the angular momentum that they had and were
/// given, and get their angular velocity.
void turn_rigid_things(const StepContext& context, double h, Workspace& io_work);

/// Gives `piece_change` to all of each piece.
void change_velocities(const StepContext& context, Workspace& io_work);

}  // namespace sunder
