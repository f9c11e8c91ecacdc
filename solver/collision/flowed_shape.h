// What contacts take a particle for once its material has flowed.
#pragma once

#include <span>
#include <vector>

#include "solver/data/simulation_mesh.h"
#include "solver/parallel.h"

namespace sunder {

/// An ellipsoid about a particle's centre, as it lies where the particle is not turned.
struct ContactShape {
    Quat orientation = Quat::Identity();  // of its axes
    Vec3 radii = Vec3::Ones();            // along them, m
    double corners = 0;                   // how far the fragment's hull stands out of it at most, m
};

/// The ellipsoid of a fragment whose material flowed by F_P (symmetric, det 1): F_P Rbar diag(r) of the unit ball,
/// whose principal frame and radii follow from L L^T, L = F_P Rbar diag(r). With F_P = I what it was at rest, to the
/// last bit. Elastic stretch is left out. What a contact pushes aside would make way to the contact, a substep later
/// and by the mean of a whole one-ring: a spring that is in no energy. Under load at rest it is below the yield strain.
ContactShape flowed_shape(const Quat& rest_orientation, const Vec3& radii, const Mat3& F_P);

/// Radius of a ball that holds flowed_shape, m; cheaper.
double flowed_radius(const Vec3& radii, const Mat3& F_P);

/// How two fragments of one body lie at rest: ellipsoids only stand in for pieces that fit without a gap.
struct RestFit {
    Vec3 normal = Vec3::UnitZ();  // best separating direction, unit, from j towards i
    double gap = 0;               // along it, m; negative: overlap
};
RestFit rest_fit(const SimulationMesh& rest, uint32_t i, uint32_t j);

/// The gap that they have after flow, at most 0, m: along the normal that flow makes of the one at rest, both shapes as
/// they flowed, their centres apart by what the F_P of both groups make of the way between them, in the mean. So where
/// a body flows evenly all of it is deformed alike, and what just touched does so still.
double fitting_gap(const SimulationMesh& rest, const RestFit& fit, const Mat3& F_i, const Mat3& F_j, uint32_t i,
                   uint32_t j);

/// How far the ellipsoid of a fragment stands out beyond the fragment's hull along `direction` (unit, where the
/// particle is not turned), m; less than 0 where the hull is farther, 0 where it is not known. Things that lie on one
/// another touch with their faces: along the normal of a contact both may come so much closer than their ellipsoids.
double standing_out(const ContactShape& shape, std::span<const Vec3f> hull, const Mat3& F_P, const Vec3& direction);

/// The shapes of all particles, made anew where F_P is not the one that they were made for.
class FlowedShapes {
public:
    /// Call when particles are others than before.
    void reset() { made_for_.clear(); }
    /// Call at the start of a substep.
    void update(const SimulationMesh& rest, std::span<const Mat3> plastic_deformation, const WorkerPool& workers);

    const ContactShape& operator[](uint32_t particle) const { return shape_[particle]; }

private:
    std::vector<Mat3> made_for_;       // F_P (n_particles)
    std::vector<ContactShape> shape_;  // (n_particles)
};

}  // namespace sunder
