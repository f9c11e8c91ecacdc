// Energy of a state, computed from the formulas of docs/theory.md and not by the solver's own code.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>

#include "solver/scene/motion.h"
#include "solver/solver.h"

namespace sunder::test {

struct Energy {
    double motion = 0;   // of particles' centres, J
    double turning = 0;  // of particles about their centres, J
    double rigid = 0;    // of rigid bodies, J
    double elastic = 0;  // of groups, J
    double height = 0;   // in gravity, J
    double kinetic() const { return motion + turning + rigid; }
    double total() const { return kinetic() + elastic + height; }
};

namespace detail {

inline Mat3 nearest_rotation(const Mat3& A) {
    const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 sign = Mat3::Identity();
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign(2, 2) = -1;
    return svd.matrixU() * sign * svd.matrixV().transpose();
}

/// Eigenvalues a_i (ascending) and vectors of a positive semidefinite matrix, and sum f(a_i) e_i e_i^T of it.
struct Spectrum {
    Vec3 a;
    Mat3 e;
    explicit Spectrum(const Mat3& A) {
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A);
        a = eigen.eigenvalues(), e = eigen.eigenvectors();
    }
    template <class Function>
    Mat3 map(Function f) const {
        return e * a.unaryExpr(f).asDiagonal() * e.transpose();
    }
};

// A member of a group: its weight, mass, goal before turning and present offset; D of its ellipsoid, and its second
// moments as it is, M, and as the group's flow carries it, N.
struct Member {
    double w, m;
    Vec3 q, p;
    Mat3 D, M;
};

inline double member_weight(const SimulationMesh& rest, uint32_t edge) {
    if (edge == kNone) return 1;
    const Edge& e = rest.edges[edge];
    return std::clamp(4 * e.area / std::cbrt(rest.volume[e.a] * rest.volume[e.b]), 0.02, 1.0);
}

/// Weighted second moment of the rest positions of the whole one-ring, kg m2.
inline double rest_trace(const SimulationMesh& rest, uint32_t g) {
    Vec3 center = Vec3::Zero();
    double mass = 0, trace = 0;
    for (const bool second : {false, true})
        for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
            const uint32_t j = rest.group_member[s];
            const double m = member_weight(rest, rest.member_edge[s]) * rest.mass[j];
            if (second)
                trace += m * (rest.rest_position[j] - center / mass).squaredNorm();
            else
                center += m * rest.rest_position[j], mass += m;
        }
    return trace;
}

inline std::vector<Member> living_members(const SimulationMesh& rest, const FrameState& state, uint32_t g) {
    std::vector<Member> members;
    const Mat3& F_P = state.plastic_deformation[g];
    Vec3 rest_center = Vec3::Zero(), center = Vec3::Zero();
    double mass = 0;
    for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
        const uint32_t j = rest.group_member[s], edge = rest.member_edge[s];
        if (edge != kNone && !state.edge_intact[edge]) continue;
        const Mat3 Q = rest.rest_orientation[j].toRotationMatrix();
        const Vec3 A_j = rest.mass[j] / 5 * rest.radii[j].cwiseProduct(rest.radii[j]);
        const Mat3 M = Q * A_j.asDiagonal() * Q.transpose();
        const double hold = edge == kNone || state.edge_hold.empty() ? 1 : state.edge_hold[edge];
        members.push_back({hold * member_weight(rest, edge), rest.mass[j], rest.rest_position[j], state.position[j],
                           state.orientation[j].toRotationMatrix() * Q.transpose(), M});
        const Member& i = members.back();
        rest_center += i.w * i.m * i.q, center += i.w * i.m * i.p, mass += i.w * i.m;
    }
    for (Member& i : members) i.q = F_P * (i.q - rest_center / mass), i.p -= center / mass;
    return members;
}

