// Energy of a state, computed from the formulas of docs/theory.md and not by the solver's own code.
#pragma once

#include <Eigen/SVD>

#include "solver/motion.h"
#include "solver/solver.h"

namespace sunder::test {

struct Energy {
    double motion = 0;   // of particles' centres, J
    double turning = 0;  // of particles about their centres, J
    double rigid = 0;    // of rigid bodies, J
    double elastic = 0;  // of groups, without the pressure term: exact for Poisson's ratio 0, J
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

inline Vec3 mean(const SimulationMesh& rest, const std::vector<uint32_t>& members, const std::vector<Vec3>& x) {
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (uint32_t j : members) sum += rest.mass[j] * x[j], mass += rest.mass[j];
    return sum / mass;
}

/// k_g/2 { sum m_j |x_j - c - R q_j|^2 + 2 sum [tr N_j - tr(D_j N_j R^T)] },   k_g = 6 mu V_g / tr(rest one-ring).
inline double elastic_energy(const SimulationMesh& rest, const Material& material, const FrameState& state,
                             uint32_t g) {
    std::vector<uint32_t> ring, live;
    for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
        ring.push_back(rest.group_member[s]);
        const uint32_t edge = rest.member_edge[s];
        if (edge == SimulationMesh::kNone || state.edge_intact[edge]) live.push_back(rest.group_member[s]);
    }
    if (live.size() < 2) return 0;
    double trace = 0;
    const Vec3 ring_center = mean(rest, ring, rest.rest_position);
    for (uint32_t j : ring) trace += rest.mass[j] * (rest.rest_position[j] - ring_center).squaredNorm();
    const double k = 3 * material.youngs_modulus / (1 + material.poisson_ratio) * rest.volume[g] / trace;

    const Mat3& F_P = state.plastic_deformation[g];
    const Vec3 rest_center = mean(rest, live, rest.rest_position), center = mean(rest, live, state.position);
    Mat3 A_pq = Mat3::Zero();
    std::vector<Mat3> D, N;
    for (uint32_t j : live) {
        const Mat3 Q = rest.rest_orientation[j].toRotationMatrix();
        const Vec3 A_j = rest.mass[j] / 5 * rest.radii[j].cwiseProduct(rest.radii[j]);
        N.push_back(F_P * Q * A_j.asDiagonal() * Q.transpose() * F_P.transpose());
        D.push_back(state.orientation[j].toRotationMatrix() * Q.transpose());
        A_pq += rest.mass[j] * (state.position[j] - center) * (F_P * (rest.rest_position[j] - rest_center)).transpose();
        A_pq += D.back() * N.back();
    }
    const Mat3 R = nearest_rotation(A_pq);
    double energy = 0;
    for (size_t i = 0; i < live.size(); ++i) {
        const uint32_t j = live[i];
        const Vec3 goal = center + R * F_P * (rest.rest_position[j] - rest_center);
        energy += 0.5 * rest.mass[j] * (state.position[j] - goal).squaredNorm();
        energy += N[i].trace() - (D[i] * N[i] * R.transpose()).trace();
    }
    return k * energy;
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
