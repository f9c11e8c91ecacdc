// deformer: the visual mesh of one body, skinned to a state and split where edges broke.
#include <algorithm>

#include "fracture_tools/visual_mesh.h"
#include "nodes/nearest_name.h"
#include "nodes/node_list.h"
#include "solver/parallel.h"

namespace sunder {
namespace {

/// Split topology goes on from the frame before, for as long as the body is the same.
struct DeformerStore {
    ContentKey key = 0;
    VisualTopology topology = VisualTopology::compact;
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

Result<Value> cook(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> body = context.input<BodyValue>("body");
    if (!body) return body.error();
    Result<std::shared_ptr<const StateValue>> state = context.input<StateValue>("state");
    if (!state) return state.error();
    Result<size_t> index = body_index(context, **state, **body);
    if (!index) return index.error();

    DeformerStore& store = context.store().get<DeformerStore>();
    const VisualTopology topology =
        context.parameters().text("topology") == "constant" ? VisualTopology::constant : VisualTopology::compact;
    if (!store.builder || store.key != (*body)->key || store.topology != topology) {
        store.builder =
            std::make_unique<VisualMeshBuilder>((*body)->fragments, *(*body)->rest, (*body)->pose, topology);
        store.key = (*body)->key, store.topology = topology;
    }
    const Body& b = (*state)->scene->bodies[*index];
    const FrameState& s = *(*state)->state;
    const WorkerPool& workers = context.workers();
    const RangeRunner run = [&](size_t n, size_t grain, const auto& body) { workers.for_range(n, grain, body); };
    Result<VisualMesh> mesh =
        store.builder->build({.position = slice(s.position, b.particle_begin, b.particle_end),
                              .orientation = slice(s.orientation, b.particle_begin, b.particle_end),
                              .plastic_deformation = slice(s.plastic_deformation, b.particle_begin, b.particle_end),
                              .edge_intact = slice(s.edge_intact, b.edge_begin, b.edge_end),
                              .velocity = slice(s.velocity, b.particle_begin, b.particle_end),
                              .angular_velocity = slice(s.angular_velocity, b.particle_begin, b.particle_end)},
                             run);
    if (!mesh) return mesh.error();
    return make_value(BodyMesh{(*body)->name, (*body)->fragments, mesh.take()});
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
    return {.description = d, .cook = cook};
}

}  // namespace sunder
