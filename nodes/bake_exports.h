// Files of all frames that bake nodes ask for, made when every frame is on disk.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nodes/bake_files/bake_folder.h"
#include "nodes/bake_files/manifest.h"
#include "nodes/graph/graph.h"
#include "solver/data/progress.h"

namespace sunder {

struct WantedExport {
    std::string node, path;  // bake node; file below the output folder
};

/// What a bake node with this path pattern asks for, if anything. Errors: frames that are no PLY; a format that has no
/// room for the topology of the deformer.
Result<std::optional<WantedExport>> wanted_export(const Graph& graph, const std::string& node,
                                                  const std::string& pattern);

/// All files that it makes, below the output folder.
std::vector<std::string> files_of(const WantedExport& wanted);

/// Whether the manifest lists exports and all are there as listed.
bool exports_are_whole(const Manifest& manifest, const BakeFolder& folder);

struct WrittenExports {
    std::vector<FileStamp> stamps;   // of each file
    std::vector<std::string> notes;  // sentences, each with its file: what is not in it, and why
};

/// Makes them from the frames that the manifest lists, so that it does not matter in how many runs those were baked.
/// While files are being written the manifest on disk lists them without stamps: a run that dies here leaves nothing
/// that it does not know. `graph_folder`: where paths of the graph are seen from.
Result<WrittenExports> write_exports(const std::vector<WantedExport>& wanted, const BakeFolder& folder,
                                     const std::string& graph_folder, Manifest& io_manifest, const Progress& progress);

}  // namespace sunder
