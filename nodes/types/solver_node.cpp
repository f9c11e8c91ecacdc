// solver: moves all bodies together; any frame may be asked for.
#include <array>
#include <iterator>
#include <limits>
#include <map>

#include "nodes/files/frame_number.h"
#include "nodes/graph/field_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/solver_scene.h"
#include "nodes/types/state_between.h"
#include "nodes/types/state_cache.h"
#include "nodes/types/time_scale.h"
#include "solver/presets.h"
#include "solver/scene/scene_fields.h"
#include "solver/solver.h"

namespace sunder {
namespace {

constexpr int kFarthestSimulatedFrame = 1'000'000;

/// What the node keeps. A frame's history is the key of all that led to it: the scene, the materials it started with
/// and what drove each step. A kept frame holds as long as its history is what the inputs say now; so an edit that
/// starts to matter at frame 50 leaves frames 1 to 49 as they are.
struct SolverStore {
    ContentKey scene_key = 0;
    std::shared_ptr<const WorkerPool> workers;  // the solver's
    std::shared_ptr<Solver> solver;
    std::vector<ContentKey> body_keys;
    std::vector<std::shared_ptr<const VertexMotion>> motions;  // of bodies that follow a mesh, as last asked for
    StateCache frames;
    std::vector<std::string> told;    // of how the start settled
    std::vector<std::string> missed;  // of blasts that never go off
    std::vector<std::string> told_of_scene;

    ContentKey node_key = 0;          // of the node when `history` was last looked at
    std::vector<ContentKey> history;  // of frame start + i

    // Where time is scaled: the grid points that the latest frame lay between, whatever the cache does.
    int cell = 0;
    std::array<StateCache::Entry, 2> ends;
    struct GridPoint {
        StepReport report;  // of the step that ended here
        double time = 0;    // s
        std::vector<BrokenEdge> broken;
    };
    std::map<int, GridPoint> points;  // that were reached, whatever the cache does
};

// What a method other than projective leaves out of a scene.
std::vector<std::string> left_out(const Scene& scene, std::span<const Material> materials, const std::string& method) {
    std::vector<std::string> told;
    if (method == "projective") return told;
    for (size_t b = 0; b < scene.bodies.size(); ++b) {
        size_t n = 0;
        for (uint32_t g = scene.bodies[b].particle_begin; g < scene.bodies[b].particle_end; ++g)
            n += bending_kind(scene.rest.thin[g], materials[b]) != 0;
        if (n > 0)
            told.push_back(
                "body '" + scene.bodies[b].name + "': " + std::to_string(n) +
                " fragments of sheets, rods or slender bodies are as stiff as blocks and spring back, for method " +
                method + " knows no bending (take projective)");
        if (materials[b].fracture_energy < kNever)
            told.push_back("body '" + scene.bodies[b].name + "' breaks as with fracture_energy null, for method " +
                           method + " knows no edges that fade (take projective)");
    }
    for (const Pin& pin : scene.pins)
        if (pin.turns_freely)
            told.push_back("pin '" + pin.name + "' holds the pose, for method " + method +
                           " knows no hinges (take projective)");
    return told;
}

// Where an edge is: "body 'wall', between fragments 12 and 40".
std::string place_of(const Scene& scene, EdgeId edge) {
    const Edge& at = scene.rest.edges[edge];
    const uint32_t a = at.a, b = at.b;
    const Body& body = scene.bodies[scene.rest.body[a]];
    return "body '" + body.name + "', between fragments " + std::to_string(a - body.particle_begin) + " and " +
           std::to_string(b - body.particle_begin);
}

// What an artist has to know of how things settled.
std::vector<std::string> told_of(const Settled& settled, const Scene& scene) {
    std::vector<std::string> told;
    const size_t n = scene.rest.n_particles(), moves = settled.moves.value;
    if (!settled.at_rest)
        told.push_back("settling ended before all was at rest: " +
                       (moves < n ? "body '" + scene.bodies[scene.rest.body[moves]].name + "'"
                                  : "rigid body '" + scene.rigid_bodies[moves - n].name + "'") +
                       " still moves (what rolls or falls far does not settle)");
    if (!settled.breaking.empty())
        told.push_back(std::to_string(settled.breaking.size()) +
                       " edges break under the weight that they settled to, " + "the first in " +
                       place_of(scene, settled.breaking.front().edge) + " (raise toughness)");
    if (!settled.weakening.empty())
        told.push_back(std::to_string(settled.weakening.size()) +
                       " edges begin to tear under the weight that they settled to, the first in " +
                       place_of(scene, settled.weakening.front()) + " (raise toughness)");
    return told;
}

// What happened in one step and in the next.
StepReport both(const StepReport& first, const StepReport& then) {
    StepReport sum = then;
    sum.edges_broken += first.edges_broken, sum.contacts += first.contacts;
    sum.substeps += first.substeps, sum.iterations += first.iterations, sum.simulated += first.simulated;
    sum.cracks_J += first.cracks_J;
    sum.predict_s += first.predict_s, sum.shape_s += first.shape_s, sum.contact_s += first.contact_s;
    sum.momentum_s += first.momentum_s, sum.fracture_s += first.fracture_s;
    return sum;
}

/// The solver node at work on one request. What it calls frames, but for that asked for, are grid points of simulated
/// time: the frames of the output where time is not scaled.
class SolverCook {
public:
    explicit SolverCook(CookContext& context) : context_(context), store_(context.store().get<SolverStore>()) {}

