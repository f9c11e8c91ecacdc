#include "solver/collision/detection.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "solver/collision/first_touch.h"
#include "solver/collision/grid_contacts.h"

namespace sunder {
namespace {

constexpr double kRounding = 1e-9;  // boxes are grown by this share, so that no contact is lost to rounding

size_t n_movables(const DetectionInput& in) { return in.particles.size() + in.rigid_bodies.size(); }
bool is_particle(const DetectionInput& in, uint32_t i) { return i < in.particles.size(); }
bool is_driven(const DetectionInput& in, uint32_t i) { return i < in.pinned.size() && in.pinned[i]; }
const PlacedShape& rigid(const DetectionInput& in, uint32_t i) { return in.rigid_bodies[i - in.particles.size()]; }

Vec3 angular_velocity(const DetectionInput& in, uint32_t i) {
    return in.angular_velocity.empty() ? Vec3(Vec3::Zero()) : in.angular_velocity[i];
}

const Vec3& center(const DetectionInput& in, uint32_t i) {
    return is_particle(in, i) ? in.particles[i].center : rigid(in, i).pose.position;
}

/// How far turning through the step may carry the surface towards something, m: no more than the farthest point of the
/// surface is beyond the nearest.
double turning_reach(const DetectionInput& in, uint32_t i) {
    const double angle = angular_velocity(in, i).norm() * in.duration;
    if (angle == 0) return 0;
    double nearest, farthest;
    if (is_particle(in, i)) {
        nearest = in.particles[i].radii.minCoeff();
        farthest = in.particles[i].radii.maxCoeff();
    } else {
        const Shape& shape = rigid(in, i).shape;
        farthest = bounding_radius(shape);
        nearest = shape.kind == ShapeKind::box ? shape.half_extents.minCoeff() : farthest;
    }
    return std::min(angle * farthest, farthest - nearest);
}

/// Displacement of a point at `x` over the step, as seen from a solid that goes from one pose to the other: as if the
/// solid had stayed at `begin`. Its turning bends the path; both ends are exact.
Vec3 shift_seen_from(const Pose& begin, const Pose& end, const Vec3& x, const Vec3& shift) {
    return begin.apply(end.inverse_apply(x + shift)) - x;
}

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
bool centre_line_separates(const Ellipsoid& a, const Ellipsoid& b, const Vec3& shift, double reach) {
    const Vec3 d = a.center - b.center;
    const double distance = d.norm();
    if (!(distance > 0)) return false;
    const double h_a = (a.radii.asDiagonal() * (a.axes.transpose() * d)).norm() / distance;
    const double h_b = (b.radii.asDiagonal() * (b.axes.transpose() * d)).norm() / distance;
    return distance - h_a - h_b + std::min(d.dot(shift) / distance, 0.0) > reach;
}

void add(uint32_t a, uint32_t b, const Separation& s, std::vector<Contact>& out) {
    Contact c;
    c.a = a;
    c.b = b;
    c.normal = s.normal;
    c.point_a = s.point_a;
    c.point_b = s.point_b;
    c.gap = s.gap;
    out.push_back(c);
}

/// One contact at most, for pairs with a particle in them. `at(offset)`: separation with a moved by `offset`.
template <class SeparationAt>
void add_single(uint32_t a, uint32_t b, const SeparationAt& at, const Vec3& shift, double reach,
                std::vector<Contact>& out) {
    Separation s;
    double share;
    if (first_touch(at, shift, reach, s, share)) add(a, b, s, out);
}

/// Rigid bodies: all points of the manifold at the first touch that the step can close.
void add_manifold(uint32_t a, uint32_t b, PlacedShape shape_a, const PlacedShape& shape_b, const Vec3& shift,
                  double reach, std::vector<Contact>& out) {
    const Vec3 start = shape_a.pose.position;
    const auto manifold_at = [&](const Vec3& offset) {
        shape_a.pose.position = start + offset;
        return rigid_contacts(shape_a, shape_b);
    };
    const auto deepest_at = [&](const Vec3& offset) {
        const Manifold m = manifold_at(offset);
        assert(m.count > 0);
        int least = 0;
        for (int k = 1; k < m.count; ++k)
            if (m.points[k].gap < m.points[least].gap) least = k;
        return m.points[least];
    };
    Separation touch;
    double share;
    if (!first_touch(deepest_at, shift, reach, touch, share)) return;
    const Manifold m = manifold_at(share * shift);
    for (int k = 0; k < m.count; ++k) {
        const Separation s = moved_back(m.points[k], share * shift);
        if (s.gap < std::max(-s.normal.dot(shift), 0.0) + reach) add(a, b, s, out);
    }
}

}  // namespace

namespace {

// As seen by who moves at `frame`, m/s.
void sweep_boxes_from(const Vec3& frame, const DetectionInput& in, size_t begin, size_t end, std::span<Aabb> io_boxes) {
    for (size_t k = begin; k < end; ++k) {
        const auto i = static_cast<uint32_t>(k);
        Aabb box;
        double turning = turning_reach(in, i);
        if (is_particle(in, i)) {
            const Ellipsoid& e = in.particles[i];
            const Vec3 half = (e.axes * e.radii.asDiagonal()).rowwise().norm();  // sqrt of the diagonal of M
            box = {e.center - half, e.center + half};
        } else {
            box = bounding_box(rigid(in, i));
            // What is near it is swept by its turning.
            turning += angular_velocity(in, i).norm() * in.duration * bounding_radius(rigid(in, i).shape);
        }
        const Vec3 shift = in.duration * (in.velocity[i] - frame);
        const Vec3 grow = Vec3::Constant(0.5 * in.margin + turning) +
                          kRounding * (box.max - box.min + box.max.cwiseAbs() + shift.cwiseAbs());
        box.min += shift.cwiseMin(0.0) - grow;
        box.max += shift.cwiseMax(0.0) + grow;
        io_boxes[i] = box;
    }
}

}  // namespace

void sweep_boxes(const DetectionInput& in, size_t begin, size_t end, std::span<Aabb> io_boxes) {
    sweep_boxes_from(Vec3::Zero(), in, begin, end, io_boxes);
}

namespace {

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
        ellipsoid_distances(in_.particles, std::span(pair_).first(n_), at_start_);
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
            if (centre_line_separates(in.particles[i], in.particles[j], shift, reach)) continue;
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

void contacts_with_colliders(const DetectionInput& in, std::span<const Aabb> boxes, size_t begin, size_t end,
                             std::vector<Contact>& out) {
    const double h = in.duration;
    std::vector<Separation> on_mesh;
    for (size_t k = begin; k < end; ++k) {
        const auto i = static_cast<uint32_t>(k);
        if (is_driven(in, i)) continue;
        for (uint32_t c = 0; c < in.colliders.size(); ++c) {
            const MovingShape& collider = in.colliders[c];
            if (!collider.active) continue;
            const PlacedShape placed{collider.shape, collider.begin};
            const Vec3 own_shift = h * in.velocity[i];
            const Vec3 shift = shift_seen_from(collider.begin, collider.end, center(in, i), own_shift);
            // Here the collider stands still and its motion is a's: so its box needs no sweep, but a's box does.
            Aabb box = boxes[i];
            const Vec3 slack = Vec3::Constant(0.5 * in.margin), further = shift - own_shift;
            box.min += further.cwiseMin(0.0) - slack;
            box.max += further.cwiseMax(0.0) + slack;
            const double angle = collider.begin.orientation.angularDistance(collider.end.orientation);
            const double own =
                is_particle(in, i) ? in.particles[i].radii.maxCoeff() : bounding_radius(rigid(in, i).shape);
            const bool by_corners =
                collider.shape.kind == ShapeKind::plane && is_particle(in, i) && !in.corners.empty();
            const double corners = by_corners ? in.corners[i] : 0.0;
            const double turning = std::min(angle, 1.0) * own;  // across the size of a, the collider's field differs
            box.min.array() -= turning + corners;
            box.max.array() += turning + corners;
            if (!overlap(box, bounding_box(placed))) continue;
            const double reach = in.margin + turning_reach(in, i) + turning + corners;
            if (placed.shape.kind == ShapeKind::mesh) {
                if (is_particle(in, i))
                    grid_contacts(in.particles[i], placed, shift, reach, on_mesh);
                else
                    grid_contacts(rigid(in, i), placed, shift, reach, on_mesh);
                for (const Separation& s : on_mesh) add(i, Contact::kStatic | c, s, out);
            } else if (is_particle(in, i)) {
                const auto at = [&](const Vec3& offset) {
                    Ellipsoid a = in.particles[i];
                    a.center += offset;
                    return ellipsoid_shape_distance(a, placed);
                };
                add_single(i, Contact::kStatic | c, at, shift, reach, out);
            } else {
                add_manifold(i, Contact::kStatic | c, rigid(in, i), placed, shift, reach, out);
            }
        }
    }
}

namespace {

// Pairs that may touch, in no order.
std::span<const Pair> candidates(const DetectionInput& in, const WorkerPool& workers, ContactScratch& s) {
    PairFilter filter;
    filter.n_particles = static_cast<uint32_t>(in.particles.size());
    filter.body = in.body;
    filter.self_collision = in.self_collision;
    filter.rings = in.rings;
    if (in.piece.size() != in.particles.size()) {
        find_overlaps(s.boxes, filter, s.overlaps, s.pairs);
        for (auto& [i, j] : s.pairs)
            if (i > j) std::swap(i, j);
        return s.pairs;
    }

    s.radius.resize(in.particles.size());
    s.position.resize(in.particles.size());
    for (uint32_t i = 0; i < in.particles.size(); ++i) {
        s.position[i] = in.particles[i].center;
        s.radius[i] = in.particles[i].radii.maxCoeff() + 0.5 * in.margin + turning_reach(in, i);
    }
    const auto within = s.within.update({s.position, in.velocity.first(in.particles.size()), s.radius, in.duration},
                                        in.piece, filter, workers);
    const auto between = s.between.update(s.boxes, in.piece, filter);
    s.pairs.assign(within.begin(), within.end());
    s.pairs.insert(s.pairs.end(), between.begin(), between.end());
    return s.pairs;
}

// Calls find(begin, end, out) on chunks of [0, n), from several threads; appends what they found in their order.
template <class Find>
void in_chunks(size_t n, const WorkerPool& workers, const Find& find, std::vector<std::vector<Contact>>& chunks,
               std::vector<Contact>& out) {
    constexpr size_t kChunk = 256;
    const size_t n_chunks = (n + kChunk - 1) / kChunk;
    if (chunks.size() < n_chunks) chunks.resize(n_chunks);
    workers.for_range(n_chunks, 1, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k) {
            chunks[k].clear();
            find(k * kChunk, std::min(n, (k + 1) * kChunk), chunks[k]);
        }
    });
    for (size_t k = 0; k < n_chunks; ++k) out.insert(out.end(), chunks[k].begin(), chunks[k].end());
}

}  // namespace

