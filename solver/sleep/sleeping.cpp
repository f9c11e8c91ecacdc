#include "solver/sleep/sleeping.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/contact.h"
#include "solver/collision/movable_size.h"
#include "solver/collision/shape_distance.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/scene/motion.h"
#include "solver/scene/rest_conditions.h"
#include "solver/scene/scales.h"
#include "solver/step/following.h"

namespace sunder {
namespace {

// Of the way to its middle, how far below that a thing must be touched to lie there.
constexpr double kCarried = 0.2;

using DisjointSets = std::vector<uint32_t>;

DisjointSets pieces_of(const Scene& scene, const FrameState& state) {
    DisjointSets sets = disjoint_sets(state.asleep.size());
    const std::vector<Edge>& edges = scene.rest.edges;
    for (size_t e = 0; e < edges.size(); ++e)
        if (state.edge_intact[e]) unite(sets, edges[e].a, edges[e].b);
    return sets;
}

// Pieces, joined by contacts of what sleeps with what sleeps, and of what is awake with what is awake.
DisjointSets heaps_of(const Scene& scene, const FrameState& state) {
    DisjointSets sets = pieces_of(scene, state);
    for (const ContactMemory& c : state.contacts)
        if (!(c.b & Contact::kStatic) && state.asleep[c.a] == state.asleep[c.b]) unite(sets, c.a, c.b);
    return sets;
}

Vec3 position_of(const FrameState& s, size_t i) {
    return i < s.n_particles() ? s.position[i] : s.rigid_bodies[i - s.n_particles()].position;
}
const Quat& orientation_of(const FrameState& s, size_t i) {
    return i < s.n_particles() ? s.orientation[i] : s.rigid_bodies[i - s.n_particles()].orientation;
}

// How far a sleeper's ellipsoid or hull reaches, m.
double reach_of(const Scene& scene, const FrameState& s, size_t i) {
    double reach = sunder::reach_of(scene, i);
    if (i >= s.n_particles()) return reach;
    for (const Vec3f& p : scene.rest.hull(i))
        reach = std::max(reach, (s.plastic_deformation[i] * p.cast<double>()).norm());
    return reach;
}

// Whether a collider comes within `reach` of a point in this frame.
bool comes_near(const Shape& shape, const DrivenPose& drive, const Vec3& point, double reach) {
    const double way = (drive.begin.apply(drive.end.inverse_apply(point)) - point).norm() + deformation_of(drive);
    return point_shape_distance(point, {shape_at(shape, drive, 0), drive.begin}).gap <= reach + way ||
           point_shape_distance(point, {shape_at(shape, drive, 1), drive.end}).gap <= reach;
}

// The fastest that any point of it may be, m/s.
double surface_speed(const Scene& scene, const FrameState& s, MovableIndex i) {
    const size_t n = s.n_particles();
    const Vec3& v = i < n ? s.velocity[i] : s.rigid_bodies[i - n].velocity;
    const Vec3& w = i < n ? s.angular_velocity[i] : s.rigid_bodies[i - n].angular_velocity;
    return v.norm() + w.norm() * sunder::reach_of(scene, i);
}

double mass_of(const Scene& scene, MovableIndex i) {
    const size_t n = scene.rest.n_particles();
    return i < n ? scene.rest.mass[i] : scene.rigid_bodies[i - n].mass;
}

// Sums of the normal forces on each movable, N.
std::vector<double> loads_of(const FrameState& s) {
    std::vector<double> load(s.asleep.size(), 0.0);
    for (const ContactMemory& c : s.contacts) {
        load[c.a] += c.normal_force;
        if (!(c.b & Contact::kStatic)) load[c.b] += c.normal_force;
    }
    return load;
}

// Calls visit(carrier, carried) for what lies on another: where it touches that is below its middle.
template <class Visit>
void for_carried(const FrameInput& input, const FrameState& s, const Visit& visit) {
    const Vec3 down = FieldsOfForce(input).acceleration;
    for (const ContactMemory& c : s.contacts) {
        if (c.b & Contact::kStatic) continue;
        const double depth = down.dot(orientation_of(s, c.a) * c.point),
                     least = kCarried * down.norm() * c.point.norm();
        if (depth > least) visit(c.b, c.a);
        if (depth < -least) visit(c.a, c.b);
    }
}

// Nothing sleeps on what is awake: that would carry nothing, and go from under it.
void wake_carried(const Scene& scene, const FrameInput& input, FrameState& io_state) {
    FrameState& s = io_state;
    bool lies_on_what_is_awake = false;
    for_carried(input, s, [&](MovableId carrier, MovableId carried) {
        lies_on_what_is_awake |= s.asleep[carried] && !s.asleep[carrier];
    });
    if (!lies_on_what_is_awake) return;
    DisjointSets pieces = pieces_of(scene, s);
    std::vector<uint8_t> wakes(s.asleep.size(), 0);  // by root
    const auto is_awake = [&](uint32_t i) { return !s.asleep[i] || wakes[lowest(pieces, i)]; };
    for (bool any = true; any;) {
        any = false;
        for_carried(input, s, [&](MovableId carrier, MovableId carried) {
            if (is_awake(carrier) && !is_awake(carried)) wakes[lowest(pieces, carried)] = 1, any = true;
        });
    }
    for (uint32_t i = 0; i < s.asleep.size(); ++i)
        if (s.asleep[i] && wakes[lowest(pieces, i)]) s.asleep[i] = 0, s.still_time[i] = kTimeToSleep - kSleepInterval;
}

// Sleeping pieces that lost some of what carries them, or, at looks, are pressed otherwise than when they fell asleep.
// Those that do not move for all that go back to sleep at the next look, with the forces that they then have.
void wake_where_loads_changed(const Scene& scene, double acceleration, bool at_look, FrameState& io_state) {
    FrameState& s = io_state;
    const std::vector<double> load = loads_of(s);
    DisjointSets pieces = pieces_of(scene, s);
    std::vector<double> change(load.size(), 0.0), weight = change, rest_load = change;  // by root, N
    for (uint32_t i = 0; i < load.size(); ++i) {
        if (!s.asleep[i]) continue;
        const uint32_t p = lowest(pieces, i);
        const double loss = s.rest_load[i] - load[i];
        change[p] += at_look ? std::abs(loss) : loss;
        rest_load[p] += s.rest_load[i];
        weight[p] += mass_of(scene, i) * acceleration;
    }
    const double share = at_look ? kWakingChange : kWakingLoss;
    std::vector<uint8_t> wakes(load.size(), 0);  // by root
    for (uint32_t p = 0; p < load.size(); ++p)
        if (change[p] > share * std::max(weight[p], rest_load[p])) wakes[lowest(pieces, p)] = 1;
    for (uint32_t i = 0; i < load.size(); ++i)
        if (s.asleep[i] && wakes[lowest(pieces, i)]) s.asleep[i] = 0, s.still_time[i] = kTimeToSleep - kSleepInterval;
}

// What is awake of pieces that have been still for long enough, that nothing fast touches, and that lie on nothing
// else.
std::vector<MovableId> rested(const Scene& scene, const FrameInput& input, const FrameState& s) {
    const double acceleration = acceleration_of(input);
    DisjointSets pieces = pieces_of(scene, s);
    std::vector<double> still(s.asleep.size(), kNever);  // by root: how long all of the piece has been, s
    for (uint32_t i = 0; i < still.size(); ++i) {
        double& least = still[lowest(pieces, i)];
        least = std::min(least, s.still_time[i]);
    }
    for (const ContactMemory& c : s.contacts) {
        if (c.b & Contact::kStatic) continue;
        const double waking = waking_speed(std::min(size_of(scene, c.a), size_of(scene, c.b)), acceleration);
        if (surface_speed(scene, s, c.b) > waking) still[lowest(pieces, c.a)] = 0;
        if (surface_speed(scene, s, c.a) > waking) still[lowest(pieces, c.b)] = 0;
    }
    const auto rests = [&](uint32_t i) { return s.asleep[i] || still[lowest(pieces, i)] >= kTimeToSleep - 1e-9; };
    for (bool any = true; any;) {
        any = false;
        for_carried(input, s, [&](MovableId carrier, MovableId carried) {
            if (!rests(carrier) && !s.asleep[carried] && rests(carried)) still[lowest(pieces, carried)] = 0, any = true;
        });
    }
    std::vector<MovableId> those;
    for (MovableId i(0); i < still.size(); ++i)
        if (!s.asleep[i] && still[lowest(pieces, i)] >= kTimeToSleep - 1e-9) those.push_back(i);
    return those;
}

// Whether it hardly moved in a frame.
bool is_still(const Scene& scene, const FrameInput& input, const FrameState& before, const FrameState& s,
              MovableIndex i) {
    const auto curvature = [i](const FrameState& of) {  // a state of a file may have none
        return of.plastic_curvature.empty() ? Mat3(Mat3::Zero()) : of.plastic_curvature[i];
    };
    const bool flows = i < s.n_particles() && (s.plastic_deformation[i] != before.plastic_deformation[i] ||
                                               (!s.plastic_curvature.empty() && curvature(s) != curvature(before)));
    const double most = input.duration * still_speed(size_of(scene, i), acceleration_of(input), flows);
    if (!((position_of(s, i) - position_of(before, i)).norm() <= most)) return false;
    // Twice the sine of half the angle: the angle, where that is small.
    const double turn = 2 * (orientation_of(s, i) * orientation_of(before, i).conjugate()).vec().norm();
    return turn * sunder::reach_of(scene, i) <= most;
}

void stop(FrameState& io_state, size_t i) {
    const size_t n = io_state.n_particles();
    Vec3& v = i < n ? io_state.velocity[i] : io_state.rigid_bodies[i - n].velocity;
    Vec3& w = i < n ? io_state.angular_velocity[i] : io_state.rigid_bodies[i - n].angular_velocity;
    v = w = Vec3::Zero();
}

}  // namespace

bool anything_sleeps(const FrameState& state) { return std::ranges::find(state.asleep, 1) != state.asleep.end(); }

void forget_sleep(size_t n_movables, FrameState& io_state) {
    io_state.asleep.assign(n_movables, 0);
    io_state.rest_load.assign(n_movables, 0.0);
    io_state.still_time.assign(n_movables, 0.0);
    io_state.rest_conditions.clear();
}

void wake_changed(const Scene& scene, const FrameInput& input, bool self_collision, double margin,
                  FrameState& io_state) {
    FrameState& s = io_state;
    if (s.rest_conditions.empty()) return;
    SUNDER_ASSERT(margin > 0 && s.asleep.size() == s.n_particles() + s.rigid_bodies.size());
    const std::vector<uint64_t> now = rest_conditions(input, self_collision, FrameEnd::begin, s);
    const std::vector<uint64_t>& then = s.rest_conditions;
    if (now.size() != then.size() || now[0] != then[0] || now[1] != then[1]) {
        return forget_sleep(s.asleep.size(), s);
    }
    std::vector<Woken> woken;
    const size_t n = s.n_particles(), first_pin = 2 + input.materials.size(),
                 first_collider = first_pin + input.pins.size();
    const auto changed = [&](size_t k) { return now[k] != then[k]; };
    for (ParticleId i(0); i < n; ++i)
        if (s.asleep[i] && changed(2 + scene.rest.material_of(i))) woken.push_back({i, true});
    for (size_t k = 0; k < input.pins.size(); ++k)
        if (changed(first_pin + k) || (input.pins[k].active && pin_moves(input, k)))
            for (const ParticleId i : scene.pins[k].particles)
                if (s.asleep[i]) woken.push_back({i, true});
    for (uint32_t c = 0; c < input.colliders.size(); ++c) {
        const DrivenPose& drive = input.colliders[c];
        if (!changed(first_collider + c) && !(drive.active && moves(drive))) continue;
        for (const ContactMemory& contact : s.contacts)
            if (contact.b == (Contact::kStatic | c) && s.asleep[contact.a]) woken.push_back({contact.a, true});
        if (!drive.active) continue;
        for (MovableId i(0); i < s.asleep.size(); ++i)
            if (s.asleep[i] &&
                comes_near(scene.colliders[c].shape, drive, position_of(s, i), reach_of(scene, s, i) + margin))
                woken.push_back({i, true});
    }
    wake_where_loads_changed(scene, acceleration_of(input), false, s);
    wake(scene, input, woken, s);
}

void wake(const Scene& scene, const FrameInput& input, std::span<const Woken> woken, FrameState& io_state) {
    if (woken.empty()) return wake_carried(scene, input, io_state);
    DisjointSets pieces = pieces_of(scene, io_state), heaps = heaps_of(scene, io_state);
    std::vector<uint8_t> piece_wakes(io_state.asleep.size(), 0), heap_wakes = piece_wakes;  // by root
    for (const Woken& w : woken) {
        SUNDER_ASSERT(w.movable < piece_wakes.size());
        piece_wakes[lowest(pieces, w.movable)] = 1;
        if (w.passes_on) heap_wakes[lowest(heaps, w.movable)] = 1;
    }
    for (uint32_t i = 0; i < io_state.asleep.size(); ++i)
        if (io_state.asleep[i] && (piece_wakes[lowest(pieces, i)] || heap_wakes[lowest(heaps, i)]))
            io_state.asleep[i] = 0, io_state.still_time[i] = 0;
    wake_carried(scene, input, io_state);
}

size_t fall_asleep(const Scene& scene, const FrameInput& input, bool self_collision, const FrameState& before,
                   FrameState& io_state) {
    FrameState& s = io_state;
    SUNDER_ASSERT(before.n_particles() == s.n_particles() && s.n_particles() == scene.rest.n_particles());
    SUNDER_ASSERT(s.asleep.size() == s.still_time.size() && s.asleep.size() == s.rest_load.size());
    const double acceleration = acceleration_of(input);
    for (uint32_t i = 0; i < s.asleep.size(); ++i)
        if (!s.asleep[i]) s.still_time[i] = is_still(scene, input, before, s, i) ? s.still_time[i] + input.duration : 0;
    for (const ContactMemory& c : s.contacts)
        if (c.b & Contact::kStatic && moves(input.colliders[c.b & ~Contact::kStatic])) s.still_time[c.a] = 0;

    for (size_t k = 0; k < scene.sources.size(); ++k)
        for (const ParticleId i : scene.sources[k].particles)
            if (follows(s, i) && moves(input.sources[k])) s.still_time[i] = 0;

    DisjointSets pieces = pieces_of(scene, s);
    size_t n_pieces = 0;
    for (uint32_t i = 0; i < s.n_particles(); ++i) n_pieces += pieces[i] == i;
    const auto intervals = [](double time) { return std::floor((time + 1e-9) / kSleepInterval); };
    if (intervals(before.time) != intervals(s.time)) {
        wake_where_loads_changed(scene, acceleration, true, s);
        wake_carried(scene, input, s);
        const std::vector<double> load = loads_of(s);
        for (const MovableId i : rested(scene, input, s)) s.asleep[i] = 1, s.rest_load[i] = load[i], stop(s, i);
    }
    if (anything_sleeps(s))
        s.rest_conditions = rest_conditions(input, self_collision, FrameEnd::end, s);
    else
        s.rest_conditions.clear();
    return n_pieces;
}

}  // namespace sunder
