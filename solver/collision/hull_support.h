// What the hulls of fragments say about contacts between the ellipsoids that stand for them.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/data/simulation_mesh.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// How far the ellipsoid of particle i stands out beyond the hull of its fragment along `direction` (unit, where the
/// particle is not turned), m; less than 0 where the hull is farther, 0 where it is not known. The hull flows with the
/// material, the ellipsoid does not. Things that lie on one another touch with their faces: along the normal of a
/// contact both may come so much closer than their ellipsoids.
double standing_out(const SimulationMesh& rest, ParticleIndex i, const Mat3& F_P, const Vec3& direction);

/// The gaps of the ellipsoids of pairs of particles at rest, m; negative: they overlap, as those of neighbours do.
/// Writes out (n_pairs).
void rest_gaps(const SimulationMesh& rest, std::span<const std::pair<uint32_t, uint32_t>> pairs, double* out);

/// How far hulls stand out of their ellipsoids at most, found anew where F_P is not the one it was found for.
class HullReach {
public:
    /// Call when particles are others than before.
    void reset() { found_for_.clear(); }
    /// Call when particles were numbered anew; `former` (n_particles): as who they were known before, or kNone.
    void renumber(std::span<const ParticleId> former);
    /// Call at the start of a substep.
    void update(const SimulationMesh& rest, std::span<const Mat3> plastic_deformation, const WorkerPool& workers);

    std::span<const double> reach() const { return reach_; }  // (n_particles), m

private:
    std::vector<uint64_t> found_for_;  // plastic_key; 0: none (n_particles)
    std::vector<double> reach_;
};

}  // namespace sunder
