// What moves in a step, and the moments of shape matching, group by group.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/group_shape.h"

namespace sunder {

/// A particle during a step. Rotations are relative to rest: D = q qbar^-1.
struct MovingParticle {
    Vec3 x;           // present position, m
    Quat d;           // present rotation since rest
    Vec3 x_inertial;  // where inertia (and contacts) take it, m
    Quat d_inertial;
};

/// What a group remembers of the last sweep.
struct GroupGoal {
    Quat rotation;  // optimal rotation R; warm start of the next one
};

/// A_pq of a group: members' part and ellipsoids' part, kg m2; and the centre of mass, m.
struct GroupMoments {
    Mat3 positions, ellipsoids;
    Vec3 center;
};
GroupMoments group_moments(const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const MovingParticle> particles, ParticleIndex g);

/// Sweeps and Newton steps that stop early give linear momentum away; taking out each piece's mean departure from its
/// inertial path gives the piece's linear momentum back exactly. Pieces with a held particle are left alone.
void restore_linear_momentum(const SimulationMesh& rest, const LiveTopology& live, std::span<const uint8_t> piece_held,
                             size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles);

}  // namespace sunder
