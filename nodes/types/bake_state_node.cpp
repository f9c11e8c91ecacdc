// bake_state: asks the bake runner to write the solver's state each frame.
#include "nodes/files/output_pattern.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Result<Value> cook_bake_state(CookContext& context) {
    Result<std::shared_ptr<const StateValue>> state = context.input<StateValue>("state");
    if (!state) return state.error();
    BakeItem item;
    item.path = output_path(context.parameters().text("path"), context.frame()) +
                compressed_suffix(context.parameters().text("compression"));
    item.state = *state;
    return make_value(std::move(item));
}

}  // namespace

NodeType bake_state_node() {
    NodeDescription d{.type = "bake_state",
                      .label = "Bake State",
                      .category = "output",
                      .sentence =
                          "Writes the simulation's whole state to a file each frame when the graph is baked; a bake "
                          "resumes from it."};
    d.inputs = {{.name = "state", .label = "State", .type = SocketType::state, .sentence = "A solver's state"}};
    d.outputs = {{.name = "item",
                  .label = "Item",
                  .type = SocketType::bake_item,
                  .sentence = "The file to write, for the bake runner"}};
    d.parameters = {{.name = "path",
                     .label = "Path",
                     .type = ParameterType::output_path,
                     .default_value = "state/sim.####.ply",
                     .sentence = "PLY file below the output folder, #### being the frame"},
                    compression_parameter(),
                    sub_frames_parameter()};
    return {.description = d, .cook = cook_bake_state, .depends_on_frame = true};
}

}  // namespace sunder
