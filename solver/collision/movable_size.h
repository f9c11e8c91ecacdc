// How large movable things are.
#pragma once

#include "solver/collision/broad_phase.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Length of a movable, m: the cube of the same volume.
double size_of(const Scene& scene, MovableIndex movable);

/// Of a particle or rigid body, about its centre, m.
double reach_of(const Scene& scene, MovableIndex movable);

inline Aabb ball(const Vec3& center, double radius) {
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
}

}  // namespace sunder
