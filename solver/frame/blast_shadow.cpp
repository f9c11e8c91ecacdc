#include "solver/frame/blast_shadow.h"

#include <algorithm>
#include <cmath>

#include "solver/scene/motion.h"

namespace sunder {
namespace {

// Of the ellipsoids' radii: cubes side by side hide what is behind their common edge.
constexpr double kGapless = 1.42;
// Of the way: nearer than that a line touches a solid; and so many looks at most along one that runs beside it.
constexpr double kTouching = 1e-6;
constexpr int kMostLooks = 1000;

constexpr int kAcross = 32;  // cells along an edge of the cube of directions

struct Cell {
    int face;     // 2 axis + (negative)
    double u, v;  // on it, -1 .. 1
};

//      v ^     face + of axis k: u along axis k + 1, v along axis k + 2, as seen from the middle of the cube
//        +--> u
Cell cell_of(const Vec3& direction) {
    int axis;
    const double most = direction.cwiseAbs().maxCoeff(&axis);
    return {2 * axis + (direction[axis] < 0), direction[(axis + 1) % 3] / most, direction[(axis + 2) % 3] / most};
}

int place(double u) { return std::clamp(static_cast<int>(std::floor((u + 1) / 2 * kAcross)), 0, kAcross - 1); }

size_t index_of(int face, int u, int v) { return (static_cast<size_t>(face) * kAcross + u) * kAcross + v; }

// Where a ball of `radius` about `across`, `ahead` along a face's axis lies on the face; all of it, if it is not ahead.
struct Stretch {
    double least = -1, most = 1;

    Stretch(double across, double ahead, double radius) {
        if (ahead <= radius) return;
        const double near = 1 / (ahead - radius), far = 1 / (ahead + radius);
        least = std::min((across - radius) * near, (across - radius) * far);
        most = std::max((across + radius) * near, (across + radius) * far);
    }
    bool meets_face() const { return least <= 1 && most >= -1; }
};

bool crosses(const PlacedShape& solid, const Vec3& from, const Vec3& to) {
    const double length = (to - from).norm();
    double way = 0;
    for (int look = 0; look < kMostLooks && way < length; ++look) {
        const double gap = point_shape_distance(from + way / length * (to - from), solid).gap;
        if (gap <= kTouching * length) return true;
        way += gap;
    }
    return false;
}

}  // namespace

BlastShadow::BlastShadow(const StepContext& context, const Blast& blast, const FrameState& state)
    : center_(blast.center) {
    if (blast.shadow == Shadow::none) return;
    add_solids(context, state);
    if (blast.shadow == Shadow::all) add_fragments(context, state);
}

void BlastShadow::add_solids(const StepContext& context, const FrameState& state) {
    const Scene& scene = context.scene;
    const auto add = [&](const Shape& shape, const Pose& pose, MovableId owner) {
        const PlacedShape placed{shape, pose};
        if (point_shape_distance(center_, placed).gap > 0) solids_.push_back({placed, owner});
    };
    for (size_t c = 0; c < scene.colliders.size(); ++c)
        if (context.input.colliders[c].active)
            add(shape_at(scene.colliders[c].shape, context.input.colliders[c], 0), context.input.colliders[c].begin,
                MovableId::none());
    for (size_t r = 0; r < scene.rigid_bodies.size(); ++r) {
        const RigidBodyState& body = state.rigid_bodies[r];
        add(scene.rigid_bodies[r].shape, {body.position, body.orientation}, MovableId(context.n_particles() + r));
    }
}

void BlastShadow::add_fragments(const StepContext& context, const FrameState& state) {
    cells_.resize(index_of(6, 0, 0));
    for (size_t i = 0; i < context.n_particles(); ++i) {
        const Vec3 radii = kGapless * context.scene.rest.radii[i], center = state.position[i] - center_;
        const Mat3 to_unit = radii.cwiseInverse().asDiagonal() * state.orientation[i].conjugate().toRotationMatrix();
        if ((to_unit * center).squaredNorm() <= 1) continue;
        fragments_.push_back({center, to_unit, MovableId(i)});
        add_to_cells(static_cast<uint32_t>(fragments_.size() - 1), radii.maxCoeff());
    }
}

void BlastShadow::add_to_cells(uint32_t fragment, double radius) {
    const Vec3& center = fragments_[fragment].center;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const double ahead = face % 2 == 0 ? center[axis] : -center[axis];
        if (ahead + radius <= 0) continue;
        const Stretch u(center[(axis + 1) % 3], ahead, radius), v(center[(axis + 2) % 3], ahead, radius);
        if (!u.meets_face() || !v.meets_face()) continue;
        for (int i = place(u.least); i <= place(u.most); ++i)
            for (int j = place(v.least); j <= place(v.most); ++j) cells_[index_of(face, i, j)].push_back(fragment);
    }
}

bool BlastShadow::hides(MovableId movable, const Vec3& there) const {
    for (const Solid& solid : solids_)
        if (solid.owner != movable && crosses(solid.shape, center_, there)) return true;
    if (cells_.empty()) return false;
    const Vec3 way = there - center_;
    const Cell cell = cell_of(way);
    for (const uint32_t k : cells_[index_of(cell.face, place(cell.u), place(cell.v))]) {
        const Fragment& f = fragments_[k];
        if (f.owner == movable) continue;
        // Along the line p = s way, nearest to the unit ball's middle.
        const Vec3 from = -(f.to_unit * f.center), step = f.to_unit * way;
        const double s = std::clamp(-from.dot(step) / step.squaredNorm(), 0.0, 1.0);
        const bool is_in_it = (from + step).squaredNorm() <= 1;
        if (!is_in_it && (from + s * step).squaredNorm() <= 1) return true;
    }
    return false;
}

}  // namespace sunder
