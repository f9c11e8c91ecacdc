// One function a node type; each has a file of its own.
#pragma once

#include "nodes/graph/node.h"

namespace sunder {

NodeType mesh_file_node();
NodeType lattice_node();
NodeType prefracture_node();
NodeType fragment_region_node();
NodeType body_node();
NodeType body_region_node();
NodeType follow_node();
NodeType activate_node();
NodeType seam_node();
NodeType rigid_body_node();
NodeType collider_node();
NodeType pin_node();
NodeType force_node();
NodeType blast_node();
NodeType point_force_node();
NodeType vortex_node();
NodeType turbulence_node();
NodeType guide_node();
NodeType grid_force_node();
NodeType pressure_node();
NodeType solver_node();
NodeType deformer_node();
NodeType bake_mesh_node();
NodeType bake_state_node();

}  // namespace sunder
