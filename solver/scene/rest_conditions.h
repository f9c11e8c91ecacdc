// What acts on sleepers, as hashes: where one changed from frame to frame, it wakes them.
#pragma once

#include <cstdint>
#include <vector>

#include "solver/scene/scene.h"

namespace sunder {

inline bool moves(const DrivenPose& d) {
    if (const SurfaceDrive& s = d.surface; s.surface && s.surface->longest > 0 && s.begin != s.end) return true;
    return !d.grip.is_rigid() || d.begin.position != d.end.position ||
           d.begin.orientation.coeffs() != d.end.orientation.coeffs();
}

inline bool moves(const FrameInput::SourceDrive& d) { return d.begin != d.end && !(*d.begin == *d.end); }

inline bool pin_moves(const FrameInput& input, size_t pin) {
    const FrameInput::SourceDrive* source = input.pin_source(pin);
    return moves(input.pins[pin]) || (source && moves(*source));
}

enum class FrameEnd { begin, end };

/// The sleepers themselves; gravity, forces and self-collision; then one each of the materials, pins and colliders.
std::vector<uint64_t> rest_conditions(const FrameInput& input, bool self_collision, FrameEnd at,
                                      const FrameState& state);

}  // namespace sunder
