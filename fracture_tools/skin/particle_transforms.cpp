#include "fracture_tools/skin/particle_transforms.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

#include "fracture_tools/skin/turns.h"
#include "solver/data/thin_fragments.h"

namespace sunder {
namespace {

// Share of the ring's spread that keeps the fit regular; it hides 3 * 0.03 of an elastic strain that is isotropic.
constexpr double kRegularisation = 0.03;
// Largest elastic part, Frobenius norm: I + E stays far from inverting when crushed particles have passed one another.
constexpr double kMostElastic = 0.5;
constexpr size_t kTransformGrain = 32;  // particles

// Linear in `sum`, so it serves rates too.
Mat3 regular(const Mat3& sum) { return sum + Mat3((kRegularisation * sum.trace()) * Mat3::Identity()); }

// Where an even turn leads, by Simpson's rule over the directions at both ends and halfway: a chord is 0.1 % too long
// at 75 degrees.
Vec3 mean_direction(const Vec3& at_start, const Vec3& halfway, const Vec3& at_end) {
    return (at_start + 4 * halfway + at_end) / 6;
}

Mat3 spun(const Vec3& angular_velocity, const Mat3& a) {
    Mat3 rate;
    for (int c = 0; c < 3; ++c) rate.col(c) = angular_velocity.cross(a.col(c));
    return rate;
}

}  // namespace

Affine ParticleMaps::whole(size_t i) const {
    if (turned.empty()) return carried[i];
    const Mat3 R = turn[i].toRotationMatrix();
    return {carried[i].linear + R * turned[i].linear, carried[i].offset + R * turned[i].offset};
}

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

    share_ = across_thickness(rest);
    if (std::ranges::all_of(share_, [](const Mat3& across) { return across.isZero(0); })) share_.clear();
    for (Mat3& C : share_)
        if (!C.isZero(0)) C = (C + Mat3::Identity()) / 2;  // N + (1 - N) / 2
}

// The map about particle i that stretches and turns as told and takes it to a place.
Affine ParticleTransforms::about_particle(size_t i, const Mat3& linear, const Vec3& position) const {
    return {linear, position - linear * rest_position_[i]};
}

// From e.a to e.b, as they were joined at rest, where the way between turns evenly from R_a to R_b.
Vec3 ParticleTransforms::arc(size_t i, const Edge& e) const {
    const Vec3 v = turn_[i].conjugate() * (plain_[i] * (rest_position_[e.b] - rest_position_[e.a]));
    const Vec3 start = turn_[e.a] * v, end = turn_[e.b] * v, halfway = between(turn_[e.a], turn_[e.b]) * v;
    return mean_direction(start, halfway, end);
}

Vec3 ParticleTransforms::arc_rate(size_t i, const Edge& e, std::span<const Vec3> angular_velocity) const {
    const Vec3 v = turn_[i].conjugate() * (plain_[i] * (rest_position_[e.b] - rest_position_[e.a]));
    const Quat from = turn_[e.a], to = nearer(turn_[e.b], from);
    const Quat sum(from.coeffs() + to.coeffs());
    const Quat sum_rate(quaternion_rate(angular_velocity[e.a], from).coeffs() +
                        quaternion_rate(angular_velocity[e.b], to).coeffs());
    const Vec3 start = angular_velocity[e.a].cross(from * v), end = angular_velocity[e.b].cross(to * v);
    const Vec3 halfway = angular_velocity_of(sum, sum_rate).cross(sum.normalized() * v);
    return mean_direction(start, halfway, end);
}