    /// The solver and its scene, made again only if the scene changed.
    Status prepare() {
        const std::shared_ptr<const WorkerPool> workers = context_.workers();
        if (store_.node_key == context_.key() && store_.solver && store_.workers == workers) return {};
        Result<SceneInput> input = scene_input(context_);
        if (!input) return input.error();
        Result<std::vector<std::string>> missed = missed_blasts(context_);
        if (!missed) return missed.error();
        store_.missed = missed.take();
        if (!store_.solver || store_.scene_key != input->key || store_.workers != workers) {
            Result<std::unique_ptr<Solver>> solver = Solver::create(std::move(input->scene), workers);
            if (!solver) return solver.error();
            if (store_.scene_key != input->key) store_.frames.clear();
            store_.solver = solver.take();
            store_.scene_key = input->key;
            store_.workers = workers;
            store_.body_keys = std::move(input->body_keys);
            store_.told_of_scene = std::move(input->warnings);
        }
        store_.motions = std::move(input->motions);
        store_.node_key = context_.key();
        store_.history.clear();
        return {};
    }

    Result<ContentKey> history(int frame) {
        const int start = context_.start_frame();
        while (store_.history.size() <= static_cast<size_t>(frame - start)) {
            const int next = start + static_cast<int>(store_.history.size());
            KeyHasher hasher;
            if (next == start) {
                Result<std::vector<Material>> materials = start_materials();
                if (!materials) return materials.error();
                hasher.add(store_.scene_key).add(start).add(key_of(*materials));
                if (anything_settles(store_.solver->scene())) {
                    Result<FrameInput> input = frame_input(context_, start);
                    if (!input) return input.error();
                    hasher.add(key_of(*input, settings_of(context_.parameters())));
                }
            } else {
                Result<FrameInput> input = frame_input(context_, next);
                if (!input) return input.error();
                hasher.add(store_.history.back()).add(key_of(*input, settings_of(context_.parameters())));
            }
            store_.history.push_back(hasher.key());
        }
        return store_.history[static_cast<size_t>(frame - start)];
    }

    /// The latest frame up to `frame` that is kept and still holds; the start, made if need be, in the end.
    Result<int> latest(int frame) {
        const int start = context_.start_frame();
        for (int kept; store_.frames.latest(frame, kept) && kept >= start;) {
            Result<ContentKey> wanted = history(kept);
            if (!wanted) return wanted.error();
            if (store_.frames.at(kept)->history == *wanted) return kept;
            store_.frames.erase(kept);
        }
        Result<std::vector<Material>> materials = start_materials();
        if (!materials) return materials.error();
        Result<ContentKey> wanted = history(start);
        if (!wanted) return wanted.error();
        FrameState state = store_.solver->initial_state(*materials);
        if (Status ok = settle(state); !ok) return ok.error();
        put(start, *wanted, std::move(state), {});
        return start;
    }

    // The start, of what settles before it.
    Status settle(FrameState& io_state) {
        store_.told.clear();
        if (!anything_settles(store_.solver->scene())) return {};
        Result<FrameInput> input = frame_input(context_, context_.start_frame());
        if (!input) return input.error();
        const Result<Settled> settled =
            store_.solver->settle(*input, settings_of(context_.parameters()), io_state, context_.progress());
        if (!settled) return in_frame(context_.start_frame(), settled.error());
        store_.told = told_of(*settled, store_.solver->scene());
        return {};
    }

