#include "fracture_tools/skin/particle_transforms.h"

#include <Eigen/Cholesky>
#include <numeric>

namespace sunder {
namespace {

// Share of the ring's spread that keeps the fit regular; it hides 3 * 0.03 of an elastic strain that is isotropic.
constexpr double kRegularisation = 0.03;
// Largest elastic part, Frobenius norm: I + E stays far from inverting when crushed particles have passed one another.
constexpr double kMostElastic = 0.5;
constexpr size_t kTransformGrain = 32;  // particles

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
    ring_offset_.assign(rest.n_particles() + 1, 0), ring_edge_.resize(2 * edges_.size());
    for (const Edge& e : edges_) ++ring_offset_[e.a + 1], ++ring_offset_[e.b + 1];
    std::partial_sum(ring_offset_.begin(), ring_offset_.end(), ring_offset_.begin());
    std::vector<uint32_t> next(ring_offset_.begin(), ring_offset_.end() - 1);
    for (uint32_t e = 0; e < edges_.size(); ++e) ring_edge_[next[edges_[e].a]++] = ring_edge_[next[edges_[e].b]++] = e;
}

void ParticleTransforms::evaluate(std::span<const Vec3> position, std::span<const Quat> orientation,
                                  std::span<const Mat3> plastic_deformation, std::span<const uint8_t> edge_intact,
                                  std::vector<Affine>& out, const RangeRunner& run) {
    const size_t n = rest_position_.size();
    out.resize(n), plain_.resize(n), qq_.resize(n), elastic_.resize(n);
    run(n, kTransformGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const Quat R_rel = orientation[i].normalized() * rest_orientation_[i].conjugate();
            const Mat3 plain = R_rel.toRotationMatrix() * plastic_deformation[i];
            Mat3 qq = Mat3::Zero(), dq = Mat3::Zero();
            for (uint32_t k = ring_offset_[i]; k < ring_offset_[i + 1]; ++k) {
                const uint32_t e = ring_edge_[k];
                if (!edge_intact[e]) continue;
                const uint32_t a = edges_[e].a, b = edges_[e].b;  // from whichever end: signs of q and y cancel
                const Vec3 y = position[b] - position[a];
                const Vec3 q = plain * (rest_position_[b] - rest_position_[a]), wq = edge_weight_[e] * q;
                qq += wq * q.transpose();
                dq += (y - q) * wq.transpose();
            }
            out[i].linear = plain;
            elastic_[i].setZero();
            if (qq.trace() > 0) {
                elastic_[i] = regular(qq).ldlt().solve(dq.transpose()).transpose();
                Mat3 E = elastic_[i];
                const double size = E.norm();
                if (size > kMostElastic) E *= kMostElastic / size;
                const Mat3 elastic = E * plain;
                out[i].linear += elastic;
            }
            out[i].offset = position[i] - out[i].linear * rest_position_[i];
            plain_[i] = plain, qq_[i] = qq;
        }
    });
}

void ParticleTransforms::rates(std::span<const Vec3> position, std::span<const Vec3> velocity,
                               std::span<const Vec3> angular_velocity, std::span<const uint8_t> edge_intact,
                               std::vector<Affine>& out, const RangeRunner& run) {
    const size_t n = rest_position_.size();
    out.resize(n);
    run(n, kTransformGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const Mat3& plain = plain_[i];
            Mat3 qq_rate = Mat3::Zero(), dq_rate = Mat3::Zero();
            for (uint32_t k = ring_offset_[i]; k < ring_offset_[i + 1]; ++k) {
                const uint32_t e = ring_edge_[k];
                if (!edge_intact[e]) continue;
                const uint32_t a = edges_[e].a, b = edges_[e].b;
                const Vec3 y = position[b] - position[a], y_rate = velocity[b] - velocity[a];
                const Vec3 q = plain * (rest_position_[b] - rest_position_[a]);
                const Vec3 q_rate = angular_velocity[i].cross(q);
                const Vec3 wq = edge_weight_[e] * q, wq_rate = edge_weight_[e] * q_rate;
                qq_rate += wq_rate * q.transpose() + wq * q_rate.transpose();
                dq_rate += (y_rate - q_rate) * wq.transpose() + (y - q) * wq_rate.transpose();
            }
            Mat3 plain_rate;
            for (int c = 0; c < 3; ++c) plain_rate.col(c) = angular_velocity[i].cross(plain.col(c));
            out[i].linear = plain_rate;
            if (qq_[i].trace() > 0) {
                // E Q = D, hence E' Q = D' - E Q', with Q the regular matrix and D the differences.
                Mat3 E = elastic_[i];
                const Mat3 right = dq_rate - E * regular(qq_rate);
                Mat3 E_rate = regular(qq_[i]).ldlt().solve(right.transpose()).transpose();
                const double size = E.norm();
                if (size > kMostElastic) {  // E kMostElastic / |E|
                    E_rate =
                        Mat3((E_rate - E * (E.cwiseProduct(E_rate).sum() / (size * size))) * (kMostElastic / size));
                    E *= kMostElastic / size;
                }
                out[i].linear += E_rate * plain + E * plain_rate;
            }
            out[i].offset = velocity[i] - out[i].linear * rest_position_[i];
        }
    });
}

}  // namespace sunder
