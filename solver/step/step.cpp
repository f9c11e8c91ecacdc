#include "solver/step/step.h"

#include <algorithm>
#include <utility>

#include "solver/data/invariant.h"
#include "solver/pieces/piece_motion.h"
#include "solver/scene/ring_check.h"
#include "solver/step/books.h"
#include "solver/step/flow.h"
#include "solver/step/letting_go.h"
#include "solver/step/loops.h"
#include "solver/step/match.h"
#include "solver/step/predict.h"
#include "solver/step/stopwatch.h"

namespace sunder {
namespace {

constexpr int kCracksInStep = 8;  // a step, each after the last one's cuts let go
constexpr double kLeading = 0.8;  // what cuts in a crack is within a fifth of the piece's largest excess load

/// A step as it is taken: its stages in the order of `step`.
class Stepper {
public:
    Stepper(const StepContext& context, const StepTime& time, StepMemory& io_memory, FrameState& io_state,
            StepReport& io_report)
        : context_(context), time_(time), m_(io_memory), state_(io_state), report_(io_report) {}

    Result<StepOutcome> run();

private:
    Pass pass() const { return {context_, time_, state_, m_.slice, has_flowed_ ? 0 : time_.h}; }
    StepOutcome begin_pass(bool is_first);
    bool lets_go(const StepPair& begun);
    std::vector<Woken> find();
    void match();
    std::vector<ParticleId> flow_and_break(double leading);
    void run_cracks();
    bool break_in_hit();
    Status close_books(bool may_break);
    void begin_anew(const StepPair& begun);

