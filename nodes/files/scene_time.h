// Simulated time, whose grid has one point a frame: states are kept there, and shown there or in between.
#pragma once

#include <cmath>

namespace sunder {

/// Where a frame lies in simulated time.
struct SceneTime {
    double frame = 0;  // simulated frames; the first frame is the same in both
    double scale = 1;  // simulated frames a frame, there

    bool is_on_grid() const { return frame == std::floor(frame); }
    int grid() const { return static_cast<int>(std::floor(frame)); }  // the latest grid point up to there
    double share() const { return frame - std::floor(frame); }        // of the way to the next one
    bool operator==(const SceneTime&) const = default;
};

}  // namespace sunder
