// Forces that differ from place to place.
#pragma once

#include <string>
#include <variant>

#include "solver/scene/scene.h"

namespace sunder {

/// How strong something is at a distance: it grows evenly to 1 at `radius`, and from there goes as (radius /
/// r)^exponent.
struct Falloff {
    double radius = 1;      // m, > 0
    double exponent = 2;    // >= 0
    double reach = kNever;  // nothing beyond, m
    double at(double distance) const;
};

/// What keeps a blast off: nothing; colliders and rigid bodies; fragments, too.
enum class Shadow { none, solids, all };

/// Velocities that everything is given at once, at the start of a frame, away from the centre. `Falloff` is a factor on
/// `speed`; what pins hold is given none.
struct Blast {
    Vec3 center = Vec3::Zero();
    Falloff falloff = {};
    double speed = 0;                // at the falloff's radius, m/s
    double energy = 0;               // above 0: speed is such that at rest all would have this, J
    Vec3 direction = Vec3::UnitZ();  // of its cone, unit
    double least_cosine = -2;        // of the angle to it; below -1: all around
    Shadow shadow = Shadow::none;
};

struct Nothing {};  // in this frame

struct LocalForce {
    using Kind = std::variant<Nothing, Blast>;
    std::string name;  // of its node
    uint64_t key = 0;  // equal for equal kinds
    Kind kind;
};

/// Whether it does anything in this frame.
bool acts(const Force& force);

}  // namespace sunder
