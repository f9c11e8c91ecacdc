// Contacts of pairs of movables.
#include <array>
#include <cmath>
#include <utility>

#include "solver/collision/detection_parts.h"

namespace sunder {
using namespace detail;
namespace {

/// Where a rigid body's own velocity takes it.
Pose pose_after(const DetectionInput& in, uint32_t i) {
    const Vec3 turn = in.duration * angular_velocity(in, i);
    const double angle = turn.norm();
    Pose pose = rigid(in, i).pose;
    pose.position += in.duration * in.velocity[i];
    if (angle > 0) pose.orientation = Quat(Eigen::AngleAxisd(angle, turn / angle)) * pose.orientation;
    return pose;
}

/// The plane across the centre line keeps the two apart throughout: most neighbours are dismissed by this alone.
bool centre_line_separates(const DetectionInput& in, uint32_t i, uint32_t j, const Vec3& shift, double reach) {
    const Vec3 d = in.particles[i].center - in.particles[j].center;
    const double distance = d.norm();
    if (!(distance > 0)) return false;
    const double h_i = std::sqrt(d.dot(support_matrix(in, i) * d)) / distance;
    const double h_j = std::sqrt(d.dot(support_matrix(in, j) * d)) / distance;
    const double gap = distance - h_i - h_j + std::min(d.dot(shift) / distance, 0.0);
    return gap - kRounding * distance > reach;
}

// Pairs of particles whose distances are still to be measured: side by side they cost less than half.
class ParticlePairs {
public:
    explicit ParticlePairs(const DetectionInput& input) : in_(input) {}
    void add(const Pair& pair, const Vec3& shift, double reach, std::vector<Contact>& out) {
        if (n_ == kMost) measure(out);
        pair_[n_] = pair, shift_[n_] = shift, reach_[n_] = reach;
        ++n_;
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
            add_single(i, j, at, shift_[k], reach_[k], out);
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
    const double h = in.duration;
    ParticlePairs waiting(in);
    for (const auto& [i, j] : pairs) {
        if (!overlap(boxes[i], boxes[j]) || (is_driven(in, i) && is_driven(in, j))) continue;
        const double reach = in.margin + turning_reach(in, i) + turning_reach(in, j);
        if (is_particle(in, j)) {
            const Vec3 shift = h * (in.velocity[i] - in.velocity[j]);
            if (centre_line_separates(in, i, j, shift, reach)) continue;
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
            add_single(i, j, at, shift, reach, out);
        } else {
            add_manifold(i, j, rigid(in, i), rigid(in, j), h * (in.velocity[i] - in.velocity[j]), reach, out);
        }
    }
    waiting.measure(out);
}

}  // namespace sunder
