#include "solver/sleeping.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/collision/contact.h"
#include "solver/collision/shape_distance.h"

namespace sunder {
namespace {

// Of sqrt(g size); what flows is meant to go on slowly.
constexpr double kStill = 0.005, kStillWhileFlowing = 0.001, kWaking = 0.02;

class DisjointSets {
public:
    explicit DisjointSets(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
    uint32_t root(uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(uint32_t i, uint32_t j) {
        const uint32_t p = root(i), q = root(j);
        parent_[std::max(p, q)] = std::min(p, q);
    }

private:
    std::vector<uint32_t> parent_;
};

DisjointSets pieces_of(const Scene& scene, const FrameState& state) {
    DisjointSets sets(state.asleep.size());
    const std::vector<Edge>& edges = scene.rest.edges;
    for (size_t e = 0; e < edges.size(); ++e)
        if (state.edge_intact[e]) sets.join(edges[e].a, edges[e].b);
    return sets;
}

// Awake things do not lean on sleepers (they would have woken them), nor sleepers on what is awake.
void join_by_contacts(const FrameState& state, DisjointSets& io_sets) {
    for (const ContactMemory& c : state.contacts)
        if (!(c.b & Contact::kStatic) && state.asleep[c.a] == state.asleep[c.b]) io_sets.join(c.a, c.b);
}

bool moves(const DrivenPose& d) {
    return d.begin.position != d.end.position || d.begin.orientation.coeffs() != d.end.orientation.coeffs();
}

uint64_t hash_of_drive(const DrivenPose& d, const Pose& at) {
    const double numbers[] = {double(d.active),   at.position.x(),    at.position.y(),    at.position.z(),
                              at.orientation.w(), at.orientation.x(), at.orientation.y(), at.orientation.z(),
                              d.pivot.x(),        d.pivot.y(),        d.pivot.z()};
    return hash_of(numbers);
}

uint64_t hash_of_sleepers(const FrameState& s) {
    uint64_t hash = 0;
    const auto add = [&](const Vec3& x, const Quat& q, const Vec3& v, const Vec3& w) {
        const double numbers[] = {x.x(),
                                  x.y(),
                                  x.z(),
                                  q.w(),
                                  q.x(),
                                  q.y(),
                                  q.z(),
                                  v.x(),
                                  v.y(),
                                  v.z(),
                                  w.x(),
                                  w.y(),
                                  w.z(),
                                  double(hash >> 32),
                                  double(hash & 0xffffffffu)};
        hash = hash_of(numbers);
    };
    const size_t n = s.n_particles();
    for (size_t i = 0; i < n; ++i)
        if (s.asleep[i]) add(s.position[i], s.orientation[i], s.velocity[i], s.angular_velocity[i]);
    for (size_t r = 0; r < s.rigid_bodies.size(); ++r) {
        const RigidBodyState& b = s.rigid_bodies[r];
        if (s.asleep[n + r]) add(b.position, b.orientation, b.velocity, b.angular_velocity);
    }
    return hash;
}

enum class FrameEnd { begin, end };

// The sleepers themselves; gravity, forces and self-collision; materials; pins; colliders.
std::vector<uint64_t> conditions(const FrameInput& input, bool self_collision, FrameEnd at, const FrameState& state) {
    std::vector<uint64_t> hashes = {hash_of_sleepers(state)};
    std::vector<double> field = {double(self_collision), input.gravity.x(), input.gravity.y(), input.gravity.z()};
    for (const Force& f : input.forces)
        for (int i = 0; i < 3; ++i) field.insert(field.end(), {f.acceleration[i], f.wind[i], f.drag});
    hashes.push_back(hash_of(field));
    for (const Material& m : input.materials) {
        const double numbers[] = {m.youngs_modulus, m.poisson_ratio, m.damping_time, m.yield,
                                  m.flow_rate,      m.hardening,     m.toughness,    m.compressive_toughness,
                                  m.stiffness,      m.friction,      m.restitution};
        hashes.push_back(hash_of(numbers));
    }
    for (const std::vector<DrivenPose>* driven : {&input.pins, &input.colliders})
        for (const DrivenPose& d : *driven) hashes.push_back(hash_of_drive(d, at == FrameEnd::begin ? d.begin : d.end));
    return hashes;
}

Vec3 position_of(const FrameState& s, size_t i) {
    return i < s.n_particles() ? s.position[i] : s.rigid_bodies[i - s.n_particles()].position;
}
const Quat& orientation_of(const FrameState& s, size_t i) {
    return i < s.n_particles() ? s.orientation[i] : s.rigid_bodies[i - s.n_particles()].orientation;
}

double bounding_radius(const Scene& scene, size_t i) {
    const size_t n = scene.rest.n_particles();
    return i < n ? scene.rest.radii[i].maxCoeff() : bounding_radius(scene.rigid_bodies[i - n].shape);
}

// How far a sleeper's ellipsoid or hull reaches, m.
double reach_of(const Scene& scene, const FrameState& s, size_t i) {
    double reach = bounding_radius(scene, i);
    if (i >= s.n_particles()) return reach;
    for (const Vec3f& p : scene.rest.hull(i))
        reach = std::max(reach, (s.plastic_deformation[i] * p.cast<double>()).norm());
    return reach;
}

// Whether a collider comes within `reach` of a point in this frame.
bool comes_near(const Shape& shape, const DrivenPose& drive, const Vec3& point, double reach) {
    const double way = (drive.begin.apply(drive.end.inverse_apply(point)) - point).norm();
    return point_shape_distance(point, {shape, drive.begin}).gap <= reach + way ||
           point_shape_distance(point, {shape, drive.end}).gap <= reach;
}

void stop(FrameState& io_state, size_t i) {
    const size_t n = io_state.n_particles();
    Vec3& v = i < n ? io_state.velocity[i] : io_state.rigid_bodies[i - n].velocity;
    Vec3& w = i < n ? io_state.angular_velocity[i] : io_state.rigid_bodies[i - n].angular_velocity;
    v = w = Vec3::Zero();
}

}  // namespace

double still_speed(double size, double acceleration, bool flows) {
    return (flows ? kStillWhileFlowing : kStill) * std::sqrt(acceleration * size);
}
double waking_speed(double size, double acceleration) { return kWaking * std::sqrt(acceleration * size); }

double size_of(const Scene& scene, uint32_t movable) {
    const size_t n = scene.rest.n_particles();
    if (movable < n) return std::cbrt(scene.rest.volume[movable]);
    const Shape& shape = scene.rigid_bodies[movable - n].shape;
    return 2 * (shape.kind == ShapeKind::box ? std::cbrt(shape.half_extents.prod()) : 0.8 * shape.radius);
}

double acceleration_of(const FrameInput& input) {
    Vec3 sum = input.gravity;
    for (const Force& f : input.forces) sum += f.acceleration + f.drag * f.wind;
    return sum.norm();
}

bool anything_sleeps(const FrameState& state) { return std::ranges::find(state.asleep, 1) != state.asleep.end(); }

void forget_sleep(size_t n_movables, FrameState& io_state) {
    io_state.asleep.assign(n_movables, 0);
    io_state.still_time.assign(n_movables, 0.0);
    io_state.rest_conditions.clear();
}

void wake_changed(const Scene& scene, const FrameInput& input, bool self_collision, double margin,
                  FrameState& io_state) {
    FrameState& s = io_state;
    if (s.rest_conditions.empty()) return;
    const std::vector<uint64_t> now = conditions(input, self_collision, FrameEnd::begin, s);
    const std::vector<uint64_t>& then = s.rest_conditions;
    if (now.size() != then.size() || now[0] != then[0] || now[1] != then[1]) {
        return forget_sleep(s.asleep.size(), s);
    }
    std::vector<uint32_t> seeds;
    const size_t n = s.n_particles(), first_pin = 2 + input.materials.size(),
                 first_collider = first_pin + input.pins.size();
    const auto changed = [&](size_t k) { return now[k] != then[k]; };
    for (uint32_t i = 0; i < n; ++i)
        if (s.asleep[i] && changed(2 + scene.rest.body[i])) seeds.push_back(i);
    for (size_t k = 0; k < input.pins.size(); ++k)
        if (changed(first_pin + k) || (input.pins[k].active && moves(input.pins[k])))
            for (const uint32_t i : scene.pins[k].particles)
                if (s.asleep[i]) seeds.push_back(i);
    for (uint32_t c = 0; c < input.colliders.size(); ++c) {
        const DrivenPose& drive = input.colliders[c];
        if (!changed(first_collider + c) && !(drive.active && moves(drive))) continue;
        for (const ContactMemory& contact : s.contacts)
            if (contact.b == (Contact::kStatic | c) && s.asleep[contact.a]) seeds.push_back(contact.a);
        if (!drive.active) continue;
        for (uint32_t i = 0; i < s.asleep.size(); ++i)
            if (s.asleep[i] &&
                comes_near(scene.colliders[c].shape, drive, position_of(s, i), reach_of(scene, s, i) + margin))
                seeds.push_back(i);
    }
    wake(scene, seeds, s);
}

void wake(const Scene& scene, std::span<const uint32_t> movables, FrameState& io_state) {
    if (movables.empty()) return;
    DisjointSets islands = pieces_of(scene, io_state);
    join_by_contacts(io_state, islands);
    std::vector<uint8_t> wakes(io_state.asleep.size(), 0);  // by root
    for (const uint32_t i : movables) wakes[islands.root(i)] = 1;
    for (uint32_t i = 0; i < io_state.asleep.size(); ++i)
        if (io_state.asleep[i] && wakes[islands.root(i)]) io_state.asleep[i] = 0, io_state.still_time[i] = 0;
}

size_t fall_asleep(const Scene& scene, const FrameInput& input, bool self_collision, const FrameState& before,
                   FrameState& io_state) {
    FrameState& s = io_state;
    const size_t n_movables = s.asleep.size();
    const double acceleration = acceleration_of(input);
    for (uint32_t i = 0; i < n_movables; ++i) {
        if (s.asleep[i]) continue;
        const double way = (position_of(s, i) - position_of(before, i)).norm();
        // Twice the sine of half the angle: the angle, where that is small.
        const double turn = 2 * (orientation_of(s, i) * orientation_of(before, i).conjugate()).vec().norm();
        const bool flows = i < s.n_particles() && s.plastic_deformation[i] != before.plastic_deformation[i];
        const double most = input.duration * still_speed(size_of(scene, i), acceleration, flows);
        const bool still = std::max(way, turn * bounding_radius(scene, i)) <= most;
        s.still_time[i] = still ? s.still_time[i] + input.duration : 0;
    }
    for (const ContactMemory& c : s.contacts)
        if (c.b & Contact::kStatic && moves(input.colliders[c.b & ~Contact::kStatic])) s.still_time[c.a] = 0;

    DisjointSets islands = pieces_of(scene, s);
    size_t n_pieces = 0;
    for (uint32_t i = 0; i < s.n_particles(); ++i) n_pieces += islands.root(i) == i;
    const auto intervals = [](double time) { return std::floor((time + 1e-9) / kSleepInterval); };
    if (intervals(before.time) != intervals(s.time)) {
        join_by_contacts(s, islands);
        std::vector<double> stillest(n_movables, kNever);  // by root: how long all of the island has been still, s
        for (uint32_t i = 0; i < n_movables; ++i) {
            double& least = stillest[islands.root(i)];
            least = std::min(least, s.still_time[i]);
        }
        for (uint32_t i = 0; i < n_movables; ++i)
            if (!s.asleep[i] && stillest[islands.root(i)] >= kTimeToSleep - 1e-9) s.asleep[i] = 1, stop(s, i);
    }
    if (anything_sleeps(s))
        s.rest_conditions = conditions(input, self_collision, FrameEnd::end, s);
    else
        s.rest_conditions.clear();
    return n_pieces;
}

}  // namespace sunder
