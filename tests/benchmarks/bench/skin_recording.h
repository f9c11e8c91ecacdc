// What the deformers of a scene read, frame by frame, in a file: so that builds are compared on the same states, and
// instructions counted where neither the cut nor the solver can run.
#pragma once

#include <string>
#include <vector>

#include "tests/benchmarks/bench/scenes.h"

namespace sunder::bench {

struct SkinRecording {
    BenchScene scene;                // `skins`, and of `scene` the bodies and what they are at rest
    std::vector<FrameState> frames;  // positions, orientations, plastic deformations, edges
};

/// A file of this machine's byte order and of this version. Both throw std::runtime_error, the second one also for a
/// file that is something else.
void write_recording(const SkinRecording& recording, const std::string& path);
SkinRecording read_recording(const std::string& path);

}  // namespace sunder::bench
