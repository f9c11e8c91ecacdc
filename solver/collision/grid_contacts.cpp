#include "solver/collision/grid_contacts.h"

#include <algorithm>

#include "solver/collision/solid_sweep.h"

namespace sunder {
namespace {

// A mesh that stands still: progress is the way, m.
class StandingMesh {
public:
    static constexpr double kAhead = 1;
    static constexpr bool kSeesRest = false;

    StandingMesh(const PlacedShape& mesh, const Vec3& shift) : mesh_(mesh), shift_(shift), way_(shift.norm()) {}

    const Pose& pose() const { return mesh_.pose; }
    double end() const { return way_; }
    const SignedDistanceGrid& at(double) const { return *mesh_.shape.grid; }
    Vec3 offset(double way) const { return way_ > 0 ? Vec3(way / way_ * shift_) : Vec3(Vec3::Zero()); }
    double after(double way, double gap, double reach) const { return std::min(way_, way + gap - 0.5 * reach); }
    double later(double way, double share) const { return std::min(way_, way + share * way_); }
    double room_left(double way) const { return way_ - way; }
    double way_left(double way, double) const { return way_ - way; }
    Vec3 surface_way(const Vec3&) const { return Vec3::Zero(); }
    Vec3 part_of(const Vec3& way, double) const { return way; }

private:
    const PlacedShape& mesh_;
    const Vec3& shift_;
    const double way_;
};

template <class Solid>
void sweep(const Solid& a, const PlacedShape& mesh, const Vec3& shift, double reach, std::vector<Separation>& out) {
    out.clear();
    const Mover<Solid> mover = mover_of(a);
    StandingMesh standing(mesh, shift);
    SolidSweep(mover, standing, shift, reach, out).run();
}

}  // namespace

void grid_contacts(const Ellipsoid& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out) {
    sweep(a, mesh, shift, reach, out);
}

void grid_contacts(const PlacedShape& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out) {
    sweep(a, mesh, shift, reach, out);
}

}  // namespace sunder
