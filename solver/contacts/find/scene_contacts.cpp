#include "solver/contacts/find/scene_contacts.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/surface_contacts.h"
#include "solver/data/invariant.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

// Contacts reach this share of a typical particle's radius beyond touching.
constexpr double kMarginShare = 0.02;
// A broken piece is a polyhedron, its ellipsoid is not: it must be tipped over an edge before it rolls. The arm of that
// resistance is this share of the particle's smallest radius.
constexpr double kRollingShare = 0.2;
constexpr size_t kGrain = 256;  // fewest a thread is worth waking for

struct Surface {
    double friction, restitution;
};

Surface surface_of(const Scene& scene, const FrameInput& input, MovableId movable) {
    const size_t n = scene.rest.n_particles();
    if (movable < n) {
        const Material& m = input.materials[scene.rest.material_of(movable)];
        return {m.friction, m.restitution};
    }
    const RigidBody& r = scene.rigid_bodies[movable - n];
    return {r.friction, r.restitution};
}

}  // namespace

double contact_margin(const Scene& scene) {
    const size_t n = scene.rest.n_particles(), n_rigid = scene.rigid_bodies.size();
    double size = 0;
    for (const Vec3& radii : scene.rest.radii) size += radii.minCoeff();
    if (n == 0)
        for (const RigidBody& body : scene.rigid_bodies) size += bounding_radius(body.shape);
    return kMarginShare * size / std::max<double>(1, n > 0 ? n : double(n_rigid));
}

// Pairs of one body, ascending as contacts are; what was in contact in the substep before is known.
void SceneContacts::list_neighbours(const SimulationMesh& rest, const WorkerPool& workers) {
    constexpr size_t kPairs = 32;  // fewest a thread is worth waking for
    const size_t n = rest.n_particles();
    const auto name = [&](MovableId i) { return uint64_t{rest.body[i]} << 32 | rest.fragment[i]; };
    std::swap(neighbours_, former_);
    neighbours_.clear(), unknown_.clear(), pair_of_unknown_.clear();
    neighbours_of_.assign(contacts_.size(), kNone);
    auto former = former_.begin();
    for (size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& c = contacts_[k];
        if (c.a >= n || c.b >= n || rest.body[c.a] != rest.body[c.b]) continue;
        const std::pair pair(name(c.a), name(c.b));
        while (former != former_.end() && std::pair(former->a, former->b) < pair) ++former;
        const bool is_known = former != former_.end() && std::pair(former->a, former->b) == pair;
        neighbours_of_[k] = static_cast<uint32_t>(neighbours_.size());
        if (!is_known) unknown_.push_back(neighbours_of_[k]), pair_of_unknown_.push_back({c.a, c.b});
        neighbours_.push_back({pair.first, pair.second, is_known ? former->gap : 0});
    }
    gap_of_unknown_.resize(unknown_.size());
    workers.for_range(unknown_.size(), kPairs, [&](size_t begin, size_t end) {
        rest_gaps(rest, std::span(pair_of_unknown_).subspan(begin, end - begin), gap_of_unknown_.data() + begin);
    });
    for (size_t m = 0; m < unknown_.size(); ++m) neighbours_[unknown_[m]].gap = gap_of_unknown_[m];
}

// Of a collider at the touching point, over the substep, m.
Vec3 SceneContacts::collider_motion(const Contact& c) const {
    const MovingShape& collider = colliders_[c.b & ~Contact::kStatic];
    if (collider.shape.surface) return surface_motion(collider, c.point_b);
    return collider.end.apply(collider.begin.inverse_apply(c.point_b)) - c.point_b;
}

// Seen from b, a's centre moves, and its surface comes closer than that by no more than what a turns its longest radius
// to where its shortest was.
void SceneContacts::measure_reach(const SimulationMesh& rest, const MovableMotion& motion, double h,
                                  const WorkerPool& workers) {
    const size_t n = rest.n_particles();
    const auto uneven = [&](MovableId i) {
        if (i < n) return rest.radii[i].maxCoeff() - rest.radii[i].minCoeff();
        const Shape& shape = rigid_bodies_[i - n].shape;
        return shape.kind == ShapeKind::box ? bounding_radius(shape) - shape.half_extents.minCoeff() : 0.0;
    };
    const auto speed_of = [&](MovableId a, MovableId b) {
        const Vec3 way = motion.velocity[a] - motion.velocity[b] -
                         motion.angular_velocity[b].cross(motion.position[a] - motion.position[b]);
        return way.norm() + uneven(a) * (motion.angular_velocity[a] - motion.angular_velocity[b]).norm();
    };
    const auto reach_of = [&](size_t k) {
        const Contact& c = contacts_[k];
        if (c.b & Contact::kStatic) {
            const bool is_plane = colliders_[c.b & ~Contact::kStatic].shape.kind == ShapeKind::plane;
            const double speed = (motion.velocity[c.a] - collider_motion(c) / h).norm();
            return ContactReach{speed + uneven(c.a) * motion.angular_velocity[c.a].norm(),
                                is_plane && c.a < n ? hulls_.reach()[c.a] : 0.0};
        }
        const uint32_t at = neighbours_of_[k];
        return ContactReach{uneven(c.a) < uneven(c.b) ? speed_of(c.a, c.b) : speed_of(c.b, c.a),
                            at == kNone ? 0.0 : std::min(0.0, neighbours_[at].gap)};
    };
    reach_.resize(contacts_.size());
    workers.for_range(contacts_.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) reach_[k] = reach_of(k);
    });
}

