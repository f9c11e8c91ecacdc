// Numbers of frames, and of what lies between two of them.
#pragma once

#include <string>

namespace sunder {

/// Of `n` steps from one frame to the next that many behind the frame. Equal shares have equal bits: 1/2 is 2/4.
inline double sub_frame(int frame, int step, int n) {
    return static_cast<double>(frame) + static_cast<double>(step) / static_cast<double>(n);
}

/// "12", "12.25": as few digits as tell it from all others.
std::string frame_text(double frame);

}  // namespace sunder
