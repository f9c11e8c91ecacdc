#include "fracture_tools/particle_transforms.h"

#include <Eigen/Cholesky>

namespace sunder {
namespace {

// Share of the ring's spread that keeps the fit regular; it hides 3 * 0.03 of an elastic strain that is isotropic.
constexpr double kRegularisation = 0.03;
// Largest elastic part, Frobenius norm: I + E stays far from inverting when crushed particles have passed one another.
constexpr double kMostElastic = 0.5;

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
    out.resize(n);
    for (size_t i = 0; i < n; ++i) {
        const Quat R_rel = orientation[i].normalized() * rest_orientation_[i].conjugate();
        out[i].linear = R_rel.toRotationMatrix() * plastic_deformation[i];
    }
    qq_.assign(n, Mat3::Zero()), dq_.assign(n, Mat3::Zero());
    for (size_t e = 0; e < edges_.size(); ++e) {
        if (!edge_intact[e]) continue;
        const uint32_t a = edges_[e].a, b = edges_[e].b;
        const Vec3 rest = rest_position_[b] - rest_position_[a], y = position[b] - position[a];
        for (const uint32_t i : {a, b}) {  // both ends see the same products: signs of q and y cancel
            const Vec3 q = out[i].linear * rest, wq = edge_weight_[e] * q;
            qq_[i] += wq * q.transpose();
            dq_[i] += (y - q) * wq.transpose();
        }
    }
    for (size_t i = 0; i < n; ++i) {
        const double spread = qq_[i].trace();
        if (spread > 0) {
            const Mat3 regular = qq_[i] + Mat3((kRegularisation * spread) * Mat3::Identity());
            Mat3 E = regular.ldlt().solve(dq_[i].transpose()).transpose();
            const double size = E.norm();
            if (size > kMostElastic) E *= kMostElastic / size;
            const Mat3 elastic = E * out[i].linear;
            out[i].linear += elastic;
        }
        out[i].offset = position[i] - out[i].linear * rest_position_[i];
    }
}

}  // namespace sunder
