// bake_mesh: asks the bake runner to write a mesh each frame.
#include "nodes/files/output_pattern.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Result<Value> cook_bake_mesh(CookContext& context) {
    Result<std::shared_ptr<const BodyMesh>> mesh = context.input<BodyMesh>("mesh");
    if (!mesh) return mesh.error();
    BakeItem item;
    item.path = output_path(context.parameters().text("path"), context.frame()) +
                compressed_suffix(context.parameters().text("compression"));
    item.mesh = *mesh;
    return make_value(std::move(item));
}

}  // namespace

NodeType bake_mesh_node() {
    NodeDescription d{.type = "bake_mesh",
                      .label = "Bake Mesh",
                      .category = "output",
                      .sentence = "Writes a visual mesh to a file each frame when the graph is baked."};
    d.inputs = {{.name = "mesh", .label = "Mesh", .type = SocketType::visual_mesh, .sentence = "A deformer's mesh"}};
    d.outputs = {{.name = "item",
                  .label = "Item",
                  .type = SocketType::bake_item,
                  .sentence = "The file to write, for the bake runner"}};
    d.parameters = {
        {.name = "path",
         .label = "Path",
         .type = ParameterType::output_path,
         .default_value = "mesh/mesh.####.ply",
         .sentence = "File below the output folder, #### being the frame; its ending tells the format"},
        {.name = "export",
         .label = "Export",
         .type = ParameterType::choice,
         .default_value = "none",
         .sentence = "Also one file of all frames beside them (PLY), made when all are baked: of this mesh alone, "
                     "in usda and glb with rigid bodies and colliders. usda: USD with every frame; glb: glTF, "
                     "fragments as rigid nodes (constant topology); pc2: "
                     "point cache (constant topology)",
         .choices = {"none", "usda", "glb", "pc2"}},
        compression_parameter(),
        sub_frames_parameter()};
    return {.description = d, .cook = cook_bake_mesh, .depends_on_frame = true};
}

}  // namespace sunder
