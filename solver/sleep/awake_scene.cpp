#include "solver/sleep/awake_scene.h"

#include <algorithm>

#include "solver/collision/cell_filter.h"
#include "solver/collision/movable_size.h"
#include "solver/data/ids.h"
#include "solver/data/invariant.h"
#include "solver/matching/unit_schedule.h"
#include "solver/sleep/awake_reach.h"
#include "solver/step/letting_go.h"

namespace sunder {
namespace {

constexpr double kSkin =
    0.5;  // of a movable's radius: how much farther than a frame takes it neighbours are looked for

// Some of an array, or none where it is empty.
template <class T>
struct Pick {
    const std::vector<T>& from;
    std::vector<T>& to;

    void fit(size_t n) const { to.resize(from.empty() ? 0 : n); }
    void take(std::span<const uint32_t> which, size_t first, size_t last) const {
        if (from.empty()) return;
        for (size_t k = first; k < last; ++k) to[k] = from[which[k]];
    }
};
template <class T>
Pick(const std::vector<T>&, std::vector<T>&) -> Pick<T>;  // clang 16 does not see it by itself

template <class... T>
void pick(std::span<const uint32_t> which, const WorkerPool& workers, const Pick<T>&... picks) {
    (picks.fit(which.size()), ...);
    workers.for_range(which.size(), kParticleGrain,
                      [&](size_t first, size_t last) { (picks.take(which, first, last), ...); });
}

// A rigid body, or a fragment that hangs on nothing.
bool is_lone(const SimulationMesh& rest, const FrameState& state, size_t i) {
    if (i >= rest.n_particles()) return true;
    const auto ring =
        std::span(rest.member_edge).subspan(rest.group_offset[i], rest.group_offset[i + 1] - rest.group_offset[i]);
    return std::ranges::none_of(ring, [&](EdgeId e) { return !e.is_none() && state.edge_intact[e]; });
}

bool acts_on_awake(const ContactMemory& c, const std::vector<uint8_t>& asleep) {
    return !asleep[c.a] || (!(c.b & Contact::kStatic) && !asleep[c.b]);
}

// Where a sleeper may be touched.
Aabb ball_of(const StepContext& whole, const FrameState& state, size_t i) {
    const size_t n = state.n_particles();
    const Vec3& x = i < n ? state.position[i] : state.rigid_bodies[i - n].position;
    return ball(x, reach_of(whole.scene, i) + whole.contact_margin);
}

}  // namespace

void AwakeScene::enter(const StepContext& whole, const FrameState& state) {
    SUNDER_ASSERT(state.asleep.size() == state.n_particles() + state.rigid_bodies.size());
    if (asleep_ != state.asleep && !wake_here(whole, state)) return build(whole, state);
    gather(state, whole.workers);
    memory_.synchronise(context(whole), state_);
}

// What wakes in rubble is mostly a fragment or two, which are here because something touched them: without edges, they
// need only be fixed no longer. False where anything else changed, or what they lie on is not here: its forces on them
// would be lost.
bool AwakeScene::wake_here(const StepContext& whole, const FrameState& state) {
    if (asleep_.size() != state.asleep.size()) return false;
    std::vector<MovableId> woken;  // here
    for (size_t i = 0; i < asleep_.size(); ++i) {
        if (asleep_[i] == state.asleep[i]) continue;
        if (!asleep_[i] || index_[i] == kNone || !is_lone(whole.scene.rest, state, i)) return false;
        woken.push_back(index_[i]);
    }
    const auto is_missing = [&](const ContactMemory& c) { return acts_on_awake(c, state.asleep) && !is_here(c); };
    if (std::ranges::any_of(state.contacts, is_missing)) return false;
    for (const MovableId k : woken) fixed_[k] = 0;
    n_awake_ += woken.size();
    asleep_ = state.asleep;
    take_pins(whole.scene.pins);
    take_activations(whole.scene.activations);
    take_sources(whole.scene.sources);
    return true;
}

bool AwakeScene::is_here(const ContactMemory& c) const {
    return index_[c.a] != kNone && (c.b & Contact::kStatic || index_[c.b] != kNone);
}

void AwakeScene::cover(const StepContext& whole, double h, double end, FrameState& io_state) {
    const std::vector<Aabb> soon = reach(context(whole), state_, fixed_, h, end, 0);
    std::vector<uint8_t> beyond(soon.size());
    for (size_t i = 0; i < soon.size(); ++i) beyond[i] = !fixed_[i] && !holds(covered_[i], soon[i]);
    if (std::ranges::find(beyond, 1) == beyond.end()) return;
    const std::vector<Aabb> later = reach(context(whole), state_, fixed_, h, end, kSkin);
    for (const std::vector<Aabb>* boxes : {&later, &soon}) {
        if (meets_more(whole, io_state, *boxes, beyond)) continue;
        for (size_t i = 0; i < beyond.size(); ++i)
            if (beyond[i]) covered_[i] = (*boxes)[i];
        return;
    }
    leave(whole.workers, io_state);
    const StepPair begun = pair(whole.workers);
    build(whole, io_state);
    go_on(begun, whole.workers);
}

// Whether one of those boxes that count may meet a sleeper that is not here.
bool AwakeScene::meets_more(const StepContext& whole, const FrameState& state, std::span<const Aabb> boxes,
                            std::span<const uint8_t> counts) const {
    const CellFilter filter(boxes, counts, whole.workers);
    for (size_t i = 0; i < index_.size(); ++i)
        if (index_[i] == kNone && filter.may_meet(ball_of(whole, state, i))) return true;
    return false;
}

StepPair AwakeScene::pair(const WorkerPool& workers) const { return memory_.pair.renumbered(index_, workers); }

void AwakeScene::go_on(const StepPair& whole, const WorkerPool& workers) {
    memory_.pair = whole.renumbered(movable_, workers);
}

void AwakeScene::build(const StepContext& whole, const FrameState& state) {
    if (scene_.colliders.empty()) scene_.colliders = whole.scene.colliders;
    scene_.bodies = whole.scene.bodies, scene_.region_bodies = whole.scene.region_bodies;
    asleep_ = state.asleep;
    const size_t n_movables = asleep_.size(), n = state.n_particles();
    std::vector<uint8_t> here(n_movables);
    for (size_t i = 0; i < n_movables; ++i) here[i] = !asleep_[i];
    n_awake_ = static_cast<size_t>(std::count(here.begin(), here.end(), 1));

    const std::vector<Aabb> boxes = reach(whole, state, asleep_, whole.input.duration, 1, kSkin);
    const CellFilter filter(boxes, here, whole.workers);
    whole.workers.for_range(n_movables, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            if (asleep_[i]) here[i] = filter.may_meet(ball_of(whole, state, i));
        }
    });

    const std::vector<MovableId> before = std::move(index_);
    std::vector<ParticleId> former;
    movable_.clear(), particle_.clear(), rigid_body_.clear(), fixed_.clear(), covered_.clear();
    index_.assign(n_movables, MovableId::none());
    for (MovableId i(0); i < n_movables; ++i) {
        if (!here[i]) continue;
        index_[i] = MovableId(fixed_.size());
        fixed_.push_back(asleep_[i]);
        covered_.push_back(boxes[i]);
        movable_.push_back(i);
        if (i >= n) {
            rigid_body_.push_back(static_cast<uint32_t>(i - n));
            continue;
        }
        particle_.push_back(ParticleId(i.value));
        former.push_back(ParticleId(i < before.size() ? before[i].value : kNone));
    }
    take_particles(whole.scene.rest, whole.workers);
    pick(rigid_body_, whole.workers, Pick{whole.scene.rigid_bodies, scene_.rigid_bodies});
    take_pins(whole.scene.pins);
    take_activations(whole.scene.activations);
    take_sources(whole.scene.sources);
    take_rings(whole.scene.rest, state, whole.workers);
    take_seams(whole.scene.seams);
    gather(state, whole.workers);
    memory_.renumber(context(whole), state_, former);
}

