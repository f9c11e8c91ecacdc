#include "solver/awake_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "solver/collision/broad_phase.h"
#include "solver/collision/shape_distance.h"
#include "solver/motion.h"
#include "solver/sleeping.h"

namespace sunder {
namespace {

constexpr uint32_t kNone = SimulationMesh::kNone;
constexpr double kSkin =
    0.5;  // of a movable's radius: how much farther than a frame takes it neighbours are looked for

double radius_of(const Scene& scene, size_t i) {
    const size_t n = scene.rest.n_particles();
    return i < n ? scene.rest.radii[i].maxCoeff() : bounding_radius(scene.rigid_bodies[i - n].shape);
}

template <class T>
std::vector<T> picked(const std::vector<T>& all, std::span<const uint32_t> which) {
    std::vector<T> some;
    if (all.empty()) return some;
    some.reserve(which.size());
    for (const uint32_t i : which) some.push_back(all[i]);
    return some;
}

/// Which cells of space hold something; it may say yes where it should say no.
class CellFilter {
public:
    CellFilter(double cell, size_t n_boxes) : inverse_(1 / cell), bits_(std::bit_ceil(64 * n_boxes + 1024) / 64, 0) {}

    void add(const Aabb& box) {
        if (covers_many(box))
            large_.push_back(box);
        else
            for_cells(box, [&](uint64_t bit) { bits_[bit / 64] |= uint64_t{1} << bit % 64; });
    }
    bool may_meet(const Aabb& box) const {
        for (const Aabb& other : large_)
            if (overlap(box, other)) return true;
        if (covers_many(box)) return true;
        bool meets = false;
        for_cells(box, [&](uint64_t bit) { meets |= bits_[bit / 64] >> bit % 64 & 1; });
        return meets;
    }

private:
    bool covers_many(const Aabb& box) const {
        const Vec3 cells = (box.max - box.min) * inverse_ + Vec3::Ones();
        return !(cells.prod() < 512) || !(box.min.cwiseAbs().maxCoeff() * inverse_ < 1e9);
    }
    template <class Visit>
    void for_cells(const Aabb& box, const Visit& visit) const {
        const auto cell = [&](double x) { return static_cast<int64_t>(std::floor(x * inverse_)); };
        for (int64_t x = cell(box.min.x()); x <= cell(box.max.x()); ++x)
            for (int64_t y = cell(box.min.y()); y <= cell(box.max.y()); ++y)
                for (int64_t z = cell(box.min.z()); z <= cell(box.max.z()); ++z) {
                    uint64_t k = uint64_t(x) * 0x9e3779b97f4a7c15u + uint64_t(y) * 0xc2b2ae3d27d4eb4fu +
                                 uint64_t(z) * 0x165667b19e3779f9u;
                    k = (k ^ k >> 32) * 0xd6e8feb86659fd93u;
                    visit((k ^ k >> 32) & (64 * bits_.size() - 1));
                }
    }

    double inverse_;
    std::vector<uint64_t> bits_;
    std::vector<Aabb> large_;
};

Aabb ball(const Vec3& center, double radius) {
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
}

// Boxes that hold each movable that does not rest for so many seconds from its present state, and whatever its
// contacts reach; `end`: where pins are then. Empty for what rests.
std::vector<Aabb> reach(const StepContext& context, const FrameState& state, std::span<const uint8_t> rests,
                        double seconds, double end, double skin) {
    const size_t n = state.n_particles();
    const double fall = acceleration_of(context.input) * seconds * seconds;
    std::vector<Aabb> boxes(rests.size());
    std::vector<double> size(rests.size());
    for (size_t i = 0; i < boxes.size(); ++i) {
        if (rests[i]) continue;
        const bool is_particle = i < n;
        const RigidBodyState* rigid = is_particle ? nullptr : &state.rigid_bodies[i - n];
        const Vec3& x = is_particle ? state.position[i] : rigid->position;
        const Vec3 way = seconds * (is_particle ? state.velocity[i] : rigid->velocity);
        const double angle = seconds * (is_particle ? state.angular_velocity[i] : rigid->angular_velocity).norm();
        const double radius = radius_of(context.scene, i);
        size[i] = radius * (1 + skin + std::min(angle, 1.0)) + context.contact_margin + fall + skin * way.norm();
        boxes[i] = ball(x, size[i]);
        boxes[i].min += way.cwiseMin(0.0), boxes[i].max += way.cwiseMax(0.0);
    }
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        if (!context.input.pins[k].active) continue;
        const Pose pose = interpolate(context.input.pins[k], end);
        for (const uint32_t i : context.scene.pins[k].particles) {
            if (rests[i]) continue;
            const Aabb there = ball(pose.apply(context.scene.rest.rest_position[i]), size[i]);
            boxes[i].extend(there.min), boxes[i].extend(there.max);
        }
    }
    return boxes;
}

}  // namespace

