// The order-free corrector: sweeps of shape matching towards the implicit Euler step ("PD-Jacobi", docs/theory.md).
#pragma once

#include <span>
#include <vector>

#include "solver/group_shape.h"
#include "solver/parallel.h"

namespace sunder {

/// A particle during a step. Rotations are relative to rest: D = q qbar^-1.
struct MovingParticle {
    Vec3 x;           // present position, m
    Quat d;           // present rotation since rest
    Mat3 D;           // the same as a matrix
    Vec3 x_inertial;  // where inertia (and contacts) take it, m
    Quat d_inertial;
};

/// What a group asks of its members: member j wants to be at center + G q_j, turned by R.
struct GroupGoal {
    Vec3 center;          // m
    Mat3 G;               // R Q + F (I - Q) - pressure, -
    Quat rotation;        // optimal rotation R; warm start of the next sweep
    double weight;        // b_g = h^2 / alpha_g, -
    double weight_bound;  // the same with the volume term: what keeps a sweep stable
};

/// A_pq of a group: members' part and ellipsoids' part, kg m2; and the centre of mass, m.
struct GroupMoments {
    Mat3 positions, ellipsoids;
    Vec3 center;
};
GroupMoments group_moments(const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const MovingParticle> particles, uint32_t g);

/// Local step: the goals of groups [begin, end).
void match_groups(const LiveTopology& live, const GroupShapes& shapes, std::span<const GroupStiffness> stiffness,
                  double h, std::span<const MovingParticle> particles, size_t begin, size_t end,
                  std::span<GroupGoal> io_goals);

/// Averaging step for particles [begin, end):
///     x <- x + omega [ (x_inertial - x) + sum_g w b_g (goal_g - x) ] / (1 + sum_g w b_g),   rotations likewise.
/// Particles with `held` set stay.
void average_goals(const LiveTopology& live, const GroupShapes& shapes, std::span<const GroupGoal> goals, double omega,
                   std::span<const uint8_t> held, size_t begin, size_t end, std::span<MovingParticle> io_particles);

/// The division above weighs particles unequally; taking out each piece's mean departure from its inertial path
/// gives the piece's linear momentum back exactly. Pieces with a held particle are left alone.
void restore_linear_momentum(const SimulationMesh& rest, const LiveTopology& live, std::span<const uint8_t> piece_held,
                             size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles);

}  // namespace sunder
