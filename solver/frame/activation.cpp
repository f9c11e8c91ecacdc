#include "solver/frame/activation.h"

#include <algorithm>

#include "solver/data/disjoint_sets.h"
#include "solver/frame/object_touch.h"
#include "solver/scene/rest_conditions.h"
#include "solver/sleep/sleeping.h"
#include "solver/step/following.h"
#include "solver/step/letting_go.h"

namespace sunder {
namespace {

// Fronts that reach a fragment by so little before the frame's end come in the next, of the frame.
constexpr double kRounding = 1e-6;

bool keeps(const FrameState& state, const Activation& a, ParticleId i) {
    return (state.inactive[i].what & bit_of(a.keeps)) != 0;
}

// How far beyond the object's surface it reaches for this fragment, m: as far as any distance for a share of them all
// that falls with it, from all at 0 to none at the falloff. Of its number in the body, so that it is always the same.
double reach_for(const Activation& a, const SimulationMesh& rest, ParticleId i) {
    if (!(a.falloff > 0)) return 0;
    const double number = rest.fragment[i];
    return a.falloff * static_cast<double>(hash_of({&number, 1}) >> 11) * 0x1p-53;
}

// When what an object comes over is let go, and what lies about it.
void advance_front(const Scene& scene, const Activation& a, const DrivenPose& way, FrameState& s) {
    const size_t channel = a.keeps == Keeps::glued;
    std::vector<ParticleId> touched;
    for (const ParticleId i : a.particles)
        if (keeps(s, a, i) && comes_over(a.object, way, scene.rest, s, i, reach_for(a, scene.rest, i)))
            touched.push_back(i);
    const double when = s.time + a.delay;
    for (const ParticleId i : touched) s.inactive[i].due[channel] = std::min(s.inactive[i].due[channel], when);
    if (!(a.growth > 0)) return;
    for (const ParticleId i : a.particles) {
        double& due = s.inactive[i].due[channel];
        for (const ParticleId from : touched)
            due = std::min(due, when + (s.position[i] - s.position[from]).norm() / a.growth);
    }
}

std::vector<uint32_t> sets_of_pieces(const Scene& scene, const FrameState& s) {
    std::vector<uint32_t> pieces = disjoint_sets(s.n_particles());
    for (size_t e = 0; e < scene.rest.n_edges(); ++e)
        if (s.edge_intact[e]) unite(pieces, scene.rest.edges[e].a, scene.rest.edges[e].b);
    return pieces;
}

// Which source moves a fragment in this frame, or kNone.
std::vector<uint32_t> movers(const Scene& scene, const FrameInput& input, const FrameState& s) {
    std::vector<uint32_t> mover(scene.rest.n_particles(), kNone);
    for (uint32_t k = 0; k < scene.sources.size(); ++k) {
        if (!moves(input.sources[k])) continue;
        for (const ParticleId i : scene.sources[k].particles)
            if (follows(s, i)) mover[i] = k;
    }
    return mover;
}

// The way of something, as a fragment sees it that a source moves.
DrivenPose seen_from(const FrameInput::SourceDrive& drive, const SimulationMesh& rest, ParticleId i, DrivenPose way) {
    const auto at = [&](double share) {
        return SourceWay(*drive.begin, *drive.end, drive.pivot, share).pose(rest.fragment[i], rest.rest_position[i]);
    };
    const Pose begin = at(0), end = at(1);
    const Quat back = begin.orientation * end.orientation.conjugate();
    way.end = {begin.position + back * (way.end.position - end.position), (back * way.end.orientation).normalized()};
    return way;
}

// What is held gives no contact with colliders, and nothing bounds the push of what moves: where one comes upon what
// a contact lets go, or a source would take that there, it lets go in that frame.
void let_go_of_met(const Scene& scene, const FrameInput& input, const Activation& a, std::span<const uint32_t> mover,
                   FrameState& s) {
    if (!waits_for_contact(a) || a.keeps == Keeps::glued) return;
    for (size_t c = 0; c < scene.colliders.size(); ++c) {
        const DrivenPose& way = input.colliders[c];
        if (!way.active) continue;
        for (const ParticleId i : a.particles) {
            if (!keeps(s, a, i) || (mover[i] == kNone && !moves(way))) continue;
            const DrivenPose seen = mover[i] == kNone ? way : seen_from(input.sources[mover[i]], scene.rest, i, way);
            if (comes_over(scene.colliders[c].shape, seen, scene.rest, s, i)) sunder::let_go(s.inactive[i], a.keeps);
        }
    }
}

// What wakes with its piece does so.
void wake_pieces(const Scene& scene, const std::vector<uint8_t>& let_go, FrameState& s) {
    if (std::ranges::none_of(let_go, [](uint8_t bits) { return (bits & Inactivity::kAsleep) != 0; })) return;
    std::vector<uint32_t> pieces = sets_of_pieces(scene, s);
    std::vector<uint8_t> wakes(s.n_particles(), 0);  // by root
    for (uint32_t i = 0; i < let_go.size(); ++i)
        if (let_go[i] & Inactivity::kAsleep) wakes[lowest(pieces, i)] = 1;
    for (uint32_t i = 0; i < let_go.size(); ++i)
        if (wakes[lowest(pieces, i)]) sunder::let_go(s.inactive[i], Keeps::asleep);
}

void let_go(const Scene& scene, const FrameInput& input, const FrameState& before, FrameState& s) {
    std::vector<uint8_t> former(s.n_particles());
    for (size_t i = 0; i < former.size(); ++i) {
        Inactivity& own = s.inactive[i];
        former[i] = own.what;
        own.former_push = own.what ? own.push : 0, own.push = 0;
    }
    const std::vector<uint32_t> mover = movers(scene, input, s);
    for (size_t k = 0; k < scene.activations.size(); ++k) {
        const Activation& a = scene.activations[k];
        if (a.until == Until::object) advance_front(scene, a, input.activations[k].object, s);
        let_go_of_met(scene, input, a, mover, s);
        const double end = s.time + (1 - kRounding) * input.duration;
        for (const ParticleId i : a.particles)
            if (input.activations[k].comes || s.inactive[i].due[a.keeps == Keeps::glued] < end)
                sunder::let_go(s.inactive[i], a.keeps);
    }
    let_go_beside_breaks(scene, before.broken, s);
    hand_over(scene, input, LetGo::at_frame, s);
    for (size_t i = 0; i < former.size(); ++i) former[i] &= static_cast<uint8_t>(~s.inactive[i].what);
    wake_pieces(scene, former, s);
    std::vector<Woken> woken;
    for (size_t i = 0; i < former.size() && !s.asleep.empty(); ++i)
        if ((former[i] || mover[i] != kNone) && s.asleep[i]) woken.push_back({MovableId(i), true});
    if (!woken.empty()) wake(scene, input, woken, s);
}

// Those whose factor is 0, but for what is glued or another seam holds.
bool cut_seams(const Scene& scene, const FrameInput& input, FrameState& s) {
    if (std::ranges::find(input.seams, 0.0) == input.seams.end()) return false;
    std::vector<uint8_t> held(scene.rest.n_edges(), 0);
    for (size_t k = 0; k < scene.seams.size(); ++k)
        for (const EdgeId e : scene.seams[k].edges) held[e] |= input.seams[k] == kNever;
    std::vector<Woken> woken;
    const size_t had = s.broken.size();
    const auto is_glued = [&](ParticleId i) {
        return !s.inactive.empty() && (s.inactive[i].what & Inactivity::kGlued) != 0;
    };
    for (size_t k = 0; k < scene.seams.size(); ++k) {
        if (input.seams[k] != 0) continue;
        for (const EdgeId e : scene.seams[k].edges) {
            const Edge& edge = scene.rest.edges[e];
            if (!s.edge_intact[e] || held[e] || is_glued(edge.a) || is_glued(edge.b)) continue;
            s.edge_intact[e] = 0;
            if (!s.edge_damage.empty()) s.edge_damage[e] = 1;
            s.broken.push_back({e, s.time, 0, 0, {Pusher::Kind::seam, static_cast<uint32_t>(k)}});
            if (!s.asleep.empty() && s.asleep[edge.a]) woken.push_back({MovableId(edge.a), true});
            if (!s.asleep.empty() && s.asleep[edge.b]) woken.push_back({MovableId(edge.b), true});
        }
    }
    if (!woken.empty()) wake(scene, input, woken, s);
    return s.broken.size() > had;
}

}  // namespace

void add_inactivity(const Scene& scene, FrameState& s) {
    if (scene.activations.empty() && scene.sources.empty()) return s.inactive.clear();
    if (!s.inactive.empty()) return;
    s.inactive.resize(s.n_particles());
    for (const Activation& a : scene.activations)
        for (const ParticleId i : a.particles) {
            s.inactive[i].what |= bit_of(a.keeps);
            if (waits_for_contact(a)) s.inactive[i].what |= Inactivity::kTouched;
            if (a.keeps != Keeps::glued) s.velocity[i] = s.angular_velocity[i] = Vec3::Zero();
        }
    for (const Source& source : scene.sources) {
        const SourceWay there(*source.start, *source.start, Vec3::Zero(), 0);
        for (const ParticleId i : source.particles) {
            const Pose pose = there.pose(scene.rest.fragment[i], scene.rest.rest_position[i]);
            s.position[i] = pose.apply(scene.rest.rest_position[i]);
            s.orientation[i] = (pose.orientation * scene.rest.rest_orientation[i]).normalized();
            s.group_rotation[i] = pose.orientation;
            if (!source.start->set.empty()) s.plastic_deformation[i] = source.start->set[scene.rest.fragment[i]];
        }
        if (!source.start->set.empty()) bend_for_good(scene.rest, source.particles, s);
    }
}

void put_to_sleep(const Scene& scene, FrameState& s) {
    if (s.inactive.empty() || s.asleep.empty()) return;
    std::vector<uint32_t> pieces = sets_of_pieces(scene, s);
    std::vector<uint8_t> sleeps(s.n_particles(), 1);  // by root
    for (uint32_t i = 0; i < s.n_particles(); ++i)
        if (!(s.inactive[i].what & Inactivity::kAsleep)) sleeps[lowest(pieces, i)] = 0;
    for (uint32_t i = 0; i < s.n_particles(); ++i)
        if (sleeps[lowest(pieces, i)]) s.asleep[i] = 1, s.still_time[i] = kTimeToSleep;
}

bool begin_activations(const Scene& scene, const FrameInput& input, const FrameState& before, FrameState& s) {
    if (scene.activations.empty() && scene.seams.empty() && scene.sources.empty()) return false;
    if (!s.inactive.empty()) let_go(scene, input, before, s);
    const bool cut = cut_seams(scene, input, s);
    take_up_bonds(scene, input, s);
    return cut;
}

}  // namespace sunder
