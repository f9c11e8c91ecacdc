// solver: moves all bodies together; any frame may be asked for.
#include "nodes/graph/node_list.h"
#include "nodes/types/solver_scene.h"
#include "nodes/types/state_cache.h"
#include "solver/presets.h"
#include "solver/solver.h"

namespace sunder {
namespace {

/// What the node keeps. A frame's history is the key of all that led to it: the scene, the materials it started with
/// and what drove each step. A kept frame holds as long as its history is what the inputs say now; so an edit that
/// starts to matter at frame 50 leaves frames 1 to 49 as they are.
struct SolverStore {
    ContentKey scene_key = 0;
    std::shared_ptr<const WorkerPool> workers;  // the solver's
    std::shared_ptr<Solver> solver;
    std::vector<ContentKey> body_keys;
    StateCache frames;

    ContentKey node_key = 0;          // of the node when `history` was last looked at
    std::vector<ContentKey> history;  // of frame start + i
};

/// The solver node at work on one request.
class SolverCook {
public:
    explicit SolverCook(CookContext& context) : context_(context), store_(context.store().get<SolverStore>()) {}

    /// The solver and its scene, made again only if the scene changed.
    Status prepare() {
        const std::shared_ptr<const WorkerPool> workers = context_.workers();
        if (store_.node_key == context_.key() && store_.solver && store_.workers == workers) return {};
        Result<SceneInput> input = scene_input(context_);
        if (!input) return input.error();
        if (!store_.solver || store_.scene_key != input->key || store_.workers != workers) {
            Result<std::unique_ptr<Solver>> solver = Solver::create(std::move(input->scene), workers);
            if (!solver) return solver.error();
            if (store_.scene_key != input->key) store_.frames.clear();
            store_.solver = solver.take();
            store_.scene_key = input->key;
            store_.workers = workers;
            store_.body_keys = std::move(input->body_keys);
        }
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
        put(start, *wanted, store_.solver->initial_state(*materials), {});
        return start;
    }

    Status advance_to(int from, int frame) {
        const SolverSettings settings = settings_of(context_.parameters());
        if (Status ok = settings.check("node '" + context_.node() + "'"); !ok) return ok;
        for (int next = from + 1; next <= frame; ++next) {
            const double n = frame - from, done = next - 1 - from;
            const std::string name = "frame " + std::to_string(next);
            const Progress part = context_.progress().part(done / n, (done + 1) / n);
            if (!part.report(0, "simulating " + name)) return cancelled();
            Result<FrameInput> input = frame_input(context_, next);
            if (!input) return input.error();
            Result<ContentKey> key = history(next);
            if (!key) return key.error();
            const std::shared_ptr<const FrameState> before = store_.frames.at(next - 1)->state;
            FrameState state;
            Result<StepReport> report = store_.solver->advance(*input, settings, *before, state, part);
            if (!report) {
                Error error = report.error();
                if (error.code != ErrorCode::cancelled)
                    error.where =
                        "node '" + context_.node() + "', " + name + (error.where.empty() ? "" : ": " + error.where);
                return error;
            }
            put(next, *key, std::move(state), *report);
        }
        return {};
    }

    void put(int frame, ContentKey history, FrameState state, const StepReport& report) {
        store_.frames.put(frame, {history, std::make_shared<const FrameState>(std::move(state)), report},
                          context_.cache_limit());
    }

    Value value(int frame) const {
        const StateCache::Entry& entry = *store_.frames.at(frame);
        StateValue value;
        value.frame = frame;
        value.scene = std::shared_ptr<const Scene>(store_.solver, &store_.solver->scene());
        value.state = entry.state;
        value.body_keys = store_.body_keys;
        value.report = entry.report;
        return make_value(std::move(value));
    }

    Status check_state(const FrameState& state) const { return store_.solver->check_state(state); }

private:
    Result<std::vector<Material>> start_materials() {
        const auto bodies = context_.inputs_as<BodyValue>("bodies", context_.start_frame());
        if (!bodies) return bodies.error();
        std::vector<Material> materials;
        for (const auto& body : *bodies) materials.push_back(body->material);
        return materials;
    }