    Status advance_to(int from, int frame, const Progress& progress) {
        const SolverSettings settings = settings_of(context_.parameters());
        if (Status ok = settings.check("node '" + context_.node() + "'"); !ok) return ok;
        for (int next = from + 1; next <= frame; ++next) {
            const double n = frame - from, done = next - 1 - from;
            const std::string name = "frame " + std::to_string(next);
            const Progress part = progress.part(done / n, (done + 1) / n);
            if (!part.report(0, "simulating " + name)) return cancelled();
            Result<FrameInput> input = frame_input(context_, next);
            if (!input) return input.error();
            Result<ContentKey> key = history(next);
            if (!key) return key.error();
            const std::shared_ptr<const FrameState> before = store_.frames.at(next - 1)->state;
            FrameState state;
            Result<StepReport> report = store_.solver->advance(*input, settings, *before, state, part);
            if (!report) return in_frame(next, report.error());
            put(next, *key, std::move(state), *report);
        }
        return {};
    }

    /// From a state that was simulated elsewhere: what was simulated of later frames did not begin there.
    void begin_at(int frame, ContentKey history, FrameState state) {
        store_.points[frame] = {{}, state.time, state.broken};
        store_.ends = {};
        store_.frames.give(frame, {history, std::make_shared<const FrameState>(std::move(state)), {}},
                           context_.cache_limit());
    }

    void put(int frame, ContentKey history, FrameState state, const StepReport& report) {
        store_.points[frame] = {report, state.time, state.broken};
        store_.frames.put(frame, {history, std::make_shared<const FrameState>(std::move(state)), report},
                          context_.cache_limit());
    }

    /// Simulated, unless it is kept.
    Result<StateCache::Entry> reach(int frame, const Progress& progress) {
        Result<int> from = latest(frame);
        if (!from) return from.error();
        if (Status ok = advance_to(*from, frame, progress); !ok) return ok.error();
        return *store_.frames.at(frame);
    }

    /// The states at a grid point and at the next.
    Result<std::array<StateCache::Entry, 2>> ends_of(int cell) {
        Result<ContentKey> begin = history(cell);
        if (!begin) return begin.error();
        Result<ContentKey> end = history(cell + 1);
        if (!end) return end.error();
        if (store_.cell == cell && store_.ends[0].state && store_.ends[0].history == *begin &&
            store_.ends[1].history == *end)
            return store_.ends;
        store_.ends = {};
        Result<StateCache::Entry> from = reach(cell, context_.progress().part(0, 0.5));
        if (!from) return from.error();
        Result<StateCache::Entry> to = reach(cell + 1, context_.progress().part(0.5, 1));
        if (!to) return to.error();
        store_.cell = cell;
        store_.ends = {from.take(), to.take()};
        return store_.ends;
    }

    /// Where a frame of the output lies.
    Result<SceneTime> time_of(double frame) {
        const int start = context_.start_frame();
        const double passed = context_.integral("time_scale", start, frame);
        if (start + passed > kFarthestSimulatedFrame)
            return context_.error("time_scale", "frame " + frame_text(frame) + " lies beyond simulated frame " +
                                                    std::to_string(kFarthestSimulatedFrame));
        return scene_time(start, passed, context_.parameters(frame).number("time_scale"));
    }

    /// Of the frame that is asked for, or the start: before it all is as there.
    Result<Value> value() {
        const double start = context_.start_frame(), frame = std::max(context_.frame(), start);
        const Result<SceneTime> at = time_of(frame), before = time_of(std::max(frame - 1, start));
        if (!at) return at.error();
        if (!before) return before.error();
        StateValue value;
        value.frame = frame;
        value.at = *at;
        is_scaled_ = at->frame != frame;
        value.scene = std::shared_ptr<const Scene>(store_.solver, &store_.solver->scene());
        if (at->is_on_grid()) {
            Result<StateCache::Entry> entry = reach(at->grid(), context_.progress());
            if (!entry) return entry.error();
            value.state = value.kept = entry->state;
        } else {
            const auto ends = ends_of(at->grid());
            if (!ends) return ends.error();
            value.kept = (*ends)[0].state;
            const auto carried = carried_at(context_, *value.scene, *(*ends)[1].state, *at);
            if (!carried) return carried.error();
            value.state = std::make_shared<const FrameState>(
                state_between(value.scene->rest, *value.kept, *(*ends)[1].state, at->share(), *carried));
        }
        if (context_.parameters(frame).boolean("accelerations"))
            if (Status ok = add_motion(value); !ok) return ok.error();
        for (int k = frame == start ? at->grid() : before->grid() + 1; k <= at->grid(); ++k)
            value.report = both(value.report, store_.points[k].report);
        value.broken = frame == start ? value.state->broken : broken_since(*before, value);
        Result<std::vector<Material>> materials = start_materials();
        if (!materials) return materials.error();
        auto bodies = context_.inputs_as<BodyValue>("bodies", at->is_on_grid() ? at->grid() : at->grid() + 1);
        if (!bodies) return bodies.error();
        value.body_keys = store_.body_keys, value.motions = store_.motions, value.bodies = bodies.take();
        value.warnings = left_out(*value.scene, *materials, context_.parameters().text("method"));
        std::ranges::copy(store_.told_of_scene, std::back_inserter(value.warnings));
        std::ranges::copy(store_.missed, std::back_inserter(value.warnings));
        std::ranges::copy(store_.told, std::back_inserter(value.warnings));
        return make_value(std::move(value));
    }

