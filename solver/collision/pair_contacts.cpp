// Contacts of pairs of movables.
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "solver/collision/detection_parts.h"
#include "solver/scene/motion.h"

namespace sunder {
using namespace detail;
namespace {

/// Where a rigid body's own velocity takes it.
Pose pose_after(const DetectionInput& in, uint32_t i) {
    Pose pose = rigid(in, i).pose;
    pose.position += in.duration * in.velocity[i];
    pose.orientation = rotation_of(in.duration * angular_velocity(in, i)) * pose.orientation;
    return pose;
}

// As `overlap`, without a branch: whether boxes of remembered pairs meet cannot be foretold.
bool meet(const Aabb& a, const Aabb& b) {
    using Two = double __attribute__((vector_size(16)));
    const auto two = [](const double* from) {
        Two v;
        std::memcpy(&v, from, sizeof(v));
        return v;
    };
    const auto xy = (two(a.min.data()) <= two(b.max.data())) & (two(b.min.data()) <= two(a.max.data()));
    const auto z = Two{a.min.z(), b.min.z()} <= Two{b.max.z(), a.max.z()};
    const auto all = xy & z;
    return (all[0] & all[1]) != 0;
}

/// The plane across the centre line keeps the two apart throughout: most neighbours are dismissed by this alone. Not so
/// where centres coincide.
bool centre_line_separates(const DetectionInput& in, uint32_t i, uint32_t j, const Vec3& shift, double reach) {
    const Vec3 d = in.particles.center[i] - in.particles.center[j];
    const double square = d.squaredNorm();
    const auto support = [&](uint32_t k) { return std::sqrt(d.dot(product(support_matrix(in, k), d))); };
    // Both sides times the distance.
    return square - support(i) - support(j) + std::min(d.dot(shift), 0.0) - kRounding * square >
           reach * std::sqrt(square);
}

// Pairs of particles whose distances are still to be measured: side by side they cost less than half.
class ParticlePairs {
public:
    explicit ParticlePairs(const DetectionInput& input) : in_(input) {}
    // Unless the pair stays apart. No branch: that cannot be foretold either.
    void add(const Pair& pair, const Vec3& shift, double reach, std::vector<Contact>& out) {
        if (n_ == kMost) measure(out);
        pair_[n_] = pair, shift_[n_] = shift, reach_[n_] = reach;
        n_ += !centre_line_separates(in_, pair.first, pair.second, shift, reach);
    }
    void measure(std::vector<Contact>& out) {
        ellipsoid_distances(in_.particles, in_.support, std::span(pair_).first(n_), at_start_);
        for (size_t k = 0; k < n_; ++k) {
            const auto [i, j] = pair_[k];
            const Separation* known = &at_start_[k];  // only things that are apart and approach are asked for again
            const auto at = [&](const Vec3& offset) {
                if (known) return *std::exchange(known, nullptr);
                Ellipsoid a = in_.particles[i];
                a.center += offset;
                return ellipsoid_distance(a, in_.particles[j]);
            };
            add_single(MovableId(i), MovableId(j), at, shift_[k], reach_[k], out);
        }
        n_ = 0;
    }

private:
    static constexpr size_t kMost = 64;
    const DetectionInput& in_;
    size_t n_ = 0;
    std::array<Pair, kMost> pair_;
    std::array<Vec3, kMost> shift_;
    std::array<double, kMost> reach_;
    std::array<Separation, kMost> at_start_;
};

}  // namespace

void contacts_of_pairs(const DetectionInput& in, std::span<const Aabb> boxes, std::span<const Pair> pairs,
                       std::vector<Contact>& out) {
    constexpr size_t kBlock = 256;
    const double h = in.duration;
    ParticlePairs waiting(in);
    std::array<Pair, kBlock> near;
    for (size_t begin = 0; begin < pairs.size(); begin += kBlock) {
        size_t n_near = 0;
        for (const Pair& pair : pairs.subspan(begin, std::min(kBlock, pairs.size() - begin)))
            near[n_near] = pair, n_near += meet(boxes[pair.first], boxes[pair.second]);
        for (const auto& [i, j] : std::span(near).first(n_near)) {
            if (is_driven(in, i) && is_driven(in, j)) continue;
            const double reach = in.margin + turning_reach(in, i) + turning_reach(in, j);
            if (is_particle(in, j)) {
                const Vec3 shift = h * (in.velocity[i] - in.velocity[j]);
                waiting.add({i, j}, shift, reach, out);
                continue;
            }
            waiting.measure(out);  // contacts come in the order of the pairs
            if (is_particle(in, i)) {
                const PlacedShape& b = rigid(in, j);
                const auto at = [&](const Vec3& offset) {
                    Ellipsoid a = in.particles[i];
                    a.center += offset;
                    return ellipsoid_shape_distance(a, b);
                };
                const Vec3 shift = shift_seen_from(b.pose, pose_after(in, j), center(in, i), h * in.velocity[i]);
                add_single(MovableId(i), MovableId(j), at, shift, reach, out);
            } else {
                add_manifold(MovableId(i), MovableId(j), rigid(in, i), rigid(in, j),
                             h * (in.velocity[i] - in.velocity[j]), reach, out);
            }
        }
    }
    waiting.measure(out);
}

}  // namespace sunder
