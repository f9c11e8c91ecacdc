// Where geometry with tolerances or error bounds of its own is done, so that these mean the same for all meshes.
#pragma once

#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// To a box about the origin whose longest side is 1 to 2. The scale is a power of two, so that scaling rounds nothing.
struct UnitBox {
    Vec3 center;
    double scale;

    /// Of the vertices that a triangle uses.
    explicit UnitBox(const MeshView& mesh) {
        Aabb box;
        for (const Triangle& t : mesh.triangles)
            for (uint32_t v : t) box.extend(mesh.positions[v]);
        center = 0.5 * (box.min + box.max);
        scale = math::exp2(-std::floor(math::log2((box.max - box.min).maxCoeff())));
    }
    Vec3 to_unit(const Vec3& p) const { return (p - center) * scale; }
    Vec3 to_world(const Vec3& p) const { return p / scale + center; }
};

}  // namespace sunder