    /// In the order of steps; once each, however many frames show a step, or none.
    std::vector<BrokenEdge> broken_since(const SceneTime& before, const StateValue& value) const {
        double seen = -std::numeric_limits<double>::infinity();  // s; of the cell that `before` lies in
        const auto begin = store_.points.find(before.grid()), end = store_.points.find(before.grid() + 1);
        if (!before.is_on_grid() && begin != store_.points.end() && end != store_.points.end())
            seen = time_between(begin->second.time, end->second.time, before.share());
        std::vector<BrokenEdge> all;
        const auto add = [&](const std::vector<BrokenEdge>& some) {
            std::ranges::copy_if(some, std::back_inserter(all), [&](const BrokenEdge& b) { return b.time > seen; });
        };
        for (int k = before.grid() + 1; k <= value.at.grid(); ++k)
            if (const auto point = store_.points.find(k); point != store_.points.end()) add(point->second.broken);
        if (!value.at.is_on_grid() && value.at.frame > before.frame) add(value.state->broken);
        return all;
    }

    /// From the frame on, as what is blended moves: the next grid point is reached for it.
    Status add_motion(StateValue& io_value) {
        const auto ends = ends_of(io_value.at.grid());
        if (!ends) return ends.error();
        const auto carried = carried_at(context_, *io_value.scene, *(*ends)[1].state, io_value.at);
        if (!carried) return carried.error();
        io_value.pieces = std::make_shared<const std::vector<PieceMotion>>(
            piece_motions(io_value.scene->rest, *(*ends)[0].state, *(*ends)[1].state, *io_value.state, *carried));
        io_value.scale_rate = context_.slope("time_scale", io_value.frame) / context_.seconds(1);
        return {};
    }

    Status check_state(const FrameState& state) const { return store_.solver->check_state(state); }

private:
    Error in_frame(int frame, Error error) const {
        if (error.code != ErrorCode::cancelled)
            error.where = "node '" + context_.node() + (is_scaled_ ? "', simulated frame " : "', frame ") +
                          std::to_string(frame) + (error.where.empty() ? "" : ": " + error.where);
        return error;
    }

    Result<std::vector<Material>> start_materials() {
        const auto bodies = context_.inputs_as<BodyValue>("bodies", context_.start_frame());
        if (!bodies) return bodies.error();
        return materials_of(*bodies);
    }

