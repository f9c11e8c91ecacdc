#include "nodes/graph/registry.h"

#include <algorithm>

#include "nodes/graph/json.h"
#include "nodes/graph/node_list.h"

namespace sunder {

const NodeType* Registry::find(std::string_view type) const {
    const auto found = std::ranges::find_if(types_, [&](const NodeType& t) { return t.description.type == type; });
    return found == types_.end() ? nullptr : &*found;
}

const Registry& standard_registry() {
    static const Registry registry({
        mesh_file_node(),  lattice_node(),     prefracture_node(), fragment_region_node(),
        body_node(),       body_region_node(), follow_node(),      activate_node(),
        seam_node(),       rigid_body_node(),  collider_node(),    pin_node(),
        force_node(),      blast_node(),       point_force_node(), vortex_node(),
        turbulence_node(), guide_node(),       grid_force_node(),  pressure_node(),
        solver_node(),     deformer_node(),    bake_mesh_node(),   bake_state_node(),
    });
    return registry;
}

Json descriptions_to_json(const Registry& registry) {
    Json json = {{"sunder", SUNDER_VERSION}, {"nodes", Json::array()}};
    for (const NodeType& type : registry.types()) json["nodes"].push_back(to_json(type.description));
    return json;
}

}  // namespace sunder
