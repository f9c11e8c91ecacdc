#pragma once

#include <cstdint>

namespace sunder {

/// What moves a movable thing in a step.
enum class Role : uint8_t {
    free,   // its own motion, and what pulls and pushes it
    held,   // a pin; or nothing, for it sleeps, or stands by
    hinged  // a pin takes it to its place, and it turns by itself (in Newton steps)
};

}  // namespace sunder