    CookContext& context_;
    SolverStore& store_;
};

Result<Value> cook(CookContext& context) {
    SolverCook solver(context);
    if (Status ok = solver.prepare(); !ok) return ok.error();
    const int frame = std::max(context.frame(), context.start_frame());  // before the start all is as at the start
    Result<int> from = solver.latest(frame);
    if (!from) return from.error();
    if (Status ok = solver.advance_to(*from, frame); !ok) return ok.error();
    return solver.value(frame);
}

Status seed(CookContext& context, int frame, FrameState state) {
    if (frame < context.start_frame())
        return context.error("", "a saved state of frame " + std::to_string(frame) + " lies before the first frame");
    SolverCook solver(context);
    if (Status ok = solver.prepare(); !ok) return ok;
    if (Status ok = solver.check_state(state); !ok) return ok;
    Result<ContentKey> history = solver.history(frame);
    if (!history) return history.error();
    solver.put(frame, *history, std::move(state), {});
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

std::vector<Json> preset_names() {
    std::vector<Json> names;
    for (const Preset& preset : kPresets) names.push_back(preset.name);
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

std::vector<ParameterDescription> parameters() {
    return {{.name = "method",
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
             .choices = preset_names()},
            {.name = "substeps",
             .label = "Substeps",
             .type = ParameterType::integer,
             .min = 1,
             .max = 1000,
             .default_value = nullptr,
             .sentence = "Steps per frame: more for stiff materials and fast impacts, even numbers are more accurate; "
                         "null: the preset's",
             .nullable = true},
            {.name = "iterations",
             .label = "Iterations",
             .type = ParameterType::integer,
             .min = 1,
             .max = 1000,
             .default_value = nullptr,
             .sentence = "Sweeps per substep: more carry a push further through a body; soft things that lie on one "
                         "another take two at least; null: the preset's",
             .nullable = true},
            {.name = "hit_substeps",
             .label = "Hit Substeps",
             .type = ParameterType::integer,
             .min = 1,
             .max = 256,
             .default_value = nullptr,
             .sentence = "Of method projective: parts, at most, of a substep in which something is hit so fast that it "
                         "may break: as many as let the hit's waves run from fragment to fragment, so that it breaks "
                         "as much with few substeps as with many; stiff things need more. 1: never divided; null: the "
                         "preset's",
             .nullable = true},
            {.name = "crack_passes",
             .label = "Crack Passes",
             .type = ParameterType::integer,
             .min = 1,
             .max = 64,
             .default_value = 4,
             .sentence = "How often in a substep a hit may break things. With 1, as in the paper, its cracks run one "
                         "ring of fragments a substep; with more it breaks nearly as much with few substeps as with "
                         "many, but what hangs together with the cracks takes the substep again each time"},
            {.name = "error_budget",
             .label = "Error Budget",
             .min = 0,
             .max = 1,
             .default_value = 0.0,
             .sentence =
                 "Above 0, the solver chooses substeps (1 to 64) and iterations frame by frame, so that oscillations "
                 "and the time of breaking are wrong by about this share at most (0.02: 2 %) and quiet frames "
                 "cost little; 0: as preset, substeps and iterations say"},
            {.name = "over_relaxation",
             .label = "Over-Relaxation",
             .min = 0.1,
             .max = 1.9,
             .default_value = 1.5,
             .sentence =
                 "Of method jacobi: how far each sweep goes beyond its own answer, to arrive sooner; 1: not at all. "
                 "Odd numbers of iterations take only as much as ends near the goal (three: 1.58)"},
            {.name = "gravity",
             .label = "Gravity",
             .type = ParameterType::vector3,
             .unit = "m/s2",
             .min = -1e6,
             .max = 1e6,
             .default_value = {0.0, 0.0, -9.81},
             .sentence = "Acceleration of all that may move",
             .animatable = true},
            {.name = "damping",
             .label = "Damping",
             .unit = "1/s",
             .min = 0,
             .max = 1e4,
             .default_value = 0.0,
             .sentence = "Velocities die away as exp(-damping x time)"},
            {.name = "depenetration_speed",
             .label = "Depenetration Speed",
             .unit = "m/s",
             .min = 0,
             .max = 1e4,
             .min_excluded = true,
             .default_value = 1.0,
             .sentence = "Fastest at which parts that overlap already are pushed apart"},
            {.name = "self_collision",
             .label = "Self-Collision",
             .type = ParameterType::boolean,
             .default_value = true,
             .sentence = "Particles of one body collide with one another where no edge joins them"},
            {.name = "sleeping",
             .label = "Sleeping",
             .type = ParameterType::boolean,
             .default_value = true,
             .sentence = "What has not moved for half a second (looked at four times a second) is left out, and costs "
                         "nothing, until something touches it or what acts on it changes; off: everything is "
                         "simulated at all times"}};
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
    return {.description = d, .cook = cook, .depends_on_frame = true, .seed = seed};
}

}  // namespace sunder
