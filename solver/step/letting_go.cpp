#include "solver/step/letting_go.h"

#include <algorithm>

#include "solver/data/invariant.h"
#include "solver/scene/strength.h"
#include "solver/step/following.h"

namespace sunder {
namespace {

// What is left of a hit after a step for the next one to take, N s: a gap closes in one step by the way that was left
// of it, and what hits has that speed still.
double left_of(const ActiveContact& c, double h, const Movables& movables) {
    const auto way = [&](MovableId i) -> Vec3 { return movables.moving[i].x - movables.start_position[i]; };
    const bool has_b = has_movable_b(c.contact);
    const MovableId a = c.contact.a, b = c.contact.b;
    const double inverse_mass = movables.inverse_mass[a] + (has_b ? movables.inverse_mass[b] : 0);
    const double closed = -c.contact.normal.dot(way(a) - (has_b ? way(b) : c.collider_motion));
    return inverse_mass > 0 ? std::max(0.0, closed) / h / inverse_mass : 0;
}

enum class Counted { taken, foreseen };  // what a step took of hits; with what the next one will take

// What contacts push fragments by, N s.
std::vector<double> pushes_of(const StepContext& context, double h, Counted counted,
                              std::span<const ActiveContact> contacts, const Movables& movables) {
    const size_t n = context.n_particles();
    std::vector<double> push(n, 0.0);
    for (const ActiveContact& c : contacts) {
        if (!c.separate_pieces) continue;
        const MovableId a = c.contact.a, b = c.contact.b;
        double impulse = c.impulse.normal / h;
        if (impulse > 0 && counted == Counted::foreseen) impulse += left_of(c, h, movables);
        if (has_movable_b(c.contact) && b < n) push[b] += impulse;
        if (a < n) push[a] += impulse;
    }
    return push;
}

bool keeps(const FrameState& state, const Activation& a, ParticleId i) {
    return (state.inactive[i].what & bit_of(a.keeps)) != 0;
}

}  // namespace

uint8_t bit_of(Keeps keeps) {
    return keeps == Keeps::held ? Inactivity::kHeld : keeps == Keeps::asleep ? Inactivity::kAsleep : Inactivity::kGlued;
}

void hold_inactive(const FrameState& state, Movables& movables) {
    for (size_t i = 0; i < state.inactive.size(); ++i) {
        if (!is_kept(state, i) || movables.role[i] == Role::held) continue;
        MovingParticle& p = movables.moving[i];
        p.d = p.d_inertial = movables.start_rotation[i];
        movables.angular_velocity[i] = Vec3::Zero();
        if (movables.role[i] == Role::free) {
            p.x = p.x_inertial = movables.start_position[i];
            movables.velocity[i] = Vec3::Zero();
        }
        if (!movables.tethers.stiffness.empty()) movables.tethers.stiffness[i] = 0;
        movables.inverse_mass[i] = 0;
        movables.role[i] = Role::held;
    }
}

bool contacts_let_go(const StepContext& context, const FrameState& state) {
    if (state.inactive.empty() || !context.wakes) return false;
    return std::ranges::any_of(context.scene.activations, [&](const Activation& a) {
        return waits_for_contact(a) &&
               std::ranges::any_of(a.particles, [&](ParticleId i) { return keeps(state, a, i); });
    });
}

bool let_go_of_pushed(const StepContext& context, double h, const LiveTopology& live,
                      std::span<const ActiveContact> contacts, const Movables& movables, FrameState& state) {
    SUNDER_ASSERT(h > 0 && state.inactive.size() == context.n_particles());
    const std::vector<double> push = pushes_of(context, h, Counted::foreseen, contacts, movables);
    bool any = false, any_glued = false;
    for (const Activation& a : context.scene.activations) {
        if (!waits_for_contact(a)) continue;
        const double least = a.until == Until::contact ? a.impulse : 0;
        for (const ParticleId i : a.particles) {
            Inactivity& own = state.inactive[i];
            if (!keeps(state, a, i) || !(push[i] > 0 && own.former_push + own.push + push[i] > least)) continue;
            let_go(own, a.keeps);
            any = true, any_glued |= a.keeps == Keeps::glued;
            if (a.keeps != Keeps::asleep) continue;
            for (const ParticleId j : live.piece_particles(live.piece(i))) let_go(state.inactive[j], Keeps::asleep);
        }
    }
    const bool any_followed = any && hand_over(context.scene, context.input, LetGo::in_step, state);
    if (any_glued || any_followed) take_up_bonds(context.scene, context.input, state);
    return any;
}

void add_pushes(const StepContext& context, double h, std::span<const ActiveContact> contacts, const Movables& movables,
                FrameState& state) {
    const std::vector<double> push = pushes_of(context, h, Counted::taken, contacts, movables);
    for (size_t i = 0; i < push.size(); ++i)
        if (state.inactive[i].what != 0) state.inactive[i].push += push[i];
}

bool let_go_beside_breaks(const Scene& scene, std::span<const BrokenEdge> broken, FrameState& state) {
    const auto waits = [](const Activation& a) { return a.until == Until::neighbour; };
    if (broken.empty() || state.inactive.empty() || std::ranges::none_of(scene.activations, waits)) return false;
    const std::vector<Edge>& edges = scene.rest.edges;
    std::vector<uint8_t> at_break(scene.rest.n_particles(), 0), hangs(state.edge_intact);
    for (const BrokenEdge& b : broken) at_break[edges[b.edge].a] = at_break[edges[b.edge].b] = hangs[b.edge] = 1;
    std::vector<uint8_t> beside = at_break;
    for (size_t e = 0; e < edges.size(); ++e) {
        if (!hangs[e]) continue;
        if (at_break[edges[e].a]) beside[edges[e].b] = 1;
        if (at_break[edges[e].b]) beside[edges[e].a] = 1;
    }
    bool any_glued = false;
    for (const Activation& a : scene.activations)
        for (const ParticleId i : a.particles) {
            if (!waits(a) || !beside[i]) continue;
            any_glued |= a.keeps == Keeps::glued && keeps(state, a, i);
            let_go(state.inactive[i], a.keeps);
        }
    return any_glued;
}

void let_go_between_steps(const Scene& scene, const FrameInput& input, std::span<const BrokenEdge> broken,
                          FrameState& state) {
    const bool any_glued = let_go_beside_breaks(scene, broken, state),
               any_followed = hand_over(scene, input, LetGo::in_step, state);
    if (any_glued || any_followed) take_up_bonds(scene, input, state);
}

void take_up_bonds(const Scene& scene, const FrameInput& input, FrameState& state) {
    state.edge_bond = edge_bonds(scene, input.seams, state);
}

}  // namespace sunder
