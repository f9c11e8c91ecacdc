#include "solver/collision/surface_contacts.h"

#include <algorithm>

#include "solver/collision/solid_sweep.h"
#include "solver/collision/surface_distance.h"

namespace sunder {
namespace {

// The box of a way, as the mesh sees it.
Aabb box_of_way(const Vec3& begin, const Vec3& shift, double reach, const Pose& pose) {
    Aabb box;
    box.extend(pose.inverse_apply(begin)), box.extend(pose.inverse_apply(begin + shift));
    box.min.array() -= reach, box.max.array() += reach;
    return box;
}

// A mesh that deforms: progress is a share of the step, by which solid and surface come nearer by no more than `speed`.
class MovingMesh {
public:
    static constexpr double kAhead = 2;
    static constexpr bool kSeesRest = true;

    MovingMesh(const MovingShape& mesh, const Vec3& shift, const SurfaceField& field, double speed)
        : mesh_(mesh), shift_(shift), field_(field), speed_(speed) {}

    const Pose& pose() const { return mesh_.begin; }
    double end() const { return 1; }
    const SurfaceField& at(double moment) {
        return field_ = field_.at(mesh_.shape.share + moment * (mesh_.end_share - mesh_.shape.share));
    }
    Vec3 offset(double moment) const { return moment * shift_; }
    double after(double moment, double gap, double reach) const {
        return speed_ > 0 ? std::min(1.0, moment + (gap - 0.5 * reach) / speed_) : 1;
    }
    double later(double moment, double share) const { return std::min(1.0, moment + share); }
    double room_left(double moment) const { return (1 - moment) * speed_; }
    double way_left(double moment, double way) const { return (1 - moment) * way; }
    Vec3 surface_way(const Vec3& point) const {
        return (mesh_.end_share - mesh_.shape.share) *
               (mesh_.begin.orientation * way_at(field_, mesh_.begin.inverse_apply(point)));
    }
    Vec3 part_of(const Vec3& way, double moment) const { return moment * way; }

private:
    const MovingShape& mesh_;
    const Vec3& shift_;
    SurfaceField field_;
    const double speed_;
};

template <class Solid>
void sweep(const Solid& a, const MovingShape& mesh, const Vec3& shift, double reach, std::vector<Separation>& out) {
    out.clear();
    const Mover<Solid> mover = mover_of(a);
    const SurfaceField field(mesh.shape);
    const Aabb box = box_of_way(mover.center, shift, mover.farthest + reach, mesh.begin);
    const auto fastest = fastest_in(field, mesh.end_share, box);
    // Deep inside no triangle is near.
    if (!fastest && sample(field, mesh.begin.inverse_apply(mover.center)).distance >= 0) return;
    MovingMesh moving(mesh, shift, field, shift.norm() + fastest.value_or(0));
    SolidSweep(mover, moving, shift, reach, out).run();
}

}  // namespace

PlacedShape at_end(const MovingShape& mesh) {
    PlacedShape placed{mesh.shape, mesh.begin};
    placed.shape.share = mesh.end_share;
    return placed;
}

void surface_contacts(const Ellipsoid& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out) {
    sweep(a, mesh, shift, reach, out);
}

void surface_contacts(const PlacedShape& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out) {
    sweep(a, mesh, shift, reach, out);
}

Vec3 surface_motion(const MovingShape& mesh, const Vec3& point) {
    const Vec3 local = mesh.begin.inverse_apply(point);
    const Vec3 way = (mesh.end_share - mesh.shape.share) * way_at(SurfaceField(mesh.shape), local);
    return mesh.end.apply(local + way) - point;
}

}  // namespace sunder
