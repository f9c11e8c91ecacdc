// Plastic flow and fracture of a substep.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <atomic>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/groups_by_size.h"
#include "solver/material/bending_flow.h"
#include "solver/material/group_stretch.h"
#include "solver/material/plasticity.h"
#include "solver/scene/ring_check.h"
#include "solver/substep.h"

namespace sunder {
namespace {

constexpr int kFracturePasses = 8;  // a substep, each after the last one's cuts let go
constexpr double kLeading = 0.8;    // what cuts in a pass is within a fifth of the piece's largest excess load

}  // namespace

// Optimal stretch of every group where things came to lie; flow above the yield strain; the load towards breaking.
Substep::Found Substep::flow_and_measure(double seconds) {
    if (n_particles() == 0) return {};
    std::atomic<bool> changed{false}, overloaded{false};
    const GroupStretcher stretcher(work.live, work.shapes, work.moving, work.goals);
    const auto four = [&](const uint32_t(&groups)[4], uint32_t n) {
        GroupStretches stretches;
        stretcher.measure(groups, stretches);
        // |log lambda| <= limit wherever |S - I| is below this: no need for the eigenvalues.
        std::array<bool, 4> is_strained;
        for (uint32_t i = 0; i < 4; ++i)
            is_strained[i] = !(stretches.deviation[i] < -math::expm1(-strain_limit(groups[i])));
        for (uint32_t i = 0; i < n; ++i) {
            const auto& q = stretches.rotation;
            work.goals[groups[i]].rotation = Quat(q[3][i], q[0][i], q[1][i], q[2][i]);
        }
        if (!measure && std::ranges::find(is_strained, true) == is_strained.end()) return;
        PrincipalLanes principal;
        stretcher.decompose(stretches, principal);
        GivingWay giving_way;
        for (uint32_t i = 0; i < n; ++i) {
            if (is_strained[i] && add_if_it_gives_way(groups[i], principal_stretch(principal, i), giving_way)) continue;
            if (measure) state.strain[groups[i]] = largest_strain(principal, i);
        }
        if (giving_way.n == 0) return;
        const Found found = give_way(giving_way, seconds, stretcher.kernels());
        if (found.changed) changed = true;
        if (found.overloaded) overloaded = true;
    };
    for_groups([&](size_t first, size_t last) {
        GroupsBySize waiting;
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            work.strains[g].load = 0;
            if (work.kept[g]) continue;
            const bool is_thin = !work.thin.empty() && work.thin[g];
            if (is_thin && work.bending.pulls(g)) {
                const Found found = flow_bent(g, seconds);
                if (found.changed) changed = true;
                if (found.overloaded) overloaded = true;
            } else if (work.live.count(g) == 1 || is_thin)
                state.strain[g] = 0;
            else if (measure || strain_limit(g) < kNever)
                waiting.add(g, work.live.count(g), four);
        }
        waiting.finish(four);
    });
    return {changed, overloaded};
}

// Below it no principal strain breaks a group.
double Substep::breaking_strain(ParticleIndex g) const {
    return sunder::breaking_strain(rest(), work.live, material_of(rest(), g, material(g)), g);
}

// Below it none lets it flow or break.
double Substep::strain_limit(ParticleIndex g) const { return std::min(state.yield[g], breaking_strain(g)); }

// Whether it flows or breaks.
bool Substep::add_if_it_gives_way(ParticleIndex g, const PrincipalStretch& principal, GivingWay& io_groups) const {
    const Vec3& e = principal.log_strain;
    const double mean = e.mean(), deviator = std::max(e(2) - mean, mean - e(0));
    const Material m = material_of(rest(), g, material(g));
    const auto breaking = [&](Strained how) { return sunder::breaking_strain(rest(), work.live, m, g, how); };
    const bool may_break = e(2) > breaking(Strained::pulled) || -e(0) > breaking(Strained::pressed);
    if (!(deviator > state.yield[g] || may_break)) return false;
    io_groups.index[io_groups.n] = ParticleId(size_t{g});
    io_groups.group[io_groups.n++] = {principal, m, {state.plastic_deformation[g], state.yield[g]}};
    return true;
}

Substep::Found Substep::give_way(GivingWay& io_groups, double seconds, const StretchKernels& kernels) {
    Found found;
    std::array<FlowResult, 4> results;
    flow({io_groups.group.data(), io_groups.n}, seconds, kernels, results);
    for (size_t i = 0; i < io_groups.n; ++i) {
        const ParticleId g = io_groups.index[i];
        const FlowingGroup& group = io_groups.group[i];
        const FlowResult& result = results[i];
        Quat& R = work.goals[g].rotation;
        state.strain[g] = result.elastic_log_strain.cwiseAbs().maxCoeff();
        if (group.stretch.reliable)
            work.strains[g] =
                rest().group_uneven[g] != 0
                    ? uneven_group_strain(result.elastic_log_strain, group.stretch.directions, R, group.material,
                                          {rest(), work.live, work.shapes, work.moving}, g)
                    : group_strain(result.elastic_log_strain, group.stretch.directions, R, group.material);
        if (result.flowed) {
            state.plastic_deformation[g] = group.plastic.F_P;
            state.yield[g] = group.plastic.yield;
            R = (R * result.spin).normalized();
            work.flowed[g] = 1;
        }
        found.changed |= result.flowed, found.overloaded |= work.strains[g].load > 1;
    }
    return found;
}