void AwakeScene::enter(const StepContext& whole, const FrameState& state) {
    if (asleep_ != state.asleep) return build(whole, state);
    gather(state);
    synchronise(context(whole), state_, work_);
}

void AwakeScene::cover(const StepContext& whole, double h, double end, FrameState& io_state) {
    const std::vector<Aabb> boxes = reach(context(whole), state_, fixed_, h, end, 0);
    for (size_t i = 0; i < boxes.size(); ++i) {
        if (fixed_[i] || holds(covered_[i], boxes[i])) continue;
        leave(io_state);
        const SubstepPair begun = pair();
        build(whole, io_state);
        go_on(begun);
        return;
    }
}

SubstepPair AwakeScene::pair() const { return work_.pair.renumbered(index_, n_whole_particles_); }

void AwakeScene::go_on(const SubstepPair& whole) { work_.pair = whole.renumbered(movable_, particle_.size()); }

void AwakeScene::build(const StepContext& whole, const FrameState& state) {
    if (scene_.colliders.empty()) scene_.colliders = whole.scene.colliders;
    scene_.bodies = whole.scene.bodies;
    asleep_ = state.asleep;
    const size_t n_movables = asleep_.size(), n = n_whole_particles_ = state.n_particles();
    std::vector<uint8_t> here(n_movables);
    for (size_t i = 0; i < n_movables; ++i) here[i] = !asleep_[i];
    n_awake_ = static_cast<size_t>(std::count(here.begin(), here.end(), 1));

    const std::vector<Aabb> boxes = reach(whole, state, asleep_, whole.input.duration, 1, kSkin);
    double extent = 0;
    for (size_t i = 0; i < n_movables; ++i)
        if (here[i]) extent += (boxes[i].max - boxes[i].min).maxCoeff() / static_cast<double>(n_awake_);
    CellFilter filter(std::max(extent, 1e-6), n_awake_);
    for (size_t i = 0; i < n_movables; ++i)
        if (here[i]) filter.add(boxes[i]);
    for (size_t i = 0; i < n_movables; ++i) {
        if (!asleep_[i]) continue;
        const Vec3& x = i < n ? state.position[i] : state.rigid_bodies[i - n].position;
        here[i] = filter.may_meet(ball(x, radius_of(whole.scene, i) + whole.contact_margin));
    }

    const std::vector<uint32_t> before = std::move(index_);
    std::vector<uint32_t> former;
    movable_.clear(), particle_.clear(), rigid_body_.clear(), fixed_.clear(), covered_.clear();
    index_.assign(n_movables, kNone);
    for (uint32_t i = 0; i < n_movables; ++i) {
        if (!here[i]) continue;
        index_[i] = static_cast<uint32_t>(fixed_.size());
        fixed_.push_back(asleep_[i]);
        covered_.push_back(boxes[i]);
        movable_.push_back(i);
        if (i >= n) {
            rigid_body_.push_back(static_cast<uint32_t>(i - n));
            continue;
        }
        particle_.push_back(i);
        former.push_back(i < before.size() ? before[i] : kNone);
    }
    take_particles(whole.scene.rest);
    scene_.rigid_bodies = picked(whole.scene.rigid_bodies, rigid_body_);
    scene_.pins = whole.scene.pins;
    for (Pin& pin : scene_.pins) {
        std::erase_if(pin.particles, [&](uint32_t i) { return asleep_[i]; });
        for (uint32_t& i : pin.particles) i = index_[i];
    }
    take_rings(whole.scene.rest);
    gather(state);
    renumber(context(whole), state_, former, work_);
}