bool SceneContacts::find(const StepContext& context, const LiveTopology& live, std::span<const Role> role,
                         const MovableMotion& motion, const Interval& interval, const SearchEnd& search_end,
                         std::vector<ActiveContact>& out) {
    const Scene& scene = context.scene;
    const FrameInput& input = context.input;
    const WorkerPool& workers = context.workers;
    const double margin = context.contact_margin;
    const SimulationMesh& rest = scene.rest;
    const uint32_t n = static_cast<uint32_t>(rest.n_particles());
    const size_t n_movables = n + scene.rigid_bodies.size();
    SUNDER_ASSERT(motion.position.size() == n_movables && motion.rotation.size() == n_movables);
    SUNDER_ASSERT(motion.velocity.size() == n_movables && motion.angular_velocity.size() == n_movables);
    SUNDER_ASSERT(motion.plastic_deformation.size() == n && live.ends().size() == n && role.size() == n_movables);
    SUNDER_ASSERT(input.colliders.size() == scene.colliders.size() && interval.h > 0 && margin > 0);
    hulls_.update(rest, motion.plastic_deformation, workers);
    rigid_bodies_.clear();
    for (size_t r = 0; r < scene.rigid_bodies.size(); ++r)
        rigid_bodies_.push_back({scene.rigid_bodies[r].shape, {motion.position[n + r], motion.rotation[n + r]}});
    colliders_.clear();
    for (size_t c = 0; c < scene.colliders.size(); ++c) {
        const DrivenPose& drive = input.colliders[c];
        const Shape& shape = scene.colliders[c].shape;
        colliders_.push_back({shape_at(shape, drive, interval.begin), interpolate(drive, interval.begin),
                              interpolate(drive, interval.end), drive.active,
                              shape_at(shape, drive, interval.end).share});
    }

    DetectionInput detection;
    detection.particles = {motion.position.first(n), motion.rotation.first(n), rest.rest_orientation, rest.radii};
    detection.corners = hulls_.reach();
    detection.body = rest.body;
    detection.role = role;
    detection.rings = {live.begins().first(n), live.ends(), live.members(), {}, {}};
    detection.self_collision = context.settings.self_collision;
    detection.rigid_bodies = rigid_bodies_;
    detection.velocity = motion.velocity;
    detection.angular_velocity = motion.angular_velocity;
    detection.colliders = colliders_;
    detection.duration = interval.h;
    detection.margin = margin;
    detection.piece = live.pieces();
    detection.workers = &workers;
    bool ended = false;
    detection.fixed = search_end.fixed;
    if (search_end.ends)
        detection.ends = [&](std::span<const Contact> first) { return ended = search_end.ends(first); };
    find_contacts(detection, scratch_, contacts_);
    if (ended) {
        out.clear();
        return false;
    }

    const auto standing_out_of = [&](MovableId i, const Vec3& direction) {
        if (i >= n) return 0.0;
        return standing_out(rest, i.value, motion.plastic_deformation[i], motion.rotation[i].conjugate() * direction);
    };
    const auto rolling_arm = [&](MovableId movable) {
        return movable < n ? kRollingShare * rest.radii[movable].minCoeff() : 0.0;
    };
    const auto describe = [&](size_t k) {
        ActiveContact c;
        const Contact& contact = c.contact = contacts_[k];
        const Surface a = surface_of(scene, input, contact.a);
        Surface b;
        c.rolling_arm = rolling_arm(contact.a);
        if (contact.b & Contact::kStatic) {
            const uint32_t at = contact.b & ~Contact::kStatic;
            b = {scene.colliders[at].friction, scene.colliders[at].restitution};
            c.allowed_gap = -standing_out_of(contact.a, -contact.normal);
            // The corner that reaches farther need not be where it touches, unless that is everywhere.
            if (scene.colliders[at].shape.kind != ShapeKind::plane) c.allowed_gap = std::min(c.allowed_gap, 0.0);
            c.collider_motion = collider_motion(contact);
        } else {
            b = surface_of(scene, input, contact.b);
            c.rolling_arm = std::max(c.rolling_arm, rolling_arm(contact.b));
            c.allowed_gap = std::min(
                0.0, -standing_out_of(contact.a, -contact.normal) - standing_out_of(contact.b, contact.normal));
            if (contact.a < n && contact.b < n)
                c.separate_pieces = live.piece(contact.a.value) != live.piece(contact.b.value);
            if (neighbours_of_[k] != kNone) c.allowed_gap = std::min(c.allowed_gap, neighbours_[neighbours_of_[k]].gap);
        }
        c.friction = std::sqrt(a.friction * b.friction);
        c.restitution = std::max(a.restitution, b.restitution);
        return c;
    };
    list_neighbours(rest, workers);
    measure_reach(rest, motion, interval.h, workers);
    const std::vector<ContactId> those = in_reach(contacts_, reach_, motion.position.size(), interval.h, margin);
    out.resize(those.size());  // those that are there are written over
    workers.for_range(those.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) out[k] = describe(those[k]);
    });
    return true;
}

}  // namespace sunder