void AwakeScene::take_pins(const std::vector<Pin>& pins) {
    scene_.pins = pins;
    for (Pin& pin : scene_.pins) {
        std::erase_if(pin.particles, [&](ParticleId i) { return asleep_[i]; });
        for (ParticleId& i : pin.particles) i = particle_here(i);
    }
}

void AwakeScene::take_activations(const std::vector<Activation>& activations) {
    scene_.activations = activations;
    for (Activation& a : scene_.activations) {
        std::erase_if(a.particles, [&](ParticleId i) { return asleep_[i] != 0 || index_[i].is_none(); });
        for (ParticleId& i : a.particles) i = particle_here(i);
    }
}

void AwakeScene::take_sources(const std::vector<Source>& sources) {
    scene_.sources = sources;
    for (Source& source : scene_.sources) {
        std::erase_if(source.particles, [&](ParticleId i) { return asleep_[i] != 0 || index_[i].is_none(); });
        for (ParticleId& i : source.particles) i = particle_here(i);
    }
}

void AwakeScene::take_seams(const std::vector<Seam>& seams) {
    scene_.seams = seams;
    for (Seam& seam : scene_.seams) {
        std::erase_if(seam.edges, [&](EdgeId e) { return edge_here_[e].is_none(); });
        for (EdgeId& e : seam.edges) e = edge_here_[e];
    }
}