void AwakeScene::take_particles(const SimulationMesh& rest) {
    SimulationMesh& m = scene_.rest;
    m.rest_position = picked(rest.rest_position, particle_);
    m.rest_orientation = picked(rest.rest_orientation, particle_);
    m.radii = picked(rest.radii, particle_);
    m.volume = picked(rest.volume, particle_);
    m.mass = picked(rest.mass, particle_);
    m.body = picked(rest.body, particle_);
    m.fragment = picked(rest.fragment, particle_);
    m.yield_factor = picked(rest.yield_factor, particle_);
    m.toughness_factor = picked(rest.toughness_factor, particle_);
    m.group_uneven = picked(rest.group_uneven, particle_);
    m.group_trace = picked(rest.group_trace, particle_);
    m.hull_offset.clear(), m.hull_point.clear();
    if (rest.hull_offset.empty()) return;
    m.hull_offset.push_back(0);
    for (uint32_t i : particle_) {
        m.hull_point.insert(m.hull_point.end(), rest.hull(i).begin(), rest.hull(i).end());
        m.hull_offset.push_back(static_cast<uint32_t>(m.hull_point.size()));
    }
}

// Edges among what is awake. One-rings keep all of their slots, so that they know what broke off; those whose edge
// leads to a sleeper get an edge that is never intact:
//
//     whole  group i: ... i  j  k ...          here  group i: ... i  j  i ...      (k sleeps)
//            edges        -  e  f                    edges        -  e' broken
void AwakeScene::take_rings(const SimulationMesh& rest) {
    SimulationMesh& m = scene_.rest;
    const auto awake = [&](uint32_t i) { return !asleep_[i]; };
    edge_.clear(), m.edges.clear();
    std::vector<uint32_t> edge_here(rest.n_edges(), kNone);
    for (uint32_t e = 0; e < rest.n_edges(); ++e) {
        const Edge& edge = rest.edges[e];
        if (!awake(edge.a) || !awake(edge.b)) continue;
        edge_here[e] = static_cast<uint32_t>(edge_.size());
        edge_.push_back(e);
        m.edges.push_back({index_[edge.a], index_[edge.b], edge.area, edge.toughness_factor});
    }
    const auto broken = static_cast<uint32_t>(edge_.size());
    if (std::ranges::any_of(rest.edges, [&](const Edge& e) { return awake(e.a) != awake(e.b); }))
        m.edges.push_back({0, 0, 0, 1});

    m.group_offset.assign(1, 0);
    for (const uint32_t i : particle_) {
        const uint32_t n_slots = awake(i) ? rest.group_offset[i + 1] - rest.group_offset[i] : 1;
        m.group_offset.push_back(m.group_offset.back() + n_slots);
    }
    const uint32_t n_slots = m.group_offset.back();
    m.group_member.resize(n_slots), m.member_edge.resize(n_slots), m.member_twin.resize(n_slots);
    for (uint32_t k = 0; k < particle_.size(); ++k) {
        const uint32_t i = particle_[k];
        uint32_t own = m.group_offset[k];
        if (!awake(i)) {
            m.group_member[own] = k, m.member_edge[own] = kNone, m.member_twin[own] = own;
            m.group_uneven[k] = 0;
            continue;
        }
        for (uint32_t s = rest.group_offset[i]; s < rest.group_offset[i + 1]; ++s, ++own) {
            const uint32_t j = rest.group_member[s], e = rest.member_edge[s];
            const bool known = awake(j);
            m.group_member[own] = known ? index_[j] : k;
            m.member_edge[own] = j == i ? kNone : known ? edge_here[e] : broken;
            m.member_twin[own] = known ? m.group_offset[index_[j]] + rest.member_twin[s] - rest.group_offset[j] : own;
        }
    }
}

