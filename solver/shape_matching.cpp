#include "solver/shape_matching.h"

#include <cmath>

#include "solver/polar_decomposition.h"

namespace sunder {
namespace {

// A += D N for symmetric N, written out: this is the inner loop.
inline void add_product(Mat3& A, const Mat3& D, const Sym3& N) {
    for (int r = 0; r < 3; ++r) {
        A(r, 0) += D(r, 0) * N[0] + D(r, 1) * N[3] + D(r, 2) * N[4];
        A(r, 1) += D(r, 0) * N[3] + D(r, 1) * N[1] + D(r, 2) * N[5];
        A(r, 2) += D(r, 0) * N[4] + D(r, 1) * N[5] + D(r, 2) * N[2];
    }
}

}  // namespace

GroupMoments group_moments(const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const MovingParticle> particles, uint32_t g) {
    GroupMoments m{Mat3::Zero(), Mat3::Zero(), Vec3::Zero()};
    const Vec3 origin = particles[g].x;  // relative to the centre particle: exact far from the world's origin
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        const MovingParticle& p = particles[live.member(s)];
        const MemberShape& member = shapes.member[s];
        const Vec3 mp = member.mass * (p.x - origin);
        m.center += mp;
        m.positions.noalias() += mp * member.q.transpose();  // sum m q = 0, so the centre of mass drops out
        add_product(m.ellipsoids, p.D, member.moment);
    }
    m.center = origin + m.center / shapes.group[g].mass;
    return m;
}

void match_groups(const LiveTopology& live, const GroupShapes& shapes, std::span<const GroupStiffness> stiffness,
                  double h, std::span<const MovingParticle> particles, size_t begin, size_t end,
                  std::span<GroupGoal> io_goals) {
    for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g) {
        GroupGoal& goal = io_goals[g];
        if (live.count(g) == 1) {  // a lone particle matches itself wherever it is
            goal.center = particles[g].x;
            goal.G = particles[g].D;
            goal.rotation = particles[g].d;
            goal.weight = goal.weight_bound = 0;
            continue;
        }
        const GroupShape& shape = shapes.group[g];
        const GroupMoments A = group_moments(live, shapes, particles, g);
        goal.center = A.center;
        const Mat3 A_balanced = A.positions * shape.isotropy;
        goal.rotation = optimal_rotation(A_balanced + kOrientationWeight * A.ellipsoids, goal.rotation);
        const Mat3 R = goal.rotation.toRotationMatrix();
        goal.G = R * shape.isotropy + (A.positions - A_balanced) * shape.affine_inverse;
        goal.weight = h * h * stiffness[g].k;
        goal.weight_bound = goal.weight * shape.most_isotropy;
        if (const double ratio = stiffness[g].volume_ratio; ratio > 0) {
            // Pressure: E = lambda/2 V (tr(R^T A_pq W) - tr(A_qq W))^2 beside the mu |F - R|^2 of shape matching;
            // its gradient at member j is lambda V (...) R W m_j q_j.
            const double volume_strain =
                (R.transpose() * A.positions * shape.volume_gradient).trace() - shape.volume_rest;
            const Mat3 spread = shape.positions_trace / 3 * shape.volume_gradient;
            goal.G -= ratio * volume_strain * R * spread;
            goal.weight_bound += goal.weight * (ratio * 3 * spread.norm() / std::sqrt(3.0));
        }
    }
}

void average_goals(const LiveTopology& live, const GroupShapes& shapes, std::span<const GroupGoal> goals, double omega,
                   std::span<const uint8_t> held, size_t begin, size_t end, std::span<MovingParticle> io_particles) {
    for (uint32_t j = static_cast<uint32_t>(begin); j < end; ++j) {
        if (held[j] || live.count(j) == 1) continue;
        MovingParticle& p = io_particles[j];
        Vec3 pull = p.x_inertial - p.x;
        // Rotations as quaternions on p.d's side of the sphere: the weighted sum points at the chordal mean.
        Eigen::Vector4d turn = p.d_inertial.coeffs() * (p.d_inertial.dot(p.d) < 0 ? -1.0 : 1.0);
        double total = 1.0, total_turn = 1.0;
        for (uint32_t s = live.begin(j); s < live.end(j); ++s) {
            const GroupGoal& goal = goals[live.member(s)];
            const MemberShape& m = shapes.member[live.twin(s)];
            pull += m.weight * goal.weight * (goal.center + goal.G * m.q - p.x);
            const double turn_weight = kOrientationWeight * m.weight * goal.weight;
            turn += (goal.rotation.dot(p.d) < 0 ? -turn_weight : turn_weight) * goal.rotation.coeffs();
            total += m.weight * goal.weight_bound;
            total_turn += turn_weight;
        }
        p.x += omega / total * pull;
        p.d.coeffs() += omega * (turn / total_turn - p.d.coeffs());
        p.d.normalize();
        p.D = p.d.toRotationMatrix();
    }
}

void restore_linear_momentum(const SimulationMesh& rest, const LiveTopology& live, std::span<const uint8_t> piece_held,
                             size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles) {
    for (size_t piece = begin_piece; piece < end_piece; ++piece) {
        const auto particles = live.piece_particles(piece);
        if (piece_held[piece] || particles.size() == 1) continue;
        Vec3 departure = Vec3::Zero();
        double mass = 0;
        for (uint32_t j : particles) {
            departure += rest.mass[j] * (io_particles[j].x - io_particles[j].x_inertial);
            mass += rest.mass[j];
        }
        departure /= mass;
        for (uint32_t j : particles) io_particles[j].x -= departure;
    }
}

}  // namespace sunder