    CookContext& context_;
    SolverStore& store_;
    bool is_scaled_ = false;  // the frame that is asked for is another simulated frame
};

Result<Value> cook_solver(CookContext& context) {
    SolverCook solver(context);
    if (Status ok = solver.prepare(); !ok) return ok.error();
    return solver.value();
}

Status seed(CookContext& context, int frame, FrameState state) {
    if (frame < context.start_frame())
        return context.error("", "a saved state of frame " + std::to_string(frame) + " lies before the first frame");
    SolverCook solver(context);
    if (Status ok = solver.prepare(); !ok) return ok;
    if (Status ok = solver.check_state(state); !ok) return ok;
    Result<ContentKey> history = solver.history(frame);
    if (!history) return history.error();
    solver.begin_at(frame, *history, std::move(state));
    return {};
}

std::vector<SocketDescription> inputs() {
    return {{.name = "bodies",
             .label = "Bodies",
             .type = SocketType::body,
             .many = true,
             .sentence = "What may dent and tear"},
            {.name = "rigid_bodies",
             .label = "Rigid Bodies",
             .type = SocketType::rigid_body,
             .many = true,
             .required = false,
             .sentence = "What pushes and is pushed"},
            {.name = "colliders",
             .label = "Colliders",
             .type = SocketType::collider,
             .many = true,
             .required = false,
             .sentence = "What all else collides with"},
            {.name = "pins",
             .label = "Pins",
             .type = SocketType::pin,
             .many = true,
             .required = false,
             .sentence = "What holds and moves parts of the bodies"},
            {.name = "forces",
             .label = "Forces",
             .type = SocketType::force,
             .many = true,
             .required = false,
             .sentence = "Acceleration fields and winds, added up"}};
}

std::vector<JsonValue> preset_names() {
    std::vector<JsonValue> names;
    for (const Preset& preset : kPresets) names.emplace_back(std::string(preset.name));
    return names;
}

// "preview: 4 substeps of 1, hits in up to 16 parts, ..."
std::string preset_texts() {
    std::string text;
    for (const Preset& preset : kPresets)
        text += (text.empty() ? "" : ", ") + std::string(preset.name) + ": " + std::to_string(preset.substeps) +
                " substeps of " + std::to_string(preset.iterations) + ", hits in up to " +
                std::to_string(preset.hit_substeps) + " parts";
    return text;
}

bool is_of_preset(std::string_view name) {
    return name == "substeps" || name == "iterations" || name == "hit_substeps";
}

// The method, and what is no field of the settings, among these.
std::vector<ParameterDescription> parameters() {
    std::vector<ParameterDescription> all = {
        {.name = "method",
         .label = "Method",
         .type = ParameterType::choice,
         .default_value = "projective",
         .sentence = "projective: stiffness in Pa, however stiff; jacobi: the same by cheap sweeps that leave "
                     "stiff bodies too soft; "
                     "gauss_seidel: the paper's, for comparison, with the bodies' `stiffness` as a share per sweep",
         .choices = {"projective", "jacobi", "gauss_seidel"}},
        {.name = "preset",
         .label = "Preset",
         .type = ParameterType::choice,
         .default_value = "default",
         .sentence = "Speed against accuracy, as docs/images/chart.svg shows it: " + preset_texts() +
                     "; what substeps, iterations or hit_substeps say goes before",
         .choices = preset_names(),
         .needs = {{is("substeps", {nullptr}), is("error_budget", {0.0})},
                   {is("iterations", {nullptr}), is("error_budget", {0.0})},
                   {is("hit_substeps", {nullptr}), is("method", {"projective"})}}}};
    for (const Field<SolverSettings>& field : settings_fields()) {
        const std::string_view name = field.description.name;
        ParameterDescription parameter = parameter_of(field);
        if (is_of_preset(name)) parameter.default_value = nullptr, parameter.nullable = true;
        all.push_back(std::move(parameter));
        if (name == "over_relaxation")
            all.push_back({.name = "gravity",
                           .label = "Gravity",
                           .type = ParameterType::vector3,
                           .unit = "m/s2",
                           .min = -1e6,
                           .max = 1e6,
                           .default_value = {0.0, 0.0, -9.81},
                           .sentence = "Acceleration of all that may move",
                           .animatable = true});
    }
    all.push_back(time_scale_parameter());
    all.push_back(accelerations_parameter());
    for (const char* name : {"substeps", "iterations"}) at(all, name).needs = {{is("error_budget", {0.0})}};
    at(all, "hit_substeps").needs = {{is("method", {"projective"})}};
    at(all, "over_relaxation").needs = {{is("method", {"jacobi"})}};
    gather(all, "Steps", {"iterations", "hit_substeps", "crack_passes", "over_relaxation"});
    gather(all, "Contact and Rest", {"damping", "depenetration_speed", "self_collision", "sleeping"});
    gather(all, "Time", {"time_scale", "accelerations"});
    return all;
}

}  // namespace

NodeType solver_node() {
    NodeDescription d{
        .type = "solver",
        .label = "Solver",
        .category = "simulation",
        .sentence =
            "Moves all bodies together, dents and tears them. Frames that were simulated are kept, and a frame is "
            "reached from the last one before it that still holds."};
    d.inputs = inputs();
    d.outputs = {{.name = "state", .label = "State", .type = SocketType::state, .sentence = "All bodies at a frame"}};
    d.parameters = parameters();
    return {.description = d, .cook = cook_solver, .depends_on_frame = true, .seed = seed};
}

}  // namespace sunder
