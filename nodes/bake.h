// The bake runner: evaluates every bake node of a graph frame by frame and writes what they ask for.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/graph/graph.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/scene/scene.h"

namespace sunder {

enum class BakeStart {
    fresh,    // a folder that holds a bake already is refused
    resume,   // go on after the last whole frame; a first bake if there is none yet
    restart,  // what an earlier bake wrote in the folder is removed first
};

/// A frame that is now on disk; times are wall seconds.
struct BakedFrame {
    int frame = 0, last_frame = 0;
    size_t n_files = 0;
    uint64_t bytes = 0;
    double simulate_s = 0, other_nodes_s = 0, write_s = 0;
    StepReport step;  // summed over the solvers
};

struct BakeSettings {
    std::string folder;
    std::optional<std::array<int, 2>> frames;  // both included; the graph's range unless given. The simulation always
                                               // begins at the graph's first frame
    BakeStart start = BakeStart::fresh;
    std::function<void(const BakedFrame&)> frame_done;  // may be empty
};

struct BakeReport {
    std::array<int, 2> frames = {0, 0};  // wanted
    int first_new_frame = 0;             // frames before it were there already
    size_t n_frames = 0, n_files = 0;    // written now
    uint64_t bytes = 0;
    std::vector<std::string> notes;  // sentences: what meshes wanted, what solvers and exports leave out
};

/// Every file appears whole or not at all, the manifest follows after each frame: whenever a bake ends (cancelled,
/// killed, disk full), the folder holds whole frames and `resume` goes on from the last, to the same bits as an
/// unbroken run. Errors: graph without bake nodes; frames before the graph's first; two files of one name; foreign
/// files in the way; a bake is there already (fresh); graph, input, version or baked files differ from the manifest
/// (resume: what differs is named); writing failed; cancelled.
Result<BakeReport> bake(Graph& graph, const BakeSettings& settings, const Progress& progress = {});

}  // namespace sunder
