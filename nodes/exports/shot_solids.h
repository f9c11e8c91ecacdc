// Rigid bodies and colliders of a baked shot, as meshes that keep their shape.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "nodes/bake_files/manifest.h"
#include "nodes/exports/shot_export.h"
#include "nodes/exports/shot_looks.h"

namespace sunder {

/// Where solids are found: a bake, and the folder from which paths in its graph are seen.
struct SolidSource {
    Manifest manifest;
    std::filesystem::path bake, graph_folder;
    std::map<std::string, Look> looks;
    std::vector<double> frames;  // for which poses are wanted; all baked
};

/// Of every solver of the graph, rigid bodies first. Rigid bodies move as the states that a bake_state node wrote tell,
/// colliders as their keys do, those that deform as their vertices do. `extent` (m) is about how large the shot is:
/// planes are shown ten times as large. Errors: a state or the mesh of a look that cannot be read.
Result<ShotSolids> shot_solids(const SolidSource& source, double extent);

}  // namespace sunder