void find_contacts(const DetectionInput& in, ContactScratch& scratch, std::vector<Contact>& out) {
    const size_t n = n_movables(in);
    assert(in.velocity.size() == n && (in.angular_velocity.empty() || in.angular_velocity.size() == n));
    const WorkerPool alone(1);
    const WorkerPool& workers = in.workers ? *in.workers : alone;
    scratch.boxes.resize(n);
    const auto sweep = [&](const Vec3& frame) {
        workers.for_range(n, 512,
                          [&](size_t begin, size_t end) { sweep_boxes_from(frame, in, begin, end, scratch.boxes); });
    };
    // Two things meet or miss whoever looks: in the frame of their mean velocity, what falls together hardly moves.
    Vec3 mean = Vec3::Zero();
    for (const Vec3& v : in.velocity) mean += v / static_cast<double>(n);
    sweep(mean);
    const std::span<const Pair> pairs = candidates(in, workers, scratch);
    scratch.found.clear();
    in_chunks(
        pairs.size(), workers,
        [&](size_t begin, size_t end, std::vector<Contact>& found) {
            contacts_of_pairs(in, scratch.boxes, pairs.subspan(begin, end - begin), found);
        },
        scratch.chunks, scratch.found);
    sweep(Vec3::Zero());
    in_chunks(
        n, workers,
        [&](size_t begin, size_t end, std::vector<Contact>& found) {
            contacts_with_colliders(in, scratch.boxes, begin, end, found);
        },
        scratch.chunks, scratch.found);
    scratch.order.clear();
    for (uint32_t k = 0; k < scratch.found.size(); ++k)
        scratch.order.push_back({uint64_t{scratch.found[k].a} << 32 | scratch.found[k].b, k});
    std::ranges::sort(scratch.order);
    out.clear();
    for (const auto& [pair, k] : scratch.order) out.push_back(scratch.found[k]);
}

}  // namespace sunder
