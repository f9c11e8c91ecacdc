// A contact: two solids that touch, or will within the step.
#pragma once

#include <cstdint>
#include <span>

#include "solver/data/ids.h"
#include "solver/data/math.h"

namespace sunder {

/// Movable things share one index: particles first, then rigid bodies (n_particles + r). Colliders have their own.
struct Contact {
    static constexpr uint32_t kStatic = 0x80000000u;  // set in `b`: the rest of b is a collider index
    MovableId a;
    MovableId b;                  // or kStatic | collider
    Vec3 normal = Vec3::UnitZ();  // unit, from b towards a: pushes a away from b
    Vec3 point_a = Vec3::Zero();  // deepest point of a and of b (world, at detection), m
    Vec3 point_b = Vec3::Zero();
    double gap = 0;  // normal . (point_a - point_b), m; negative: overlap

    static MovableId collider(uint32_t c) { return MovableId(kStatic | c); }
};

/// Something that can be touched, as the detection sees it at one instant.
struct Ellipsoid {
    Vec3 center = Vec3::Zero();    // m
    Mat3 axes = Mat3::Identity();  // columns: unit axes, world
    Vec3 radii = Vec3::Ones();     // m
};

/// The ellipsoids of particles, made as they are asked for: most are near nothing.
struct ParticleEllipsoids {
    std::span<const Vec3> center;    // m
    std::span<const Quat> rotation;  // since rest; or empty: as at rest
    std::span<const Quat> rest_orientation;
    std::span<const Vec3> radii;  // m

    size_t size() const { return center.size(); }
    Mat3 axes(size_t i) const {
        return (rotation.empty() ? rest_orientation[i] : rotation[i] * rest_orientation[i]).toRotationMatrix();
    }
    Ellipsoid operator[](size_t i) const { return {center[i], axes(i), radii[i]}; }
};

}  // namespace sunder
