#include "solver/step/breaking.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/group_energy.h"
#include "solver/scene/ring_check.h"
#include "solver/scene/scales.h"
#include "solver/scene/strength.h"
#include "solver/step/loops.h"
#include "solver/step/pushers.h"

namespace sunder {
namespace {

constexpr double kLeastRise = 1e-4;  // of damage, that is worth another rest shape
constexpr double kMuch = 0.05;       // a rise of damage that others must see before they fade on
constexpr double kMostGiven = 2.5;   // stiffness that a group gets back, over what it had
constexpr double kStressed = 0.99;   // of the tension from which on an edge fades: less stress across it tears nothing

class FadeSearch {
public:
    FadeSearch(const Pass& pass, const LiveModel& model, const Movables& movables, std::span<const GroupGoal> goals,
               const Breaking& breaking)
        : pass_(pass), model_(model), movables_(movables), goals_(goals), breaking_(breaking) {}

    std::vector<Fade> run();

private:
    const SimulationMesh& rest() const { return pass_.context.scene.rest; }
    double sound_toughness_of(EdgeId edge) const;  // without what seams and glue make of it
    StretchedEdge stretched(EdgeId edge) const;
    Fade look_at(EdgeId edge) const;
    bool leads(const Fade& fade, std::span<const double> load) const;

    const Pass& pass_;
    const LiveModel& model_;
    const Movables& movables_;
    std::span<const GroupGoal> goals_;
    const Breaking& breaking_;
};

double FadeSearch::sound_toughness_of(EdgeId e) const {
    const Edge& edge = rest().edges[e];
    return sound_toughness(rest(), pass_.context.material(edge.a), pass_.context.material(edge.b), e);
}

StretchedEdge FadeSearch::stretched(EdgeId e) const {
    const Edge& edge = rest().edges[e];
    const Vec3 apart = rest().rest_position[edge.b] - rest().rest_position[edge.a];
    const std::vector<Mat3>& F_P = pass_.state.plastic_deformation;
    return {0.5 * (F_P[edge.a] * apart + F_P[edge.b] * apart), movables_.moving[edge.b].x - movables_.moving[edge.a].x,
            goals_[edge.a].rotation, goals_[edge.b].rotation};
}

// In walls and plates what is pressed and sound stays so, unless it bends; in a solid it would bridge cracks that it is
// pressed along, as their faces lie aslant. What a seam weakens keeps its opening length, so that it absorbs less.
Fade FadeSearch::look_at(EdgeId e) const {
    const Edge& edge = rest().edges[e];
    const std::vector<double>& bond = pass_.state.edge_bond;
    const double had = pass_.state.edge_damage[e], sound = sound_toughness_of(e),
                 tau = toughness_of_edge(sound, bond.empty() ? 1 : bond[e]);
    const StretchedEdge at = stretched(e);
    const bool is_flat = rest().flat[edge.a] || rest().flat[edge.b];
    const bool bends = model_.bends(edge.a) || model_.bends(edge.b);
    if (!(tau < kNever) || (had == 0 && is_flat && !bends && at.is_pressed())) return {e, had, 0, tau};
    const Material& material = pass_.context.material(edge.a);
    const double opening = opening_length(material, sound), d0 = at.rest.norm();
    const double pull = tension(at, breaking_.stretch[edge.a], breaking_.stretch[edge.b], material.poisson_ratio,
                                kStressed * fading_tension(had, tau, opening, d0));
    const double now = damage(pull, tau, opening, d0);
    return {e, now == 1 || now > had + kLeastRise ? now : had, pull, tau};
}

// Of edges that part at once: whether it is the most loaded about it.
bool FadeSearch::leads(const Fade& fade, std::span<const double> load) const {
    for (const ParticleId g : {rest().edges[fade.edge].a, rest().edges[fade.edge].b})
        for (uint32_t s = model_.live.begin(g); s < model_.live.end(g); ++s) {
            if (model_.live.member(s) == g) continue;
            const EdgeId other = model_.live.edge(s);
            if (load[other] > load[fade.edge] || (load[other] == load[fade.edge] && other < fade.edge)) return false;
        }
    return true;
}

std::vector<Fade> FadeSearch::run() {
    if (breaking_.stretch.empty()) return {};
    const size_t n = rest().n_edges();
    std::vector<Fade> found;
    std::mutex mutex;
    pass_.context.workers.for_range(n, kGroupGrain, [&](size_t first, size_t last) {
        std::vector<Fade> own;
        for (EdgeId e(first); e < last; ++e) {
            const ParticleId a = rest().edges[e].a;
            if (!pass_.state.edge_intact[e] || pass_.slice.kept[a] || !fades(pass_.context, pass_.state, a)) continue;
            if (const Fade fade = look_at(e); fade.damage > pass_.state.edge_damage[e]) own.push_back(fade);
        }
        const std::lock_guard lock(mutex);
        found.insert(found.end(), own.begin(), own.end());
    });
    std::ranges::sort(found, {}, &Fade::edge);
    std::vector<double> load(n, 0);
    const auto parts_at_once = [&](const Fade& fade) {
        return !(pass_.context.material(rest().edges[fade.edge].a).fracture_energy > 0);
    };
    for (const Fade& fade : found)
        if (parts_at_once(fade)) load[fade.edge] = fade.tension / fade.toughness;
    std::erase_if(found, [&](const Fade& fade) { return parts_at_once(fade) && !leads(fade, load); });
    return found;
}

// What the groups of edges that fade hold, before and after.
class Books {
public:
    Books(const Pass& pass, std::span<const Fade> fades, const Movables& movables, std::span<const GroupGoal> goals,
          const LiveModel& model)
        : state_(pass.state), movables_(movables), goals_(goals), model_(model) {
        if (fades.empty()) return;
        for (const Fade& fade : fades) {
            const Edge& edge = pass.context.scene.rest.edges[fade.edge];
            groups_.push_back(edge.a), groups_.push_back(edge.b);
        }
        std::ranges::sort(groups_);
        groups_.erase(std::ranges::unique(groups_).begin(), groups_.end());
        start_ = movables.moving;
        for (size_t i = 0; i < start_.size(); ++i)
            start_[i].x = movables.start_position[i], start_[i].d = movables.start_rotation[i];
        before_ = energies();
    }

