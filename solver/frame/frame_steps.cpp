#include "solver/frame/frame_steps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "solver/frame/activation.h"
#include "solver/frame/blast.h"
#include "solver/frame/error_budget.h"
#include "solver/sleep/sleeping.h"
#include "solver/step/following.h"
#include "solver/step/letting_go.h"

namespace sunder {

void FrameSteps::enter(const StepContext& whole, const FrameState& state) {
    if (anything_sleeps(state)) return awake_.enter(whole, state);
    awake_.forget();
    memory_.synchronise(whole, state);
}

// Of all that is awake. Empties where it is kept.
StepPair FrameSteps::pair(const WorkerPool& threads, const FrameState& state) {
    return anything_sleeps(state) ? awake_.pair(threads) : std::move(memory_.pair);
}

// After `enter`, between two steps of a pair.
void FrameSteps::go_on(const StepContext& whole, const FrameState& state, StepPair pair) {
    if (anything_sleeps(state))
        awake_.go_on(pair, whole.workers);
    else
        memory_.pair = std::move(pair);
}

// What does so between two steps, the first of a frame among them.
void FrameSteps::let_go(const StepContext& whole, FrameState& io_state) {
    if (io_state.inactive.empty()) return;
    if (anything_sleeps(io_state))
        awake_.let_go_between_steps(whole, io_state);
    else
        let_go_between_steps(scene_, whole.input, io_state.broken, io_state);
}

// A step of all that is awake, anew as long as it wakes something. Where a hit asks for parts the state is as before.
Result<Hit> FrameSteps::advance(const StepContext& whole, const StepTime& time, FrameState& io_state,
                                StepReport& io_report) {
    if (time.stage != Stage::second) let_go(whole, io_state);  // a pair ends as it began
    while (anything_sleeps(io_state)) {
        if (awake_.empty()) {
            awake_.state().time += time.h;
            return Hit();
        }
        Result<StepOutcome> outcome = awake_.step(whole, time, io_state, io_report);
        if (!outcome) return outcome.error();
        if (outcome->woken.empty()) return std::move(outcome->hit);
        awake_.leave(whole.workers, io_state);
        wake(scene_, whole.input, outcome->woken, io_state);
        StepPair begun = awake_.pair(whole.workers);
        enter(whole, io_state);
        go_on(whole, io_state, std::move(begun));
    }
    Result<StepOutcome> outcome = step(whole, time, memory_, io_state, io_report);
    if (!outcome) return outcome.error();
    return std::move(outcome->hit);
}

// False where all is to take the parts of the hit.
Result<bool> FrameSteps::advance_local_hit(const StepContext& whole, const Hit& hit, const StepTime& time,
                                           const Progress& progress, FrameState& io_state, StepReport& io_report) {
    if (met_ || !LocalHit::pays(hit.what, hit.parts, io_state)) return false;
    if (anything_sleeps(io_state)) awake_.leave(whole.workers, io_state);
    StepPair begun = pair(whole.workers, io_state);
    if (!local_hit_) local_hit_.emplace();
    has_local_hits_ = true;
    const Result<bool> done =
        local_hit_->advance(whole, hit.what, hit.parts, time, progress, io_state, begun, io_report);
    if (!done) return done;
    met_ = !*done;
    enter(whole, io_state);
    go_on(whole, io_state, std::move(begun));
    if (!anything_sleeps(io_state)) io_report.n_components = memory_.model.live.n_pieces();
    return done;
}

// A step in which something is hit, in parts. Whether it was the first of a pair.
Result<bool> FrameSteps::advance_hit(const StepContext& whole, const Hit& hit, const StepTime& time,
                                     const Progress& progress, FrameState& io_state, StepReport& io_report) {
    io_report.substeps += hit.parts - 1;
    const Result<bool> local = advance_local_hit(whole, hit, time, progress, io_state, io_report);
    if (!local) return local.error();
    if (*local) return time.stage == Stage::first;
    const SolverSettings settings = settings_of_parts(whole.settings);
    const StepContext context{whole.scene, whole.input, settings, whole.workers, whole.contact_margin};
    const Status ok = in_parts(hit.parts, time, progress, [&](const StepTime& part) -> Status {
        const Result<Hit> none = advance(context, part, io_state, io_report);
        if (!none) return none.error();
        return {};
    });
    if (!ok) return ok.error();
    return false;
}

// Steps and iterations that the error budget asks for. Whether the trial that told so is the frame.
bool FrameSteps::plan(const StepContext& whole, SolverSettings& io_effort, FrameState& io_state,
                      StepReport& io_report) {
    const bool reduced = anything_sleeps(io_state);
    const double duration = whole.input.duration;
    let_go(whole, io_state);  // the trial is a step
    if (reduced) awake_.cover(whole, duration, 1, io_state);
    FrameState& state = reduced ? awake_.state() : io_state;
    FramePlan plan =
        reduced ? plan_frame(awake_.context(whole), state, awake_.memory()) : plan_frame(whole, state, memory_);
    io_effort.substeps = plan.substeps, io_effort.iterations = plan.iterations;
    const bool done = plan.done && duration <= kLongestStep;
    if (done) state = std::move(*plan.done), io_report = plan.report;
    return done;
}

Result<StepReport> FrameSteps::run(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                                   const WorkerPool& threads, FrameState& io_state, const Progress& progress) {
    SolverSettings effort = settings;
    const StepContext context{scene_, input, effort, threads, margin_};
    if (settings.sleeping && !io_state.asleep.empty())
        wake_changed(scene_, input, settings.self_collision, margin_, io_state);
    else
        forget_sleep(settings.sleeping ? context.n_movables() : 0, io_state);
    if (begin_activations(scene_, input, before, io_state)) awake_.forget();
    const size_t n_cut = io_state.broken.size();
    if (Status ok = give_blasts(context, io_state); !ok) return ok.error();
    StepReport report;
    enter(context, io_state);
    if (!std::exchange(has_local_hits_, false)) local_hit_.reset();
    met_ = false;
    bool done = false;
    if (settings.error_budget > 0 && !(anything_sleeps(io_state) && awake_.empty())) {
        if (!progress.report(0, "simulating")) return cancelled();
        done = plan(context, effort, io_state, report);
    }
    effort.substeps = std::max(effort.substeps, static_cast<int>(std::ceil(input.duration / kLongestStep)));
    report.substeps = effort.substeps, report.iterations = effort.iterations;
    const double h = input.duration / effort.substeps;
    bool begun = false;  // a pair of steps
    for (int k = 0; k < effort.substeps && !done; ++k) {
        const double begin = double(k) / effort.substeps, end = double(k + 1) / effort.substeps;
        if (!progress.report(begin, "simulating")) return cancelled();
        const bool last = k + 1 == effort.substeps;
        const StepTime time{stage_of(begun, last), h, begin, end, last};
        const Result<Hit> hit = advance(context, time, io_state, report);
        if (!hit) return hit.error();
        begun = time.stage == Stage::first;
        if (hit->parts == 1) continue;
        const Result<bool> is_first = advance_hit(context, *hit, time, progress, io_state, report);
        if (!is_first) return is_first.error();
        begun = *is_first;
    }
    if (anything_sleeps(io_state)) awake_.leave(threads, io_state);
    set_followers(scene_, input, io_state);
    if (settings.sleeping) report.n_components = fall_asleep(scene_, input, settings.self_collision, before, io_state);
    io_state.edge_bond.clear();
    report.edges_broken += n_cut;
    report.asleep = static_cast<size_t>(std::ranges::count(io_state.asleep, 1));
    return report;
}

}  // namespace sunder