    const StepContext& context_;
    const StepTime& time_;
    StepMemory& m_;
    FrameState& state_;
    StepReport& report_;
    bool has_flowed_ = false;  // as material does once a step
    bool may_divide_ = false;  // where an edge breaks, so far
    Hit crack_;                // parts that what breaks asks for
};

Result<StepOutcome> Stepper::run() {
    m_.slice.open(context_.n_movables());
    bool may_break = false;  // what contacts push, when the books are closed
    const bool may_let_go = contacts_let_go(context_, state_);
    may_divide_ = divides_hits(context_.settings) && !state_.edge_damage.empty();
    const StepPair pair = may_let_go || may_divide_ ? m_.pair : StepPair();
    for (int n = 1;; ++n) {
        StepOutcome begun = begin_pass(n == 1);
        if (!begun.is_taken()) return begun;
        pair_up(context_, time_, m_.model, m_.slice.kept, state_, m_.pieces, m_.pair, m_.movables);
        match();
        if (n == 1 && may_let_go && lets_go(pair)) {
            n = 0;
            continue;
        }
        tumble_pieces(context_, time_.h, m_.model, m_.slice.kept, m_.pieces, m_.matching.goals, m_.movables);
        run_cracks();
        may_break = m_.problem.pushes_anything();
        if (may_break && n < context_.settings.crack_passes)
            may_break = break_in_hit();
        else
            break;
        if (crack_.parts > 1 || !may_break) break;
    }
    if (crack_.parts > 1) {
        begin_anew(pair);
        return StepOutcome{{}, std::move(crack_)};
    }
    may_divide_ = false;  // what breaks as the books are closed breaks in this step
    if (Status ok = close_books(may_break); !ok) return ok.error();
    report_.n_components = m_.model.live.n_pieces();
    return StepOutcome();
}

// What contacts let go of what is kept, as where they push it; all of the step is then taken again.
bool Stepper::lets_go(const StepPair& begun) {
    if (!let_go_of_pushed(context_, time_.h, m_.model.live, m_.problem.contacts, m_.movables, state_)) return false;
    begin_anew(begun);
    return true;
}

// As nothing of the step is in the state yet, but what contacts let go.
void Stepper::begin_anew(const StepPair& begun) {
    m_.pair = begun;
    for_all(context_, context_.n_particles(),
            [&](size_t g) { m_.matching.goals[g].rotation = state_.group_rotation[g]; });
}

// Where things are, what holds them, where inertia takes them, and what they touch. Of the first pass: unless it is
// felt by what sleeps, or hits.
StepOutcome Stepper::begin_pass(bool is_first) {
    do {
        if (m_.slice.is_again) begin_again(m_.problem, m_.pieces, m_.slice);
        {
            Stopwatch watch(report_.predict_s);
            load(context_, time_, state_, m_.model.shapes, m_.slice.kept, m_.movables);
            hold(context_, time_, state_, m_.pair, m_.model, m_.movables);
            mark_held_pieces(context_, m_.model.live, m_.movables, m_.pieces);
            leave_alone(pass(), m_.movables, m_.matching);
            leave_pieces_alone(pass(), m_.model.live, m_.pieces, m_.matching);
        }
        if (std::vector<Woken> woken = find(); !woken.empty()) return {std::move(woken), {}};
        if (!is_first) continue;
        Hit hit = find_hits(pass(), m_.model, m_.problem, m_.movables, m_.pieces);
        if (hit.parts > 1) return {{}, std::move(hit)};
    } while (m_.slice.is_again && let_go_of_mixed_islands(m_.model.live, m_.problem.islands, m_.slice));
    report_.simulated += static_cast<size_t>(std::ranges::count(m_.slice.kept, 0));
    return {};
}

std::vector<Woken> Stepper::find() {
    Stopwatch watch(report_.contact_s);
    std::vector<ActiveContact>& contacts = m_.problem.contacts;
    std::vector<Woken> woken =
        find_contacts(context_, time_, m_.model.live, state_, m_.movables, !m_.slice.is_again, m_.detection, contacts);
    if (!woken.empty()) return woken;
    report_.contacts = std::max(report_.contacts, contacts.size());
    predict(context_, time_, m_.model, m_.slice.kept, contacts, m_.pair, m_.movables);
    take_up_contacts(context_, time_.h, m_.model.live, m_.pair.smooth, m_.slice, m_.movables, m_.problem, m_.pieces);
    start_contacts(context_, time_.h, state_, m_.slice, bodies_of(m_.movables, m_.pieces), contacts);
    return {};
}

void Stepper::match() {
    correct(pass(), m_.pair.smooth, m_.model, m_.problem, m_.matching, m_.movables, m_.pieces, report_);
}

// An end of each edge that was cut or faded much: where there is one, what was released is to be seen before anything
// else breaks.
std::vector<ParticleId> Stepper::flow_and_break(double leading) {
    Stopwatch watch(report_.fracture_s);
    if (may_divide_) m_.before_flow.keep(state_);
    const Found found = flow_and_measure(pass(), m_.model, m_.movables, m_.breaking, m_.matching.goals, state_);
    has_flowed_ = true;
    if (!found.changed && !found.overloaded && m_.breaking.stretch.empty()) return {};
    Breaks breaks = find_breaks(pass(), leading, m_.movables, m_.matching.goals, m_.model, m_.breaking);
    std::vector<ParticleId> weakened = std::move(breaks.weakened);
    if (!weakened.empty() && std::exchange(may_divide_, false)) {
        crack_ = find_cracks(pass(), m_.model, m_.problem, m_.movables, m_.pieces, weakened);
        if (crack_.parts > 1) {
            m_.before_flow.give_back(state_);
            std::ranges::fill(m_.breaking.flowed, 0);
            return {};
        }
    }
    const Broken broken = break_edges(pass(), std::move(breaks), m_.movables, m_.matching.goals, m_.problem.contacts,
                                      m_.model, m_.breaking, state_);
    report_.edges_broken += broken.n_cuts;
    report_.cracks_J += broken.dissipated;
    if (broken.n_cuts == 0) return weakened;
    mark_held_pieces(context_, m_.model.live, m_.movables, m_.pieces);
    leave_pieces_alone(pass(), m_.model.live, m_.pieces, m_.matching);
    m_.detection.edges_broke();
    return weakened;
}

// Cuts and starts the correction over until nothing breaks: a crack runs as far as the load that it releases lets it,
// and not one ring a step. Only while nothing pushes: what contacts did was divided by the pieces as they were (see
// `break_in_hit`), and what parts along a crack may push, too.
void Stepper::run_cracks() {
    for (int n = 0; n < kCracksInStep && !m_.problem.pushes_anything(); ++n) {
        if (flow_and_break(kLeading).empty()) return;
        take_up_contacts(context_, time_.h, m_.model.live, m_.pair.smooth, m_.slice, m_.movables, m_.problem,
                         m_.pieces);
        take_up_smooth_momentum(context_, time_, m_.model, m_.movables, m_.pair, m_.pieces);
        for (size_t i = 0; i < context_.n_particles(); ++i) {
            if (m_.slice.kept[i]) continue;
            MovingParticle& p = m_.movables.moving[i];
            p.x = p.x_inertial, p.d = p.d_inertial;
        }
        match();
    }
}

// Where things push: cuts what is to break, and says whether the step is to be taken again, by what hangs together with
// the cuts through edges or contacts as they were. So a hit breaks as much with few steps as with many, where it broke
// one ring a step; what contacts did to the pieces as they were is forgotten, as fragments that come loose must not
// keep a push that carried a whole body. What breaks in the last pass is cut when the momentum books are closed, and
// let go in the next step.
bool Stepper::break_in_hit() {
    const std::vector<ParticleId> weakened = flow_and_break(0);
    if (weakened.empty()) return false;
    keep_what_is_whole(context_, weakened, m_.problem.islands, m_.pieces, m_.slice);
    return m_.slice.is_again = true;
}

// Velocities, momentum, and what contacts leave of them; and cuts what a hit broke in the last pass.
Status Stepper::close_books(bool may_break) {
    const LiveTopology& live = m_.model.live;
    {
        Stopwatch watch(report_.momentum_s);
        turn_rigid_things(context_, time_.h, live, m_.pieces, m_.movables);
        if (Status ok = take_up_motion(context_, m_.model.shapes, m_.pieces, m_.movables, state_); !ok) return ok;
        damp_vibrations(context_, time_, state_, m_.pieces, m_.pair, m_.model, m_.matching, m_.movables);
        restore_momentum(context_, time_.h, m_.model, state_, m_.pieces, m_.movables);
    }
    {
        Stopwatch watch(report_.contact_s);
        if (!state_.inactive.empty() && context_.wakes)
            add_pushes(context_, time_.h, m_.problem.contacts, m_.movables, state_);
        settle_contacts(context_, time_.h, live, m_.problem, m_.pieces, m_.movables, state_);
        keep_rigid_motion(context_, time_.h, m_.model, m_.slice.kept, m_.pair.smooth, state_.position, m_.movables);
    }
    if (may_break) flow_and_break(0);
    return store(context_, time_, m_.matching.goals, m_.pieces, m_.pair, m_.movables, state_);
}

}  // namespace

void StepMemory::fit(const StepContext& context) {
    const size_t n = context.n_particles(), n_movables = context.n_movables();
    movables.resize(n, n_movables);
    problem.brace.assign(n_movables, 0.0);
    matching.goals.resize(n);
    breaking.strains.assign(n, GroupStrain()), breaking.flowed.assign(n, 0);
}

void StepMemory::take_up_frame(const StepContext& context, const FrameState& state) {
    pair.smooth.assign(context.n_movables(), 0);
    for_all(context, context.n_particles(), [&](size_t g) { matching.goals[g].rotation = state.group_rotation[g]; });
    model.take_up_materials(context.scene.rest, context.input.materials, state,
                            context.settings.method == Method::projective, context.workers);
}

void StepMemory::renumber(const StepContext& context, const FrameState& state, std::span<const ParticleId> former) {
    detection.renumber(model.renumber(context.scene.rest, state, former, context.workers));
    fit(context);
    take_up_frame(context, state);
}

void StepMemory::synchronise(const StepContext& context, const FrameState& state) {
    SUNDER_ASSERT(state.rigid_bodies.size() == context.scene.rigid_bodies.size());
    const bool is_new = model.synchronise(context.scene.rest, state, context.workers);
    if (is_new || movables.size() != context.n_movables()) detection.reset(), fit(context);
    take_up_frame(context, state);
    invariant("rings match edges",
              [&] { return rings_match_edges(model.live, context.scene.rest, state.edge_intact); });
}

Result<StepOutcome> step(const StepContext& context, const StepTime& time, StepMemory& io_memory, FrameState& io_state,
                         StepReport& io_report) {
    SUNDER_ASSERT(time.h > 0 && time.begin >= 0 && time.begin < time.end && time.end <= 1);
    SUNDER_ASSERT(io_state.n_particles() == context.n_particles() &&
                  io_state.rigid_bodies.size() == context.scene.rigid_bodies.size() &&
                  io_memory.movables.size() == context.n_movables());
    SUNDER_ASSERT(context.fixed.empty() || context.fixed.size() == context.n_movables());
    SUNDER_ASSERT(context.input.materials.size() == context.scene.bodies.size() + context.scene.region_bodies.size());
    return Stepper(context, time, io_memory, io_state, io_report).run();
}

}  // namespace sunder