void AwakeScene::gather(const FrameState& s) {
    state_.time = s.time;
    state_.position = picked(s.position, particle_);
    state_.orientation = picked(s.orientation, particle_);
    state_.velocity = picked(s.velocity, particle_);
    state_.angular_velocity = picked(s.angular_velocity, particle_);
    state_.plastic_deformation = picked(s.plastic_deformation, particle_);
    state_.yield = picked(s.yield, particle_);
    state_.strain = picked(s.strain, particle_);
    state_.group_rotation = picked(s.group_rotation, particle_);
    state_.edge_intact = picked(s.edge_intact, edge_);
    state_.edge_intact.resize(scene_.rest.n_edges(), 0);  // the broken one of take_rings
    state_.rigid_bodies = picked(s.rigid_bodies, rigid_body_);
    state_.broken.clear();
    state_.contacts.clear();
    for (const ContactMemory& c : s.contacts) {
        const bool on_collider = c.b & Contact::kStatic;
        if (asleep_[c.a] && (on_collider || asleep_[c.b])) continue;
        if (index_[c.a] == kNone || (!on_collider && index_[c.b] == kNone)) continue;
        state_.contacts.push_back(c);
        state_.contacts.back().a = index_[c.a];
        if (!on_collider) state_.contacts.back().b = index_[c.b];
    }
}

void AwakeScene::leave(FrameState& io_state) {
    FrameState& s = io_state;
    s.time = state_.time;
    for (size_t k = 0; k < particle_.size(); ++k) {
        if (fixed_[k]) continue;
        const uint32_t i = particle_[k];
        s.position[i] = state_.position[k], s.orientation[i] = state_.orientation[k];
        s.velocity[i] = state_.velocity[k], s.angular_velocity[i] = state_.angular_velocity[k];
        s.plastic_deformation[i] = state_.plastic_deformation[k];
        s.yield[i] = state_.yield[k], s.strain[i] = state_.strain[k];
        s.group_rotation[i] = state_.group_rotation[k];
    }
    for (size_t r = 0; r < rigid_body_.size(); ++r)
        if (!fixed_[particle_.size() + r]) s.rigid_bodies[rigid_body_[r]] = state_.rigid_bodies[r];
    for (size_t e = 0; e < edge_.size(); ++e) s.edge_intact[edge_[e]] = state_.edge_intact[e];
    for (BrokenEdge b : state_.broken) {
        b.edge = edge_[b.edge];
        s.broken.push_back(b);
    }
    state_.broken.clear();
    std::vector<ContactMemory> contacts;
    for (const ContactMemory& c : s.contacts)
        if (asleep_[c.a] && (c.b & Contact::kStatic || asleep_[c.b])) contacts.push_back(c);
    const auto middle = static_cast<std::ptrdiff_t>(contacts.size());
    for (ContactMemory c : state_.contacts) {
        c.a = movable_[c.a];
        if (!(c.b & Contact::kStatic)) c.b = movable_[c.b];
        contacts.push_back(c);
    }
    std::inplace_merge(
        contacts.begin(), contacts.begin() + middle, contacts.end(),
        [](const ContactMemory& x, const ContactMemory& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
    s.contacts = std::move(contacts);
}

StepContext AwakeScene::context(const StepContext& whole) const {
    return {scene_, whole.input, whole.settings, whole.workers, whole.contact_margin, fixed_, whole.wakes};
}

std::vector<uint32_t> AwakeScene::woken() const { return picked(movable_, work_.woken); }

}  // namespace sunder
