// prefracture: cuts a solid mesh into fragments.
#include "fracture_tools/prefracture.h"
#include "nodes/node_list.h"

namespace sunder {
namespace {

Result<Value> cook(CookContext& context) {
    Result<std::shared_ptr<const TriMesh>> mesh = context.input<TriMesh>("mesh");
    if (!mesh) return mesh.error();
    const Parameters& p = context.parameters();
    PrefractureSettings settings;
    settings.method = CutMethod::kmeans;
    settings.pieces = p.integer("pieces");
    settings.seed = static_cast<uint32_t>(p.integer("seed"));
    settings.cells_per_piece = p.number("cells_per_piece");
    settings.sharp_angle = p.number("sharp_angle");
    settings.repair = p.boolean("repair");
    Result<FragmentSet> fragments = prefracture(**mesh, settings, "node '" + context.node() + "'", context.progress());
    if (!fragments) return fragments.error();
    return make_value(fragments.take());
}

}  // namespace

NodeType prefracture_node() {
    NodeDescription d{.type = "prefracture",
                      .label = "Pre-Fracture",
                      .category = "fracture",
                      .sentence = "Cuts a closed mesh into fragments that share their break surfaces exactly."};
    d.inputs = {{.name = "mesh",
                 .label = "Mesh",
                 .type = SocketType::mesh,
                 .sentence = "A closed surface that bounds a solid"}};
    d.outputs = {{.name = "fragments",
                  .label = "Fragments",
                  .type = SocketType::fragments,
                  .sentence = "Closed pieces and the interfaces between them"}};
    d.parameters = {{.name = "method",
                     .label = "Method",
                     .type = ParameterType::choice,
                     .default_value = "kmeans",
                     .sentence = "kmeans: tetrahedra gathered into pieces of like size, with rough break surfaces",
                     .choices = {"kmeans"}},
                    {.name = "pieces",
                     .label = "Pieces",
                     .type = ParameterType::integer,
                     .min = 1,
                     .max = 100000,
                     .default_value = 300,
                     .sentence = "Number of fragments wanted"},
                    {.name = "seed",
                     .label = "Seed",
                     .type = ParameterType::integer,
                     .min = 0,
                     .default_value = 0,
                     .sentence = "Chooses among cuts of the same kind; the same seed gives the same cut"},
                    {.name = "cells_per_piece",
                     .label = "Cells per Piece",
                     .type = ParameterType::number,
                     .min = 4,
                     .max = 1000,
                     .default_value = 30.0,
                     .sentence = "Tetrahedra aimed at for each fragment: more follow the surface closer and cost more"},
                    {.name = "sharp_angle",
                     .label = "Sharp Angle",
                     .type = ParameterType::number,
                     .unit = "degrees",
                     .min = 0,
                     .max = 180,
                     .default_value = 0.0,
                     .sentence = "Edges of the mesh sharper than this stay edges; 0 decides by the mesh"},
                    {.name = "repair",
                     .label = "Repair",
                     .type = ParameterType::boolean,
                     .default_value = true,
                     .sentence = "Welds, orients and closes small holes of the mesh first, with a warning"}};
    return {.description = d, .cook = cook};
}

}  // namespace sunder