// A thin group, by the strain at its faces.
Substep::Found Substep::flow_bent(ParticleIndex g, double seconds) {
    std::vector<BentMember> members(work.live.count(g));
    const BendingShape& shape = work.bending.shape(g);
    const BentGroup group = bend(work.bending, work.live, work.moving, g, members);
    work.goals[g].rotation = Quat(Mat3(group.axes * group.R * shape.axes.transpose())).normalized();
    if (!measure && strain_limit(g) == kNever) return {};
    const Material own = material_of(rest(), g, material(g));
    BendingPlasticity plastic = {state.plastic_deformation[g], state.plastic_curvature[g], state.layer_strain[g],
                                 state.yield[g]};
    Found found;
    // What was rigid in a clamp that lets go bends, but not for good: what is bent beside it eases into it.
    const auto faces = flow_bending(shape, group, own, is_tied(g) ? 0 : seconds, plastic, found.changed);
    state.strain[g] = 0;
    for (size_t face = 0; face < faces.n; ++face) {
        const Eigen::SelfAdjointEigenSolver<Mat3> principal(faces.strain[face]);
        const Vec3 strain = principal.eigenvalues();
        const Mat3 directions = shape.axes * principal.eigenvectors();
        state.strain[g] = std::max(state.strain[g], strain.cwiseAbs().maxCoeff());
        const Quat& R = work.goals[g].rotation;
        const GroupStrain load = rest().group_uneven[g] != 0
                                     ? uneven_group_strain(strain, directions, R, own,
                                                           {rest(), work.live, work.shapes, work.moving}, g)
                                     : group_strain(strain, directions, R, own);
        if (load.load > work.strains[g].load) work.strains[g] = load;
    }
    found.overloaded = work.strains[g].load > 1;
    if (found.changed) {
        work.flowed[g] = plastic.F_P != state.plastic_deformation[g];
        state.plastic_deformation[g] = plastic.F_P, state.plastic_curvature[g] = plastic.K_P;
        state.layer_strain[g] = plastic.remainder, state.yield[g] = plastic.yield;
    }
    return found;
}

bool Substep::break_edges(Found found, double leading) {
    if (!found.changed && !found.overloaded) return false;
    const auto cuts = edges_to_cut({rest(), work.live, work.shapes, work.moving}, work.strains, leading, state.time + h,
                                   context.workers);
    std::vector<EdgeId> broken;
    for (const BrokenEdge& cut : cuts) {
        SUNDER_ASSERT(state.edge_intact[cut.edge]);
        state.edge_intact[cut.edge] = work.synced_edges[cut.edge] = 0;
        state.broken.push_back(cut);
        broken.push_back(cut.edge);
    }
    report.edges_broken += cuts.size();
    for (const ParticleId g : work.live.remove_edges(rest(), broken)) work.flowed[g] = 1;
    invariant("rings match edges", [&] { return rings_match_edges(work.live, rest(), state.edge_intact); });
    if (!cuts.empty()) {
        mark_held_pieces();
        work.detection.edges_broke();
    }
    // Rest shapes changed where material flowed or edges broke.
    for_groups([&](size_t first, size_t last) {
        work.shapes.rebuild(rest(), work.live, state.plastic_deformation, first, last,
                            [&](uint32_t g) { return work.flowed[g] != 0; });
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            if (!work.flowed[g]) continue;
            work.flowed[g] = 0;
            work.stiffness[g] =
                group_stiffness(work.shapes.group[g], work.shapes.rest_trace[g], rest().volume[g], material(g));
        }
    });
    return !cuts.empty();
}

// Cuts and starts the correction over until nothing breaks: a crack runs as far as the load that it releases lets it,
// and not one ring a substep. Only while nothing pushes: what contacts did was divided by the pieces as they were (see
// `break_in_hit`), and what parts along a crack may push, too.
bool Substep::run_cracks(bool has_flowed) {
    for (int pass = 0; pass < kFracturePasses; ++pass) {
        if (contacts_push()) return has_flowed;
        {
            Stopwatch watch(report.fracture_s);
            if (!break_edges(flow_and_measure(has_flowed ? 0 : h), kLeading)) return true;
        }
        has_flowed = true;
        take_up_pieces();
        take_up_smooth_momentum();
        for (size_t i = 0; i < n_particles(); ++i) {
            if (work.kept[i]) continue;
            MovingParticle& p = work.moving[i];
            p.x = p.x_inertial, p.d = p.d_inertial;
        }
        correct();
    }
    return true;
}

}  // namespace sunder
