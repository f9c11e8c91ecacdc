// Fragments to oriented particles: exact mass, centroid, frame and radii; one edge an interface that joins.
#pragma once

#include "solver/data/fragment_set.h"
#include "solver/data/result.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

struct SimulationMeshSettings {
    double density = 1000;           // kg/m3, > 0
    double min_radius_share = 0.02;  // radii are at least this share of the largest one (thin pieces), (0, 1]
};

/// In the frame of the fragments (no placement). Body index 0. Errors: no fragments; a fragment without volume.
Result<SimulationMesh> build_simulation_mesh(const FragmentSet& set, const SimulationMeshSettings& settings);

}  // namespace sunder