    /// Gives stiffness back; what was dissipated, J.
    double close(const StepContext& context, LiveModel& io_model, FrameState& io_state) const;

private:
    struct Energies {
        double end = 0, start = 0;  // where things are; of what may get stiffness, where the step began, J
    };
    bool may_get(ParticleId g) const { return kMostGiven / state_.stiffness_factor[g] > 1; }  // any stiffness
    std::vector<Energies> energies() const {
        std::vector<Energies> of(groups_.size());
        for (size_t i = 0; i < of.size(); ++i) {
            const GroupEnergy energy(model_, groups_[i]);
            const Quat& R = goals_[groups_[i]].rotation;
            of[i].end = energy.at(movables_.moving, R);
            if (may_get(groups_[i])) of[i].start = energy.at(start_, R);
        }
        return of;
    }

    const FrameState& state_;
    const Movables& movables_;
    std::span<const GroupGoal> goals_;
    const LiveModel& model_;
    std::vector<ParticleId> groups_;
    std::vector<MovingParticle> start_;
    std::vector<Energies> before_;  // as groups_
};

double Books::close(const StepContext& context, LiveModel& io_model, FrameState& io_state) const {
    const std::vector<Energies> after = energies();
    const auto most = [](double before, double after) { return after > 0 ? before / after : kMostGiven; };
    double dissipated = 0;
    for (size_t i = 0; i < groups_.size(); ++i) {
        const ParticleId g = groups_[i];
        double& factor = io_state.stiffness_factor[g];
        const double trace = io_model.shapes.group[g].positions_trace;
        const double lost = trace > 0 ? io_model.shapes.rest_trace[g] / trace : 1;
        double given = 1;  // over the present factor
        if (after[i].end > before_[i].end && before_[i].end > 0)
            given = before_[i].end / after[i].end;
        else if (may_get(g))
            given = std::max(1.0, std::min({kMostGiven / factor, lost / factor, most(before_[i].end, after[i].end),
                                            most(before_[i].start, after[i].start)}));
        const double taken = before_[i].end - given * after[i].end;
        invariant("what fades adds no energy", [&] { return taken >= -1e-9 * before_[i].end; });
        dissipated += taken;
        factor *= given;
        io_model.take_up_stiffness(context.scene.rest, context.material(g), factor, g);
    }
    return dissipated;
}

void weaken(const SimulationMesh& rest, const Fade& fade, LiveModel& model, Breaking& breaking, FrameState& state) {
    const Edge& edge = rest.edges[fade.edge];
    const double given = std::max(1.0, 0.5 * (state.stiffness_factor[edge.a] + state.stiffness_factor[edge.b]));
    double& hold = state.edge_hold[fade.edge];
    state.edge_damage[fade.edge] = fade.damage;
    hold = model.hold[fade.edge] = std::min(hold, (1 - fade.damage) / given);
    model.shapes.set_hold(rest, fade.edge, hold);
    breaking.flowed[edge.a] = breaking.flowed[edge.b] = 1;
}

void cut(const SimulationMesh& rest, std::span<const BrokenEdge> cuts, LiveModel& model, Breaking& breaking,
         FrameState& state) {
    std::vector<EdgeId> broken;
    for (const BrokenEdge& cut : cuts) {
        SUNDER_ASSERT(state.edge_intact[cut.edge]);
        state.edge_intact[cut.edge] = model.edges[cut.edge] = 0;
        if (!state.edge_damage.empty()) state.edge_damage[cut.edge] = 1;
        state.broken.push_back(cut);
        broken.push_back(cut.edge);
    }
    for (const ParticleId g : model.live.remove_edges(rest, broken)) breaking.flowed[g] = 1;
    invariant("rings match edges", [&] { return rings_match_edges(model.live, rest, state.edge_intact); });
}

void make_shapes_anew(const StepContext& context, LiveModel& model, Breaking& breaking, const FrameState& state) {
    const SimulationMesh& rest = context.scene.rest;
    for_groups(context, [&](size_t first, size_t last) {
        model.shapes.rebuild(rest, model.live, state.plastic_deformation, first, last,
                             [&](uint32_t g) { return breaking.flowed[g] != 0; });
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            if (!breaking.flowed[g]) continue;
            breaking.flowed[g] = 0;
            const double factor = state.stiffness_factor.empty() ? 1 : state.stiffness_factor[g];
            model.take_up_stiffness(rest, context.material(g), factor, g);
        }
    });
}

}  // namespace

