#include "solver/collision/movable_size.h"

#include "solver/collision/shape_distance.h"
#include "solver/data/math_functions.h"

namespace sunder {

double size_of(const Scene& scene, MovableIndex movable) {
    const size_t n = scene.rest.n_particles();
    if (movable < n) return math::cbrt(scene.rest.volume[movable]);
    const Shape& shape = scene.rigid_bodies[movable - n].shape;
    return 2 * (shape.kind == ShapeKind::box ? math::cbrt(shape.half_extents.prod()) : 0.8 * shape.radius);
}

double reach_of(const Scene& scene, MovableIndex i) {
    const size_t n = scene.rest.n_particles();
    return i < n ? scene.rest.radii[i].maxCoeff() : bounding_radius(scene.rigid_bodies[i - n].shape);
}

}  // namespace sunder
