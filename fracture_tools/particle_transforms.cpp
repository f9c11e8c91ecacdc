#include "fracture_tools/particle_transforms.h"

#include <Eigen/Cholesky>

namespace sunder {
namespace {

// Share of the ring's spread that keeps the fit regular; it hides 3 * 0.03 of an elastic strain that is isotropic.
constexpr double kRegularisation = 0.03;
// Largest elastic part, Frobenius norm: I + E stays far from inverting when crushed particles have passed one another.
constexpr double kMostElastic = 0.5;

// Linear in `sum`, so it serves rates too.
Mat3 regular(const Mat3& sum) { return sum + Mat3((kRegularisation * sum.trace()) * Mat3::Identity()); }

}  // namespace

ParticleTransforms::ParticleTransforms(const SimulationMesh& rest)
    : rest_position_(rest.rest_position), rest_orientation_(rest.rest_orientation), edges_(rest.edges) {
    for (Quat& q : rest_orientation_) q.normalize();
    for (const Edge& e : edges_) {
        const double length = (rest_position_[e.b] - rest_position_[e.a]).norm();
        edge_weight_.push_back(length > 0 ? e.area / length : 0);
    }
}

void ParticleTransforms::evaluate(std::span<const Vec3> position, std::span<const Quat> orientation,
                                  std::span<const Mat3> plastic_deformation, std::span<const uint8_t> edge_intact,
                                  std::vector<Affine>& out) {
    const size_t n = rest_position_.size();
    out.resize(n), plain_.resize(n);
    for (size_t i = 0; i < n; ++i) {
        const Quat R_rel = orientation[i].normalized() * rest_orientation_[i].conjugate();
        plain_[i] = R_rel.toRotationMatrix() * plastic_deformation[i];
    }
    qq_.assign(n, Mat3::Zero()), dq_.assign(n, Mat3::Zero()), elastic_.assign(n, Mat3::Zero());
    for (size_t e = 0; e < edges_.size(); ++e) {
        if (!edge_intact[e]) continue;
        const uint32_t a = edges_[e].a, b = edges_[e].b;
        const Vec3 rest = rest_position_[b] - rest_position_[a], y = position[b] - position[a];
        for (const uint32_t i : {a, b}) {  // both ends see the same products: signs of q and y cancel
            const Vec3 q = plain_[i] * rest, wq = edge_weight_[e] * q;
            qq_[i] += wq * q.transpose();
            dq_[i] += (y - q) * wq.transpose();
        }
    }
    for (size_t i = 0; i < n; ++i) {
        out[i].linear = plain_[i];
        if (qq_[i].trace() > 0) {
            elastic_[i] = regular(qq_[i]).ldlt().solve(dq_[i].transpose()).transpose();
            Mat3 E = elastic_[i];
            const double size = E.norm();
            if (size > kMostElastic) E *= kMostElastic / size;
            const Mat3 elastic = E * plain_[i];
            out[i].linear += elastic;
        }
        out[i].offset = position[i] - out[i].linear * rest_position_[i];
    }
}

void ParticleTransforms::rates(std::span<const Vec3> position, std::span<const Vec3> velocity,
                               std::span<const Vec3> angular_velocity, std::span<const uint8_t> edge_intact,
                               std::vector<Affine>& out) {
    const size_t n = rest_position_.size();
    out.resize(n);
    qq_rate_.assign(n, Mat3::Zero()), dq_rate_.assign(n, Mat3::Zero());
    for (size_t e = 0; e < edges_.size(); ++e) {
        if (!edge_intact[e]) continue;
        const uint32_t a = edges_[e].a, b = edges_[e].b;
        const Vec3 rest = rest_position_[b] - rest_position_[a];
        const Vec3 y = position[b] - position[a], y_rate = velocity[b] - velocity[a];
        for (const uint32_t i : {a, b}) {
            const Vec3 q = plain_[i] * rest, q_rate = angular_velocity[i].cross(q);
            const Vec3 wq = edge_weight_[e] * q, wq_rate = edge_weight_[e] * q_rate;
            qq_rate_[i] += wq_rate * q.transpose() + wq * q_rate.transpose();
            dq_rate_[i] += (y_rate - q_rate) * wq.transpose() + (y - q) * wq_rate.transpose();
        }
    }
    for (size_t i = 0; i < n; ++i) {
        Mat3 plain_rate;
        for (int c = 0; c < 3; ++c) plain_rate.col(c) = angular_velocity[i].cross(plain_[i].col(c));
        out[i].linear = plain_rate;
        if (qq_[i].trace() > 0) {
            // E Q = D, hence E' Q = D' - E Q', with Q the regular matrix and D the differences.
            Mat3 E = elastic_[i];
            const Mat3 right = dq_rate_[i] - E * regular(qq_rate_[i]);
            Mat3 E_rate = regular(qq_[i]).ldlt().solve(right.transpose()).transpose();
            const double size = E.norm();
            if (size > kMostElastic) {  // E kMostElastic / |E|
                E_rate = Mat3((E_rate - E * (E.cwiseProduct(E_rate).sum() / (size * size))) * (kMostElastic / size));
                E *= kMostElastic / size;
            }
            out[i].linear += E_rate * plain_[i] + E * plain_rate;
        }
        out[i].offset = velocity[i] - out[i].linear * rest_position_[i];
    }
}

}  // namespace sunder
