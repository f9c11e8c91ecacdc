// Contacts of movables with colliders.
#include <cmath>

#include "solver/collision/detection_parts.h"
#include "solver/collision/grid_contacts.h"
#include "solver/collision/surface_contacts.h"
#include "solver/data/rotations.h"

namespace sunder {
using namespace detail;
namespace {

// A collider, and what is the same for all that it may meet.
struct Met {
    explicit Met(const MovingShape& collider)
        : moving(collider),
          placed{collider.shape, collider.begin},
          box(bounding_box(placed)),
          angle(angle_between(collider.begin.orientation, collider.end.orientation)),
          stays(collider.begin.position == collider.end.position &&
                collider.begin.orientation.coeffs() == collider.end.orientation.coeffs()),
          plane_normal(collider.begin.orientation * Vec3::UnitZ()) {
        if (placed.shape.surface) {
            const Aabb end = bounding_box(at_end(collider));
            box.extend(end.min), box.extend(end.max);
        }
    }
    const MovingShape& moving;
    PlacedShape placed;
    Aabb box;
    double angle;  // by which it turns, rad
    bool stays;    // and does not move
    Vec3 plane_normal;

    // More than where it is and its way are rounded by, m.
    double rounding(const Vec3& center, const Vec3& shift) const {
        return kRounding * (center - placed.pose.position).cwiseAbs().maxCoeff() +
               kRounding * (placed.pose.position.cwiseAbs().maxCoeff() + shift.cwiseAbs().maxCoeff());
    }

    // It stays on its side of the plane, whatever its shape.
    bool is_plane_beyond(const Vec3& center, double radius, const Vec3& shift, double reach) const {
        if (placed.shape.kind != ShapeKind::plane) return false;
        const double height = plane_normal.dot(center - placed.pose.position), approach = -plane_normal.dot(shift);
        return height - radius - std::max(approach, 0.0) - kRounding * (std::abs(height) + radius) > reach;
    }
};

void contacts_with_collider(const DetectionInput& in, MovableId i, const Met& met, MovableId collider,
                            std::vector<Separation>& io_on_mesh, std::vector<Contact>& out) {
    const PlacedShape& placed = met.placed;
    const Vec3 own_shift = in.duration * in.velocity[i];
    const double own = is_particle(in, i) ? in.particles.radii[i].maxCoeff() : bounding_radius(rigid(in, i).shape);
    const bool by_corners = placed.shape.kind == ShapeKind::plane && is_particle(in, i) && !in.corners.empty();
    const double corners = by_corners ? in.corners[i] : 0.0;
    const double turning = std::min(met.angle, 1.0) * own;  // across the size of a, the collider's field differs
    const double reach = in.margin + turning_reach(in, i) + turning + corners;
    // Most things are above the floor by more than any rounding of what follows.
    if (met.stays && met.is_plane_beyond(center(in, i), own, own_shift, reach + met.rounding(center(in, i), own_shift)))
        return;
    const Vec3 shift = shift_seen_from(met.moving.begin, met.moving.end, center(in, i), own_shift);
    // Here the collider stands still and its motion is a's: so its box needs no sweep, but a's box does.
    Aabb box = swept_box(in, i, Vec3::Zero());
    const Vec3 slack = Vec3::Constant(0.5 * in.margin), further = shift - own_shift;
    box.min += further.cwiseMin(0.0) - slack;
    box.max += further.cwiseMax(0.0) + slack;
    box.min.array() -= turning + corners;
    box.max.array() += turning + corners;
    if (!overlap(box, met.box)) return;
    if (met.is_plane_beyond(center(in, i), own, shift, reach)) return;
    if (placed.shape.surface) {
        if (is_particle(in, i))
            surface_contacts(in.particles[i], met.moving, shift, reach, io_on_mesh);
        else
            surface_contacts(rigid(in, i), met.moving, shift, reach, io_on_mesh);
        for (const Separation& s : io_on_mesh) add(i, collider, s, out);
    } else if (placed.shape.kind == ShapeKind::mesh) {
        if (is_particle(in, i))
            grid_contacts(in.particles[i], placed, shift, reach, io_on_mesh);
        else
            grid_contacts(rigid(in, i), placed, shift, reach, io_on_mesh);
        for (const Separation& s : io_on_mesh) add(i, collider, s, out);
    } else if (is_particle(in, i)) {
        const auto at = [&](const Vec3& offset) {
            Ellipsoid a = in.particles[i];
            a.center += offset;
            return ellipsoid_shape_distance(a, placed);
        };
        add_single(i, collider, at, shift, reach, out);
    } else {
        add_manifold(i, collider, rigid(in, i), placed, shift, reach, out);
    }
}

}  // namespace

void contacts_with_colliders(const DetectionInput& in, size_t begin, size_t end, std::vector<Contact>& out) {
    std::vector<Met> met;
    std::vector<Separation> on_mesh;
    for (const MovingShape& collider : in.colliders) met.emplace_back(collider);
    for (MovableId i(begin); i < end; ++i) {
        if (is_driven(in, i)) continue;
        for (uint32_t c = 0; c < met.size(); ++c)
            if (met[c].moving.active) contacts_with_collider(in, i, met[c], Contact::collider(c), on_mesh, out);
    }
}

}  // namespace sunder
