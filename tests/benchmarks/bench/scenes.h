// The named scenes of `./sunder bench`.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "solver/data/fragment_set.h"
#include "solver/solver.h"

namespace sunder::bench {

/// A body whose mesh is made every frame.
struct SkinnedBody {
    std::shared_ptr<const FragmentSet> fragments;
    Pose pose;  // as placed in the scene
};

struct BenchScene {
    Scene scene;
    FrameInput input;
    SolverSettings settings;
    int warm_up = 0;                                             // frames before the measured ones
    int frames = 48;                                             // measured
    std::function<void(int frame, FrameInput& io_input)> drive;  // before each frame; may be empty
    std::vector<SkinnedBody> skins;                              // one a body, or none
};

struct NamedScene {
    const char* name;
    const char* what;
    bool long_run;  // left out unless asked for by name or --all
    std::function<BenchScene()> make;
};

/// Throws std::runtime_error with the core's text where a mesh cannot be read or cut.
const std::vector<NamedScene>& all_scenes();

}  // namespace sunder::bench
