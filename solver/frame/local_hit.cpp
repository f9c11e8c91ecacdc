#include "solver/frame/local_hit.h"

#include <algorithm>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

// What it costs to make two scenes of one, and to do without where they meet, in substeps of all that is awake.
constexpr double kCostOfApart = 0.7;

// A step of what is awake in a scene; false where it touches something else.
Result<bool> step_of(AwakeScene& scene, const StepContext& whole, const StepTime& time, FrameState& io_state,
                     StepReport& io_report) {
    const Result<StepOutcome> outcome = scene.step(whole, time, io_state, io_report);
    if (!outcome) return outcome.error();
    return outcome->woken.empty();
}

}  // namespace

SolverSettings settings_of_parts(const SolverSettings& settings) {
    SolverSettings s = settings;
    s.hit_substeps = 1, s.iterations = 2, s.crack_passes = std::min(settings.crack_passes, 2);
    return s;
}

bool LocalHit::pays(std::span<const uint8_t> hit, int parts, const FrameState& state) {
    double n_awake = 0, n_hit = 0;
    for (size_t i = 0; i < hit.size(); ++i) {
        if (!state.asleep.empty() && state.asleep[i]) continue;
        n_awake += 1, n_hit += hit[i];
    }
    return (parts - 1) * (n_awake - n_hit) > kCostOfApart * n_awake;  // that take parts, and need not
}

Result<bool> LocalHit::advance(const StepContext& whole, std::span<const uint8_t> hit, int parts, const StepTime& time,
                               const Progress& progress, FrameState& io_state, StepPair& io_pair,
                               StepReport& io_report) {
    FrameState state = io_state;
    SUNDER_ASSERT(parts > 1 && hit.size() == state.n_particles() + state.rigid_bodies.size());
    const StepReport before = io_report;
    const auto met = [&] {  // what was measured of the time stays
        io_report.edges_broken = before.edges_broken, io_report.cracks_J = before.cracks_J;
        return Result<bool>(false);
    };
    const auto let_move = [&](bool what_is_hit) {
        state.asleep.resize(hit.size(), 0);
        for (size_t i = 0; i < hit.size(); ++i)
            if (state.asleep[i] != 1) state.asleep[i] = (hit[i] != 0) == what_is_hit ? 0 : kStandsBy;
    };
    const auto with = [&](const SolverSettings& settings) {
        return StepContext{whole.scene, whole.input, settings, whole.workers, whole.contact_margin};
    };
    bool apart = true;
    const SolverSettings fine = settings_of_parts(whole.settings);
    let_move(true);
    hit_.forget(), hit_.enter(with(fine), state);  // what stands by lies elsewhere each time
    const Status ok = in_parts(parts, time, progress, [&](const StepTime& part) -> Status {
        if (!apart) return {};
        if (part.stage != Stage::second && !state.inactive.empty())  // a pair ends as it began
            hit_.let_go_between_steps(whole, state);
        const Result<bool> alone = step_of(hit_, with(fine), part, state, io_report);
        if (!alone) return alone.error();
        apart = *alone;
        return {};
    });
    if (!ok) return ok.error();
    if (!apart) return met();
    hit_.leave(whole.workers, state);

    SolverSettings undivided = whole.settings;
    undivided.hit_substeps = 1;
    state.time = io_state.time;
    let_move(false);
    rest_.forget(), rest_.enter(with(undivided), state);
    rest_.go_on(io_pair, whole.workers);
    const Result<bool> alone = step_of(rest_, with(undivided), time, state, io_report);
    if (!alone) return alone.error();
    if (!*alone) return met();
    StepPair pair = rest_.pair(whole.workers);
    rest_.leave(whole.workers, state);
    state.asleep = std::move(io_state.asleep);
    io_state = std::move(state);
    io_pair = std::move(pair);
    return true;
}

}  // namespace sunder