void AwakeScene::take_particles(const SimulationMesh& rest, const WorkerPool& workers) {
    SimulationMesh& m = scene_.rest;
    pick(numbers(particles()), workers, Pick{rest.rest_position, m.rest_position},
         Pick{rest.rest_orientation, m.rest_orientation}, Pick{rest.radii, m.radii}, Pick{rest.volume, m.volume},
         Pick{rest.mass, m.mass}, Pick{rest.body, m.body}, Pick{rest.fragment, m.fragment},
         Pick{rest.yield_factor, m.yield_factor}, Pick{rest.toughness_factor, m.toughness_factor},
         Pick{rest.material, m.material}, Pick{rest.group_uneven, m.group_uneven},
         Pick{rest.group_trace, m.group_trace}, Pick{rest.thin, m.thin}, Pick{rest.flat, m.flat});
    m.hull_offset.clear();
    if (rest.hull_offset.empty()) return;
    m.hull_offset.push_back(0);
    for (const ParticleId i : particle_)
        m.hull_offset.push_back(m.hull_offset.back() + static_cast<uint32_t>(rest.hull(i).size()));
    m.hull_point.resize(m.hull_offset.back());
    workers.for_range(particle_.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k)
            std::ranges::copy(rest.hull(particle_[k]), m.hull_point.begin() + m.hull_offset[k]);
    });
}

// Edges among what is awake. One-rings keep all of their slots, so that they know what broke off; those whose edge
// leads to a sleeper, and those of sleepers that may wake here (wake_here), get an edge that is never intact:
//
//     whole  group i: ... i  j  k ...          here  group i: ... i  j  i ...      (k sleeps)
//            edges        -  e  f                    edges        -  e' broken
void AwakeScene::take_rings(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers) {
    SimulationMesh& m = scene_.rest;
    const auto awake = [&](ParticleId i) { return !asleep_[i]; };
    const auto is_bound = [&](ParticleId i) { return !awake(i) && !is_lone(rest, state, i); };
    take_edges(rest, workers);
    const EdgeId broken(edge_.size());
    if (!particle_.empty()) m.edges.push_back({ParticleId(0), ParticleId(0), 0, 1});

    m.group_offset.assign(1, 0);
    for (const ParticleId i : particle_) {
        const uint32_t n_slots = is_bound(i) ? 1 : rest.group_offset[i + 1] - rest.group_offset[i];
        m.group_offset.push_back(m.group_offset.back() + n_slots);
    }
    const uint32_t n_slots = m.group_offset.back();
    m.group_member.resize(n_slots), m.member_edge.resize(n_slots), m.member_twin.resize(n_slots);
    const auto take_ring = [&](ParticleId k) {
        const ParticleId i = particle_[k];
        uint32_t own = m.group_offset[k];
        if (is_bound(i)) {
            m.group_member[own] = k, m.member_edge[own] = EdgeId::none(), m.member_twin[own] = own;
            m.group_uneven[k] = 0;
            return;
        }
        for (uint32_t s = rest.group_offset[i]; s < rest.group_offset[i + 1]; ++s, ++own) {
            const ParticleId j = rest.group_member[s];
            const bool known = awake(i) && awake(j);
            m.group_member[own] = known ? particle_here(j) : k;
            m.member_edge[own] = j == i ? EdgeId::none() : known ? edge_here_[rest.member_edge[s]] : broken;
            m.member_twin[own] = known ? m.group_offset[index_[j]] + rest.member_twin[s] - rest.group_offset[j] : own;
        }
    };
    workers.for_range(particle_.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k) take_ring(ParticleId(k));
    });
}

