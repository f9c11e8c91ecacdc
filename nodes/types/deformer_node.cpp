// deformer: the visual mesh of one body, skinned to a state and split where edges broke.
#include <algorithm>

#include "fracture_tools/skin/source_skin.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "nodes/graph/nearest_name.h"
#include "nodes/graph/node_list.h"
#include "solver/threads/parallel.h"

namespace sunder {
namespace {

/// Split topology goes on from the frame before, for as long as the body is the same.
struct DeformerStore {
    ContentKey key = 0;
    VisualTopology topology = VisualTopology::compact;
    std::shared_ptr<const VertexMotion> motion;
    std::unique_ptr<VisualMeshBuilder> builder;
};

Result<size_t> body_index(CookContext& context, const StateValue& state, const BodyValue& body) {
    const std::vector<Body>& bodies = state.scene->bodies;
    const auto found = std::ranges::find(bodies, body.name, &Body::name);
    const size_t index = static_cast<size_t>(found - bodies.begin());
    if (found != bodies.end() && state.body_keys[index] == body.key) return index;
    std::vector<std::string> held;
    for (const Body& b : bodies) held.push_back(b.name);
    return context.error("state", "its solver does not move body '" + body.name + "'",
                         "bodies of that solver: " + list_text(held));
}

template <class T>
std::span<const T> slice(const std::vector<T>& array, uint32_t begin, uint32_t end) {
    return std::span<const T>(array).subspan(begin, end - begin);
}

/// What one node makes its mesh of.
struct Inputs {
    std::shared_ptr<const BodyValue> body;
    std::shared_ptr<const StateValue> state;
    size_t index = 0;  // of the body among those of the state
    // Where time is scaled, velocities as they are seen, m/s, rad/s; else empty:
    std::vector<Vec3> velocity = {}, angular_velocity = {};
    std::shared_ptr<const VertexMotion> motion = {};  // that it follows, or null
    SourceMoment moment = {};

    const Body& placed() const { return state->scene->bodies[index]; }

    void scale_velocities() {
        const double scale = state->at.scale;
        if (scale == 1) return;
        const auto scaled = [&](const std::vector<Vec3>& all) {
            std::vector<Vec3> own;
            for (const Vec3& v : slice(all, placed().particle_begin, placed().particle_end)) own.push_back(scale * v);
            return own;
        };
        velocity = scaled(state->state->velocity), angular_velocity = scaled(state->state->angular_velocity);
    }

    // Simulated frames of so many seconds, from `start` on.
    void take_motion(int start, double frame_seconds) {
        if (index < state->motions.size()) motion = state->motions[index];
        if (!motion) return;
        const FrameState& s = *state->state;
        const auto frame_at = [&](double seconds) { return start + seconds / frame_seconds; };
        moment.now = frame_at(s.time), moment.frame_seconds = frame_seconds / state->at.scale;
        const auto until = [&](const FrameState& of, uint32_t i) {
            return of.inactive.empty() ? HUGE_VAL : of.inactive[i].followed;
        };
        Leaving leaving;
        for (uint32_t i = placed().particle_begin; i < placed().particle_end; ++i) {
            moment.until.push_back(until(s, i) == HUGE_VAL ? HUGE_VAL : frame_at(until(s, i)));
            leaving.fragments.push_back(until(s, i) != HUGE_VAL && until(*state->kept, i) == HUGE_VAL);
        }
        if (std::ranges::find(leaving.fragments, 1) == leaving.fragments.end()) return;
        const Body& b = placed();
        const FrameState& from = *state->kept;
        leaving.begin = frame_at(from.time), leaving.share = state->at.share();
        leaving.position = slice(from.position, b.particle_begin, b.particle_end);
        leaving.orientation = slice(from.orientation, b.particle_begin, b.particle_end);
        leaving.plastic_deformation = slice(from.plastic_deformation, b.particle_begin, b.particle_end);
        leaving.edge_intact = slice(from.edge_intact, b.edge_begin, b.edge_end);
        moment.leaving = std::move(leaving);
    }