/// E_g of docs/theory.md, "Elasticity".
inline double elastic_energy(const SimulationMesh& rest, const Material& material, const FrameState& state,
                             uint32_t g) {
    const std::vector<Member> members = living_members(rest, state, g);
    if (members.size() < 2) return 0;
    constexpr double kOrientations = 0.15, kStretches = 0.02, kThinnest = 0.25, kFlat = 1e-6;
    Mat3 A_pq = Mat3::Zero(), A_qq = Mat3::Zero(), turned = Mat3::Zero(), ellipsoids = Mat3::Zero();
    for (const Member& i : members) {
        A_pq += i.w * i.m * i.p * i.q.transpose(), A_qq += i.w * i.m * i.q * i.q.transpose();
        turned += i.w * i.D * i.M, ellipsoids += i.w * i.M;
    }
    const Spectrum spectrum(A_qq), with_ellipsoids(A_qq + kStretches * ellipsoids);
    const double most = spectrum.a.maxCoeff(), a_max = with_ellipsoids.a.maxCoeff();
    const auto thick = [&](double a) { return a > kFlat * most; };
    const Mat3 inverse = spectrum.map([&](double a) { return thick(a) ? 1 / a : 0.0; });
    const Mat3 flat = spectrum.map([&](double a) { return thick(a) ? 0.0 : 1.0; });
    const Mat3 Q =
        spectrum.map([&](double a) { return thick(a) ? A_qq.trace() / 3 / std::max(a, kThinnest * most) : 1; });
    const Mat3 R = nearest_rotation(A_pq * Q + kOrientations * turned), F = A_pq * inverse + R * flat;
    const Mat3 W = with_ellipsoids.map([&](double a) { return 1 / std::max(a, kThinnest * a_max); });

    double sum = ((F - R) * Q * A_qq * (F - R).transpose()).trace();
    for (const Member& i : members) {
        sum += i.w * i.m * (i.p - F * i.q).squaredNorm();
        sum += 2 * kOrientations * i.w * (i.M.trace() - (i.D * i.M * R.transpose()).trace());
    }
    const double nu = material.poisson_ratio, mu = material.youngs_modulus / (2 * (1 + nu));
    const double volume = rest.volume[g] / rest_trace(rest, g), lambda = 2 * mu * nu / (1 - 2 * nu);
    const double pressed = (R.transpose() * A_pq * W).trace() - (A_qq * W).trace();
    const double factor = state.stiffness_factor.empty() ? 1 : state.stiffness_factor[g];
    return factor * (3 * mu * volume * sum + lambda / 2 * volume * A_qq.trace() * pressed * pressed);
}

}  // namespace detail

/// One material for all bodies; `scene` as the solver holds it (one-rings built).
inline Energy energy(const Scene& scene, const Material& material, const Vec3& gravity, const FrameState& state) {
    Energy e;
    const SimulationMesh& rest = scene.rest;
    for (uint32_t i = 0; i < state.n_particles(); ++i) {
        const Vec3 squared = rest.radii[i].cwiseProduct(rest.radii[i]);
        const Vec3 moments = rest.mass[i] / 5 * (squared.sum() * Vec3::Ones() - squared);
        const Vec3 w = state.orientation[i].conjugate() * state.angular_velocity[i];
        e.motion += 0.5 * rest.mass[i] * state.velocity[i].squaredNorm();
        e.turning += 0.5 * w.dot(moments.cwiseProduct(w));
        e.height -= rest.mass[i] * gravity.dot(state.position[i]);
        e.elastic += detail::elastic_energy(rest, material, state, i);
    }
    for (size_t r = 0; r < state.rigid_bodies.size(); ++r) {
        const RigidBodyState& b = state.rigid_bodies[r];
        const Vec3 w = b.orientation.conjugate() * b.angular_velocity;
        e.rigid += 0.5 * scene.rigid_bodies[r].mass * b.velocity.squaredNorm();
        e.rigid += 0.5 * w.dot(rigid_body_inertia(scene.rigid_bodies[r]).cwiseProduct(w));
        e.height -= scene.rigid_bodies[r].mass * gravity.dot(b.position);
    }
    return e;
}

}  // namespace sunder::test
