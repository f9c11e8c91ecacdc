// What a group knows of its own rest shape, plastic deformation included. Rebuilt only where edges broke or plastic
// flow took place.
#pragma once

#include <span>
#include <vector>

#include "solver/data/ids.h"
#include "solver/data/simulation_mesh.h"
#include "solver/matching/groups_by_size.h"
#include "solver/matching/optimal_stretch.h"
#include "solver/matching/rest_shape_kernels.h"
#include "solver/scene/live_topology.h"
#include "solver/scene/scene.h"

namespace sunder {

/// One member of one group. Its weight is that of the interface to the centre: w = A / (V_g V_j)^(1/3) times 4, within
/// [0.02, 1]; 1 for the centre. A neighbour across a sliver, or across the corner of a lattice cell, hardly counts: the
/// strain of the group is then that of its middle, not a mean over all that it touches.
struct alignas(32) MemberShape {
    Vec3 q;         // F_P (xbar_j - cbar), m; mass-weighted sum over the group is zero
    double weight;  // w_gj, -
};

/// One group. `A_qq` below weighs the ellipsoid terms by kStretchMomentWeight.
struct GroupShape {
    double mass = 0;             // M, kg
    double positions_trace = 0;  // tr of the members' part of A_qq, kg m2; 0 for a lone particle
    StretchBasis stretch;        // of A_qq
    // Of the members' part of A_qq, sum a_i e_i e_i^T:
    Sym3 isotropy = {1, 1, 1};   // Q = sum (s_i / a_i) e_i e_i^T, s_i = tr / 3 bounded in thin directions; s_i = a_i
                                 // in flat ones
    Sym3 N = {};                 // (I - Q) A^+, A^+ pseudo-inverse, 1/(kg m2): F (I - Q) = A_pq N
    Sym3 stiffness_moment = {};  // sum s_i e_i e_i^T, kg m2
    Sym3 volume_gradient = {};   // W ~ A_qq^-1, bounded: tr(R^T A_pq W) - volume_rest measures volume strain
    double volume_rest = 0;      // tr(A_qq W)
    double most_isotropy = 1;    // largest s_i / a_i, or 1
    double most_pressure = 0;    // norm of what pressure adds to a goal, for a volume ratio of 1
    uint64_t plastic_key = 0;    // of the F_P that it was built with (frame_state.h)
};

/// Weight of the ellipsoids in the optimal stretch (Eq. 7). Orientations do not stretch, so at full weight they hide
/// 5 to 35 % of the strain, depending on radius and neighbourhood; at 0 flat groups have no inverse.
constexpr double kStretchMomentWeight = 0.02;

/// Weight of the ellipsoids in the optimal rotation and of the pull on orientations. At full weight a rod one particle
/// wide is 6.6 times stiffer in torsion than mu 0.1406 d^4 of the solid one, and thicker ones are too stiff as well.
constexpr double kOrientationWeight = 0.15;

/// Particles as they were numbered before.
struct FormerNumbers {
    std::span<const ParticleId> of;  // those who are known from before, ascending; else none (n_particles)
    const LiveTopology& live;        // before
};

struct GroupShapes {
    GroupShapes();

    std::vector<GroupShape> group;      // (n_particles)
    std::vector<MemberShape> member;    // as LiveTopology's slots
    std::vector<double> edge_weight;    // w_gj of the edge's two particles in each other's group (n_edges)
    std::vector<double> rest_trace;     // positions_trace of the whole one-ring before any flow (n_particles), kg m2
    std::vector<uint64_t> revision;     // of each group: another after every change (n_particles)
    std::vector<double> particle_mass;  // m_j, kg (n_particles)
    std::vector<Sym3> particle_moment;  // Rbar_j A_j Rbar_j^T, A_j = m_j/5 diag(a2, b2, c2), kg m2 (n_particles)

    /// w_gj m_j of the member in a slot, kg.
    double member_mass(const LiveTopology& live, uint32_t slot) const {
        return member[slot].weight * particle_mass[live.member(slot)];
    }
    /// w_gj M_j of the member in a slot, M_j its ellipsoid's moment, kg m2.
    Sym3 member_moment(const LiveTopology& live, uint32_t slot) const {
        Sym3 moment = particle_moment[live.member(slot)];
        for (double& number : moment) number *= member[slot].weight;
        return moment;
    }

    /// `edge_hold`: FrameState's; empty: all is sound.
    void reset(const SimulationMesh& rest, const LiveTopology& live, std::span<const Mat3> plastic_deformation,
               std::span<const double> edge_hold = {});
    /// The same for particles that were numbered anew, those with a former number having kept their rings; shapes whose
    /// F_P stayed are taken over.
    void renumber(const SimulationMesh& rest, const LiveTopology& live, std::span<const Mat3> plastic_deformation,
                  std::span<const double> edge_hold, const FormerNumbers& former, const WorkerPool& workers);
    /// Of an edge whose hold changed; then its two groups are to be made anew.
    void set_hold(const SimulationMesh& rest, EdgeId edge, double hold);
    /// Anew those of the groups [first, last) of which `has_changed(group)` says so. No bit of a shape depends on which
    /// others are built with it.
    template <class HasChanged>
    void rebuild(const SimulationMesh& rest, const LiveTopology& live, std::span<const Mat3> plastic_deformation,
                 size_t first, size_t last, const HasChanged& has_changed) {
        const auto four = [&](const uint32_t(&groups)[4], uint32_t n) {
            rebuild_four(rest, live, plastic_deformation, groups, n);
        };
        GroupsBySize waiting;
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g)
            if (has_changed(g)) waiting.add(g, live.count(g), four);
        waiting.finish(four);
    }

private:
    void rebuild_four(const SimulationMesh& rest, const LiveTopology& live, std::span<const Mat3> plastic_deformation,
                      const uint32_t (&groups)[4], uint32_t n);
    void find_moment(const SimulationMesh& rest, size_t i);
    const RestShapeKernels* kernels_;
    uint32_t resets_ = 0;
    std::vector<GroupShape> group_before_;  // of renumber: kept, for fresh memory costs more than the copies
    std::vector<MemberShape> member_before_;
};

/// positions_trace of every whole one-ring before any flow, kg m2.
std::vector<double> rest_traces(const SimulationMesh& rest);

/// Compliance and volume response of a group, from its material and rest shape.
struct GroupStiffness {
    double k = 0;             // 1/alpha_g = 6 mu V_g / rest_trace, 1/s2: E/V = mu |F - R|^2 for any mesh
    double volume_ratio = 0;  // lambda_Lame / (2 mu) = nu / (1 - 2 nu)
};

/// k belongs to the whole one-ring at rest and stays when edges break or material flows: with fixed k, taking a member
/// out of a group can only lower its energy, so that no cut ever adds any; and a crushed pair does not become rigid.
GroupStiffness group_stiffness(const GroupShape& shape, double rest_trace, double rest_volume,
                               const Material& material);

}  // namespace sunder