void ParticleTransforms::evaluate(std::span<const Vec3> position, std::span<const Quat> orientation,
                                  std::span<const Mat3> plastic_deformation, std::span<const uint8_t> edge_intact,
                                  ParticleMaps& out, const RangeRunner& run) {
    const size_t n = rest_position_.size();
    turn_.resize(n), plain_.resize(n), spanned_.resize(n), qq_.resize(n), elastic_.resize(n), linear_.resize(n);
    out.carried.resize(n), out.turned.resize(share_.size()), out.turn.resize(share_.size());
    run(n, kTransformGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            turn_[i] = orientation[i].normalized() * rest_orientation_[i].conjugate();
            plain_[i] = turn_[i].toRotationMatrix() * plastic_deformation[i];
            spanned_[i] = plain_[i];
            if (bends(i)) spanned_[i] = 2 * plain_[i] * (Mat3::Identity() - share_[i]);  // 1 - N
        }
    });
    run(n, kTransformGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const Mat3& plain = plain_[i];
            Mat3 qq = Mat3::Zero(), dq = Mat3::Zero();
            for (uint32_t k = ring_offset_[i]; k < ring_offset_[i + 1]; ++k) {
                const uint32_t e = ring_edge_[k];
                if (!edge_intact[e]) continue;
                const uint32_t a = edges_[e].a, b = edges_[e].b;  // from whichever end: signs of q and y cancel
                const Vec3 y = position[b] - position[a];
                const Vec3 q = spanned_[i] * (rest_position_[b] - rest_position_[a]), wq = edge_weight_[e] * q;
                const Vec3 unstretched = bends(i) ? arc(i, edges_[e]) : q;
                qq += wq * q.transpose();
                dq += (y - unstretched) * wq.transpose();
            }
            linear_[i] = plain;
            elastic_[i].setZero();
            if (qq.trace() > 0) {
                elastic_[i] = regular(qq).ldlt().solve(dq.transpose()).transpose();
                Mat3 E = elastic_[i];
                const double size = E.norm();
                if (size > kMostElastic) E *= kMostElastic / size;
                const Mat3 elastic = E * spanned_[i];
                linear_[i] += elastic;
            }
            qq_[i] = qq;
            if (share_.empty()) {
                out.carried[i] = about_particle(i, linear_[i], position[i]);
                continue;
            }
            const Mat3 turned = linear_[i] * share_[i];
            out.carried[i] = about_particle(i, linear_[i] - turned, position[i]);
            out.turned[i] = about_particle(i, turn_[i].toRotationMatrix().transpose() * turned, Vec3::Zero());
            out.turn[i] = turn_[i];
        }
    });
}

void ParticleTransforms::rates(std::span<const Vec3> position, std::span<const Vec3> velocity,
                               std::span<const Vec3> angular_velocity, std::span<const uint8_t> edge_intact,
                               ParticleMapRates& out, const RangeRunner& run) {
    const size_t n = rest_position_.size();
    out.carried.resize(n), out.turned.resize(share_.size()), out.turn.resize(share_.size());
    run(n, kTransformGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            Mat3 qq_rate = Mat3::Zero(), dq_rate = Mat3::Zero();
            for (uint32_t k = ring_offset_[i]; k < ring_offset_[i + 1]; ++k) {
                const uint32_t e = ring_edge_[k];
                if (!edge_intact[e]) continue;
                const uint32_t a = edges_[e].a, b = edges_[e].b;
                const Vec3 y = position[b] - position[a], y_rate = velocity[b] - velocity[a];
                const Vec3 q = spanned_[i] * (rest_position_[b] - rest_position_[a]);
                const Vec3 q_rate = angular_velocity[i].cross(q);
                const Vec3 wq = edge_weight_[e] * q, wq_rate = edge_weight_[e] * q_rate;
                const Vec3 unstretched = bends(i) ? arc(i, edges_[e]) : q;
                const Vec3 unstretched_rate = bends(i) ? arc_rate(i, edges_[e], angular_velocity) : q_rate;
                qq_rate += wq_rate * q.transpose() + wq * q_rate.transpose();
                dq_rate += (y_rate - unstretched_rate) * wq.transpose() + (y - unstretched) * wq_rate.transpose();
            }
            const Mat3 plain_rate = spun(angular_velocity[i], plain_[i]);
            const Mat3 spanned_rate = spun(angular_velocity[i], spanned_[i]);
            Mat3 linear = plain_rate;
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
                linear += E_rate * spanned_[i] + E * spanned_rate;
            }
            if (share_.empty()) {
                out.carried[i] = about_particle(i, linear, velocity[i]);
                continue;
            }
            const Mat3 turned = linear_[i] * share_[i], turned_rate = linear * share_[i];
            out.carried[i] = about_particle(i, linear - turned_rate, velocity[i]);
            out.turned[i] = about_particle(
                i, turn_[i].toRotationMatrix().transpose() * (turned_rate - spun(angular_velocity[i], turned)),
                Vec3::Zero());
            out.turn[i] = quaternion_rate(angular_velocity[i], turn_[i]);
        }
    });
}

}  // namespace sunder