void AwakeScene::take_edges(const SimulationMesh& rest, const WorkerPool& workers) {
    constexpr size_t kChunk = 1024;
    const size_t n_chunks = (rest.n_edges() + kChunk - 1) / kChunk;
    const auto for_chunks = [&](const auto& body) {  // (chunk, edge)
        workers.for_range(n_chunks, 1, [&](size_t first, size_t last) {
            for (size_t chunk = first; chunk < last; ++chunk)
                for (size_t e = chunk * kChunk; e < std::min((chunk + 1) * kChunk, rest.n_edges()); ++e)
                    body(chunk, EdgeId(e));
        });
    };
    std::vector<uint32_t> begin(n_chunks + 1, 0);
    edge_here_.resize(rest.n_edges());
    for_chunks([&](size_t chunk, EdgeId e) {  // counted within the chunk
        const bool a = !asleep_[rest.edges[e].a], b = !asleep_[rest.edges[e].b];
        edge_here_[e] = EdgeId(a && b ? begin[chunk + 1]++ : kNone);
    });
    for (size_t chunk = 0; chunk < n_chunks; ++chunk) begin[chunk + 1] += begin[chunk];
    edge_.resize(begin[n_chunks]), scene_.rest.edges.resize(begin[n_chunks]);
    for_chunks([&](size_t chunk, EdgeId e) {
        if (edge_here_[e].is_none()) return;
        const EdgeId here = edge_here_[e] = EdgeId(edge_here_[e] + begin[chunk]);
        const Edge& edge = rest.edges[e];
        edge_[here] = e;
        scene_.rest.edges[here] = {particle_here(edge.a), particle_here(edge.b), edge.area, edge.toughness_factor};
    });
}

void AwakeScene::gather(const FrameState& s, const WorkerPool& workers) {
    state_.time = s.time;
    pick(numbers(particles()), workers, Pick{s.position, state_.position}, Pick{s.orientation, state_.orientation},
         Pick{s.velocity, state_.velocity}, Pick{s.angular_velocity, state_.angular_velocity},
         Pick{s.plastic_deformation, state_.plastic_deformation}, Pick{s.plastic_curvature, state_.plastic_curvature},
         Pick{s.layer_strain, state_.layer_strain}, Pick{s.yielding_rate, state_.yielding_rate},
         Pick{s.yield, state_.yield}, Pick{s.strain, state_.strain}, Pick{s.group_rotation, state_.group_rotation},
         Pick{s.inactive, state_.inactive});
    pick(numbers(std::span<const EdgeId>(edge_)), workers, Pick{s.edge_intact, state_.edge_intact});
    state_.edge_intact.resize(scene_.rest.n_edges(), 0);  // the broken one of take_rings
    pick(numbers(std::span<const EdgeId>(edge_)), workers, Pick{s.edge_damage, state_.edge_damage},
         Pick{s.edge_hold, state_.edge_hold}, Pick{s.edge_bond, state_.edge_bond},
         Pick{s.edge_offset, state_.edge_offset});
    if (!s.edge_bond.empty()) state_.edge_bond.resize(scene_.rest.n_edges(), 1);
    pick(numbers(particles()), workers, Pick{s.stiffness_factor, state_.stiffness_factor});
    if (!s.edge_damage.empty())
        state_.edge_damage.resize(scene_.rest.n_edges(), 0), state_.edge_hold.resize(scene_.rest.n_edges(), 0);
    if (!s.edge_offset.empty()) state_.edge_offset.resize(scene_.rest.n_edges());
    pick(rigid_body_, workers, Pick{s.rigid_bodies, state_.rigid_bodies});
    state_.broken.clear();
    state_.contacts.clear();
    for (const ContactMemory& c : s.contacts) {
        if (!acts_on_awake(c, asleep_) || !is_here(c)) continue;
        state_.contacts.push_back(c);
        state_.contacts.back().a = index_[c.a];
        if (!(c.b & Contact::kStatic)) state_.contacts.back().b = index_[c.b];
    }
}