bool fades(const StepContext& context, const FrameState& state, ParticleIndex particle) {
    return !state.edge_damage.empty() && context.settings.method == Method::projective &&
           context.material(particle).fracture_energy < kNever;
}

bool follows_strain(const StepContext& context, const FrameState& state, ParticleIndex particle) {
    return context.settings.error_budget > 0 || fades(context, state, particle);
}

double breaking_strain(const StepContext& context, const FrameState& state, const LiveTopology& live, ParticleIndex g) {
    const SimulationMesh& rest = context.scene.rest;
    const Material own = material_of(rest, g, context.material(g));
    const double strain = breaking_strain(rest, live, own, g, state.edge_bond);
    if (!fades(context, state, g) || !(strain < kNever)) return strain;
    // What fades bears more before it parts: as the critical load of a body goes, by the root (Griffith).
    const double sound = state.edge_bond.empty() ? strain : breaking_strain(rest, live, own, g);
    if (!(sound < kNever)) return strain;
    return strain * std::sqrt(1 + opening_length(own, sound) / math::cbrt(rest.volume[g]));
}

Breaks find_breaks(const Pass& pass, double leading, const Movables& movables, std::span<const GroupGoal> goals,
                   const LiveModel& model, const Breaking& breaking) {
    const StepContext& context = pass.context;
    const SimulationMesh& rest = context.scene.rest;
    Breaks found;
    found.cuts = edges_to_cut({rest, model.live, model.shapes, movables.moving, pass.state.edge_bond}, breaking.strains,
                              leading, pass.state.time + pass.time.h, context.workers);
    found.fading = FadeSearch(pass, model, movables, goals, breaking).run();
    // What a group is crushed by does not fade as well.
    const auto is_cut = [&](const Fade& fade) {
        return std::ranges::binary_search(found.cuts, fade.edge, {}, &BrokenEdge::edge);
    };
    std::erase_if(found.fading, is_cut);
    for (const BrokenEdge& cut : found.cuts) found.weakened.push_back(rest.edges[cut.edge].a);
    for (const Fade& fade : found.fading)
        if (fade.damage == 1 || fade.damage - pass.state.edge_damage[fade.edge] > kMuch)
            found.weakened.push_back(rest.edges[fade.edge].a);
    std::ranges::sort(found.weakened);
    return found;
}

Broken break_edges(const Pass& pass, Breaks breaks, const Movables& movables, std::span<const GroupGoal> goals,
                   std::span<const ActiveContact> contacts, LiveModel& model, Breaking& breaking, FrameState& state) {
    const StepContext& context = pass.context;
    const SimulationMesh& rest = context.scene.rest;
    const Books books(pass, breaks.fading, movables, goals, model);
    for (const Fade& fade : breaks.fading) {
        weaken(rest, fade, model, breaking, state);
        if (fade.damage == 1)
            breaks.cuts.push_back({fade.edge, state.time + pass.time.h, fade.tension, fade.toughness, {}});
    }
    std::ranges::sort(breaks.cuts, {}, &BrokenEdge::edge);
    name_pushers(rest, model.live, contacts, breaks.cuts);
    cut(rest, breaks.cuts, model, breaking, state);
    make_shapes_anew(context, model, breaking, state);
    Broken broken{.n_cuts = breaks.cuts.size()};
    if (breaks.fading.empty()) return broken;
    model.take_up_bending(rest, state, context.workers);
    broken.dissipated = books.close(context, model, state);
    return broken;
}

}  // namespace sunder