    BodyFrame frame() const {
        const Body& b = placed();
        const FrameState& s = *state->state;
        const auto seen = [&](const std::vector<Vec3>& own, const std::vector<Vec3>& all) {
            return own.empty() ? slice(all, b.particle_begin, b.particle_end) : std::span<const Vec3>(own);
        };
        std::span<const PieceMotion> pieces;
        if (state->pieces) pieces = slice(*state->pieces, b.particle_begin, b.particle_end);
        return {.position = slice(s.position, b.particle_begin, b.particle_end),
                .orientation = slice(s.orientation, b.particle_begin, b.particle_end),
                .plastic_deformation = slice(s.plastic_deformation, b.particle_begin, b.particle_end),
                .edge_intact = slice(s.edge_intact, b.edge_begin, b.edge_end),
                .velocity = seen(velocity, s.velocity),
                .angular_velocity = seen(angular_velocity, s.angular_velocity),
                .source = motion ? &moment : nullptr,
                .piece = pieces,
                .time = {state->at.scale, state->scale_rate}};
    }
};

Result<Inputs> read_inputs(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> body = context.input<BodyValue>("body");
    if (!body) return body.error();
    Result<std::shared_ptr<const StateValue>> state = context.input<StateValue>("state");
    if (!state) return state.error();
    Result<size_t> index = body_index(context, **state, **body);
    if (!index) return index.error();
    Inputs inputs{body.take(), state.take(), *index};
    inputs.scale_velocities();
    inputs.take_motion(context.start_frame(), context.seconds(1));
    return inputs;
}

/// What a node keeps, and what it is to be for.
struct Wanted {
    DeformerStore* store;
    const BodyValue* body;
    VisualTopology topology;
    std::shared_ptr<const VertexMotion> motion;

    bool is_kept() const {
        return store->builder && store->key == body->key && store->topology == topology && store->motion == motion;
    }
    void make() const {
        store->builder =
            std::make_unique<VisualMeshBuilder>(body->fragments, *body->rest, body->pose, topology, motion);
        store->key = body->key, store->topology = topology, store->motion = motion;
    }
};

Wanted wanted_builder(CookContext& context, const Inputs& inputs) {
    const bool is_constant = context.parameters().text("topology") == "constant";
    return {&context.store().get<DeformerStore>(), inputs.body.get(),
            is_constant ? VisualTopology::constant : VisualTopology::compact, inputs.motion};
}

std::vector<Result<Value>> cook_together(std::span<CookContext* const> contexts) {
    std::vector<Result<Inputs>> inputs;
    for (CookContext* context : contexts) {
        inputs.push_back(read_inputs(*context));
        if (!inputs.back() && inputs.back().error().code == ErrorCode::cancelled)
            return std::vector<Result<Value>>(contexts.size(), cancelled());
    }

    const std::shared_ptr<const WorkerPool> workers = contexts.front()->workers();
    std::vector<Wanted> wanted, missing;
    for (size_t i = 0; i < contexts.size(); ++i)
        if (inputs[i]) wanted.push_back(wanted_builder(*contexts[i], *inputs[i]));
    std::ranges::copy_if(wanted, std::back_inserter(missing), [](const Wanted& w) { return !w.is_kept(); });
    workers->for_each(missing.size(), [&](size_t i) { missing[i].make(); });

    std::vector<VisualMesh> meshes(contexts.size());
    std::vector<MovingBody> bodies;
    for (size_t i = 0; i < contexts.size(); ++i)
        if (inputs[i]) bodies.push_back({wanted[bodies.size()].store->builder.get(), inputs[i]->frame(), &meshes[i]});
    const std::vector<Status> made =
        build_meshes(bodies, [&](size_t n, size_t grain, const auto& body) { workers->for_range(n, grain, body); });

    std::vector<Result<Value>> values;
    size_t n_bodies = 0;
    for (size_t i = 0; i < contexts.size(); ++i) {
        if (!inputs[i]) {
            values.push_back(inputs[i].error());
            continue;
        }
        const Status& status = made[n_bodies++];
        if (status) {
            const BodyValue& body = *inputs[i]->body;
            values.push_back(make_value(BodyMesh{body.name, body.fragments, std::move(meshes[i])}));
        } else {
            contexts[i]->store().get<DeformerStore>().builder.reset();  // it may have stopped halfway
            values.push_back(status.error());
        }
    }
    return values;
}

Result<Value> cook_deformer(CookContext& context) {
    CookContext* const alone = &context;
    return std::move(cook_together({&alone, 1}).front());
}

}  // namespace

NodeType deformer_node() {
    NodeDescription d{
        .type = "deformer",
        .label = "Deformer",
        .category = "simulation",
        .sentence =
            "Makes the visual mesh of one body at a frame: it follows the particles and splits where edges broke."};
    d.inputs = {
        {.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The body whose mesh is made"},
        {.name = "state", .label = "State", .type = SocketType::state, .sentence = "Of a solver that moves the body"}};
    d.outputs = {
        {.name = "mesh", .label = "Mesh", .type = SocketType::visual_mesh, .sentence = "The mesh at the frame"}};
    d.parameters = {
        {.name = "topology",
         .label = "Topology",
         .type = ParameterType::choice,
         .default_value = "compact",
         .sentence = "compact: no break surface is in the mesh before its edge breaks, so the mesh grows as it tears; "
                     "constant: all fragments are there from the first frame, break surfaces marked as hidden until "
                     "they open, so that vertices and faces stay the same for point caches and motion blur",
         .choices = {"compact", "constant"}}};
    return {.description = d, .cook = cook_deformer, .cook_together = cook_together};
}

}  // namespace sunder
