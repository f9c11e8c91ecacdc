#include "solver/matching/gauss_seidel.h"

#include "solver/data/invariant.h"
#include "solver/data/rotations.h"
#include "solver/matching/polar_decomposition.h"

namespace sunder {

void gauss_seidel_sweep(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                        std::span<const double> stiffness, std::span<const Role> role,
                        std::span<MovingParticle> io_particles, std::span<GroupGoal> io_goals) {
    SUNDER_ASSERT(io_goals.size() == rest.n_particles() && role.size() >= io_goals.size());
    for (uint32_t g = 0; g < io_goals.size(); ++g) {
        if (live.count(g) == 1) {
            io_goals[g].rotation = io_particles[g].d;
            continue;
        }
        const GroupMoments A = group_moments(live, shapes, io_particles, g);
        const Quat R = optimal_rotation(A.positions + kOrientationWeight * A.ellipsoids, io_goals[g].rotation);
        io_goals[g].rotation = R;
        const Mat3 matrix = R.toRotationMatrix();
        for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
            const ParticleId j = live.member(s);
            if (role[j] != Role::free) continue;
            MovingParticle& p = io_particles[j];
            const double k = stiffness[rest.material_of(g)] * shapes.member[s].weight;
            p.x += k * (A.center + matrix * shapes.member[s].q - p.x);
            p.d = slerp(p.d, k, R);
        }
    }
}

}  // namespace sunder
