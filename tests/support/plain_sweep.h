// Shape matching written plainly, a group at a time in double precision: what the kernels are tested against.
#pragma once

#include <cmath>
#include <span>

#include "solver/matching/polar_decomposition.h"
#include "solver/matching/shape_matching.h"

namespace sunder::test {

/// What a group asks of its members: member j wants to be at center + G q_j, turned by R.
struct PlainGoal {
    Vec3 center;          // m
    Mat3 G;               // R Q + F (I - Q) - pressure, -
    Quat rotation;        // optimal rotation R
    double weight;        // b_g = h^2 / alpha_g, -
    double weight_bound;  // the same with the volume term: what keeps a sweep stable
};

/// Local step: the goals of all groups, from the rotations in `io_goals`.
inline void plain_match(const LiveTopology& live, const GroupShapes& shapes, std::span<const GroupStiffness> stiffness,
                        double h, std::span<const MovingParticle> particles, std::span<PlainGoal> io_goals) {
    for (uint32_t g = 0; g < io_goals.size(); ++g) {
        PlainGoal& goal = io_goals[g];
        if (live.count(g) == 1) {  // a lone particle matches itself wherever it is
            goal.center = particles[g].x;
            goal.G = particles[g].d.toRotationMatrix();
            goal.rotation = particles[g].d;
            goal.weight = goal.weight_bound = 0;
            continue;
        }
        const GroupShape& shape = shapes.group[g];
        const GroupMoments A = group_moments(live, shapes, particles, g);
        goal.center = A.center;
        Mat3 turned = Mat3::Zero();  // what members' rotations say: their ellipsoids do not flow with the group
        for (uint32_t s = live.begin(g); s < live.end(g); ++s)
            turned += shapes.member[s].weight * particles[live.member(s)].d.toRotationMatrix() *
                      to_matrix(shapes.particle_moment[live.member(s)]);
        const Mat3 isotropy = to_matrix(shape.isotropy), A_balanced = A.positions * isotropy;
        goal.rotation = optimal_rotation(A_balanced + kOrientationWeight * turned, goal.rotation);
        const Mat3 R = goal.rotation.toRotationMatrix();
        goal.G = R * isotropy + A.positions * to_matrix(shape.N);
        goal.weight = h * h * stiffness[g].k;
        goal.weight_bound = goal.weight * shape.most_isotropy;
        if (const double ratio = stiffness[g].volume_ratio; ratio > 0) {
            // Pressure: E = lambda/2 V (tr(R^T A_pq W) - tr(A_qq W))^2 beside the mu |F - R|^2 of shape matching;
            // its gradient at member j is lambda V (...) R W m_j q_j.
            const double volume_strain =
                (R.transpose() * A.positions * to_matrix(shape.volume_gradient)).trace() - shape.volume_rest;
            const Mat3 spread = shape.positions_trace / 3 * to_matrix(shape.volume_gradient);
            goal.G -= ratio * volume_strain * R * spread;
            goal.weight_bound += goal.weight * (ratio * 3 * spread.norm() / std::sqrt(3.0));
        }
    }
}

/// x <- x + omega [ (x_inertial - x) + sum_g w b_g (goal_g - x) ] / (1 + sum_g w b_g),   rotations likewise.
inline void plain_average(const LiveTopology& live, const GroupShapes& shapes, std::span<const PlainGoal> goals,
                          double omega, std::span<const Role> role, std::span<MovingParticle> io_particles) {
    for (uint32_t j = 0; j < io_particles.size(); ++j) {
        if (role[j] != Role::free || live.count(j) == 1) continue;
        MovingParticle& p = io_particles[j];
        Vec3 pull = p.x_inertial - p.x;
        // Rotations as quaternions on p.d's side of the sphere: the weighted sum points at the chordal mean.
        Eigen::Vector4d turn = p.d_inertial.coeffs() * (p.d_inertial.dot(p.d) < 0 ? -1.0 : 1.0);
        double total = 1.0, total_turn = 1.0;
        for (uint32_t s = live.begin(j); s < live.end(j); ++s) {
            const PlainGoal& goal = goals[live.member(s)];
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
    }
}

}  // namespace sunder::test