void AwakeScene::leave(const WorkerPool& workers, FrameState& io_state) {
    FrameState& s = io_state;
    SUNDER_ASSERT(index_.size() == s.n_particles() + s.rigid_bodies.size());
    SUNDER_ASSERT(state_.edge_intact.size() >= edge_.size() && state_.n_particles() == particle_.size());
    s.time = state_.time;
    workers.for_range(particle_.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k) {
            if (fixed_[k]) continue;
            const ParticleId i = particle_[k];
            s.position[i] = state_.position[k], s.orientation[i] = state_.orientation[k];
            s.velocity[i] = state_.velocity[k], s.angular_velocity[i] = state_.angular_velocity[k];
            s.plastic_deformation[i] = state_.plastic_deformation[k];
            if (!s.plastic_curvature.empty())
                s.plastic_curvature[i] = state_.plastic_curvature[k], s.layer_strain[i] = state_.layer_strain[k];
            if (!s.yielding_rate.empty()) s.yielding_rate[i] = state_.yielding_rate[k];
            if (!s.stiffness_factor.empty()) s.stiffness_factor[i] = state_.stiffness_factor[k];
            if (!s.inactive.empty()) s.inactive[i] = state_.inactive[k];
            s.yield[i] = state_.yield[k], s.strain[i] = state_.strain[k];
            s.group_rotation[i] = state_.group_rotation[k];
        }
    });
    for (size_t r = 0; r < rigid_body_.size(); ++r)
        if (!fixed_[particle_.size() + r]) s.rigid_bodies[rigid_body_[r]] = state_.rigid_bodies[r];
    for (size_t e = 0; e < edge_.size(); ++e) s.edge_intact[edge_[e]] = state_.edge_intact[e];
    for (size_t e = 0; e < edge_.size() && !s.edge_damage.empty(); ++e)
        s.edge_damage[edge_[e]] = state_.edge_damage[e], s.edge_hold[edge_[e]] = state_.edge_hold[e];
    for (size_t e = 0; e < edge_.size() && !s.edge_offset.empty(); ++e) s.edge_offset[edge_[e]] = state_.edge_offset[e];
    for (size_t e = 0; e < edge_.size() && !s.edge_bond.empty(); ++e)  // contacts may have let go of all that is glued
        s.edge_bond[edge_[e]] = state_.edge_bond.empty() ? 1 : state_.edge_bond[e];
    for (BrokenEdge b : state_.broken) {
        b.edge = edge_[b.edge];
        if (b.by.kind == Pusher::Kind::particle) b.by.number = particle_[b.by.number];
        if (b.by.kind == Pusher::Kind::rigid_body) b.by.number = rigid_body_[b.by.number];
        s.broken.push_back(b);
    }
    state_.broken.clear();
    std::vector<ContactMemory> contacts;
    for (const ContactMemory& c : s.contacts)
        if (!acts_on_awake(c, asleep_)) contacts.push_back(c);
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

// What broke here before it was built last is told by the whole scene.
void AwakeScene::let_go_between_steps(const StepContext& whole, const FrameState& state) {
    std::vector<BrokenEdge> broken = state_.broken;
    for (BrokenEdge b : state.broken) {
        b.edge = edge_here_[b.edge];
        if (!b.edge.is_none()) broken.push_back(b);
    }
    sunder::let_go_between_steps(scene_, whole.input, broken, state_);
}

StepContext AwakeScene::context(const StepContext& whole) const {
    return {scene_, whole.input, whole.settings, whole.workers, whole.contact_margin, fixed_, whole.wakes};
}

Result<StepOutcome> AwakeScene::step(const StepContext& whole, const StepTime& time, FrameState& io_state,
                                     StepReport& io_report) {
    cover(whole, time.h, time.end, io_state);
    Result<StepOutcome> outcome = sunder::step(context(whole), time, memory_, state_, io_report);
    if (!outcome) return outcome;
    for (Woken& w : outcome->woken) w.movable = movable_[w.movable];
    if (outcome->hit.parts == 1) return outcome;
    std::vector<uint8_t> what(index_.size(), 0);
    for (size_t k = 0; k < movable_.size(); ++k) what[movable_[k]] = outcome->hit.what[k];
    outcome->hit.what = std::move(what);
    return outcome;
}

}  // namespace sunder
