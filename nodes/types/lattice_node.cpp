// lattice: a box of cubic cells, one fragment each.
#include "fracture_tools/lattice.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Result<Value> cook_lattice(CookContext& context) {
    const Parameters& p = context.parameters();
    LatticeSettings settings;
    settings.size = p.vector3("size");
    settings.cells = p.integer3("cells");
    settings.center = p.vector3("center");
    settings.neighbours = p.integer("neighbours");
    Result<FragmentSet> fragments = make_lattice(settings, "node '" + context.node() + "'");
    if (!fragments) return fragments.error();
    return make_value(fragments.take());
}

}  // namespace

NodeType lattice_node() {
    NodeDescription d{.type = "lattice",
                      .label = "Lattice",
                      .category = "fracture",
                      .sentence = "A box of equal cells, one fragment each: the body of accuracy cases and lessons."};
    d.outputs = {{.name = "fragments",
                  .label = "Fragments",
                  .type = SocketType::fragments,
                  .sentence = "The cells, numbered along x first, then y, then z"}};
    d.parameters = {
        size_parameter(),
        {.name = "cells",
         .label = "Cells",
         .type = ParameterType::integer3,
         .min = 1,
         .max = 1000,
         .default_value = {4, 4, 4},
         .sentence = "Number of cells along each side; 4 million together at most"},
        {.name = "center",
         .label = "Center",
         .type = ParameterType::vector3,
         .unit = "m",
         .default_value = {0.0, 0.0, 0.0},
         .sentence = "Middle of the box"},
        {.name = "neighbours",
         .label = "Neighbours",
         .type = ParameterType::integer,
         .default_value = 6,
         .sentence = "Cells that a cell is joined to: 6 across faces, 18 also across edges, 26 also across corners",
         .choices = {6, 18, 26}}};
    return {.description = d, .cook = cook_lattice};
}

}  // namespace sunder
