#include "solver/matching/group_shape.h"

#include <algorithm>
#include <cstddef>

#include "solver/data/frame_state.h"
#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/lanes/instruction_set.h"

namespace sunder {

namespace {

constexpr double kLeastWeight = 0.02;
constexpr double kFullWeightArea = 0.25;  // of the section of a cube of the fragments' volume

double edge_weight_of(const SimulationMesh& rest, const Edge& edge) {
    const double section = math::cbrt(rest.volume[edge.a] * rest.volume[edge.b]);
    return std::clamp(edge.area / (kFullWeightArea * section), kLeastWeight, 1.0);
}

}  // namespace

std::vector<double> rest_traces(const SimulationMesh& rest) {
    std::vector<double> traces(rest.n_particles());
    for (uint32_t g = 0; g < traces.size(); ++g) {
        Vec3 center = Vec3::Zero();
        double mass = 0, second = 0;
        for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
            const ParticleId j = rest.group_member[s];
            const EdgeId e = rest.member_edge[s];
            const Vec3 r = rest.rest_position[j] - rest.rest_position[g];
            const double m = rest.mass[j] * (e.is_none() ? 1.0 : edge_weight_of(rest, rest.edges[e]));
            mass += m, center += m * r, second += m * r.squaredNorm();
        }
        traces[g] = second - center.squaredNorm() / mass;
    }
    return traces;
}

GroupShapes::GroupShapes() : kernels_(&SUNDER_BEST_KERNELS(kRestShapeKernels)) {}

void GroupShapes::find_moment(const SimulationMesh& rest, size_t i) {
    const Mat3 Rbar = rest.rest_orientation[i].toRotationMatrix();
    const Vec3 a = rest.mass[i] / 5.0 * rest.radii[i].cwiseProduct(rest.radii[i]);
    particle_moment[i] = to_sym(Rbar * a.asDiagonal() * Rbar.transpose());
}

void GroupShapes::renumber(const SimulationMesh& rest, const LiveTopology& live,
                           std::span<const Mat3> plastic_deformation, std::span<const double> edge_hold,
                           const FormerNumbers& former, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;  // fewest groups a thread is worth waking for
    const uint32_t n = static_cast<uint32_t>(rest.n_particles());
    SUNDER_ASSERT(former.of.size() == n && plastic_deformation.size() == n && live.ends().size() == n);
    std::swap(group, group_before_), std::swap(member, member_before_);
    const std::vector<Sym3> moment_before = std::move(particle_moment);
    group.resize(n), member.resize(live.n_slots()), particle_moment.resize(n);
    particle_mass = rest.mass;
    edge_weight.assign(rest.n_edges(), 0);  // of broken ones it does not matter
    rest_trace = rest.group_trace.empty() ? rest_traces(rest) : rest.group_trace;
    revision.assign(n, uint64_t{++resets_} << 32);
    // What groups are made of: moments, and weights of edges, each by the first of its ends.
    const auto take_parts = [&](ParticleIndex g) {
        const ParticleId before = former.of[g];
        const bool is_known = !before.is_none();
        if (is_known)
            particle_moment[g] = moment_before[before];
        else
            find_moment(rest, g);
        for (uint32_t s = live.begin(g), k = 0; s < live.end(g); ++s, ++k)
            if (live.member(s) > g)
                edge_weight[live.edge(s)] =
                    !edge_hold.empty() ? edge_hold[live.edge(s)] * edge_weight_of(rest, rest.edges[live.edge(s)])
                    : is_known         ? member_before_[former.live.begin(before) + k].weight
                                       : edge_weight_of(rest, rest.edges[live.edge(s)]);
    };
    const auto take_over = [&](ParticleIndex g) {  // whether the shape is as it was
        const ParticleId before = former.of[g];
        if (before.is_none() || group_before_[before].plastic_key != plastic_key(plastic_deformation[g])) return false;
        for (uint32_t s = live.begin(g), k = former.live.begin(before); !edge_hold.empty() && s < live.end(g); ++s, ++k)
            if (live.member(s) != g && member_before_[k].weight != edge_weight[live.edge(s)]) return false;
        std::copy_n(member_before_.begin() + former.live.begin(before), live.count(g), member.begin() + live.begin(g));
        group[g] = group_before_[before];
        return true;
    };
    workers.for_range(n, kGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g) take_parts(g);
    });
    workers.for_range(n, kGrain, [&](size_t first, size_t last) {
        rebuild(rest, live, plastic_deformation, first, last, [&](ParticleIndex g) { return !take_over(g); });
    });
}

void GroupShapes::reset(const SimulationMesh& rest, const LiveTopology& live, std::span<const Mat3> plastic_deformation,
                        std::span<const double> edge_hold) {
    const size_t n = rest.n_particles();
    SUNDER_ASSERT(plastic_deformation.size() == n && live.ends().size() == n && rest.mass.size() == n);
    particle_mass = rest.mass;
    particle_moment.resize(n);
    for (size_t i = 0; i < n; ++i) find_moment(rest, i);
    edge_weight.resize(rest.n_edges());
    for (size_t e = 0; e < edge_weight.size(); ++e) edge_weight[e] = edge_weight_of(rest, rest.edges[e]);
    for (size_t e = 0; e < edge_hold.size(); ++e) edge_weight[e] *= edge_hold[e];
    rest_trace = rest.group_trace.empty() ? rest_traces(rest) : rest.group_trace;
    group.assign(n, GroupShape());
    revision.assign(n, uint64_t{++resets_} << 32);
    member.assign(live.n_slots(), MemberShape{Vec3::Zero(), 0});
    rebuild(rest, live, plastic_deformation, 0, n, [](uint32_t) { return true; });
}

void GroupShapes::set_hold(const SimulationMesh& rest, EdgeId edge, double hold) {
    edge_weight[edge] = hold * edge_weight_of(rest, rest.edges[edge]);
}

void GroupShapes::rebuild_four(const SimulationMesh& rest, const LiveTopology& live,
                               std::span<const Mat3> plastic_deformation, const uint32_t (&groups)[4], uint32_t n) {
    static_assert(sizeof(GroupShape) == RestShapeRecords::kShapeNumbers * sizeof(double) &&
                  offsetof(GroupShape, plastic_key) == RestShapeRecords::kNumbers * sizeof(double));
    static_assert(sizeof(MemberShape) == RestShapeRecords::kMemberNumbers * sizeof(double));
    kernels_->build({rest.rest_position.data()->data(), plastic_deformation.data()->data(), particle_mass.data(),
                     particle_moment.data()->data(), edge_weight.data(), live.begins().data(), live.ends().data(),
                     numbers(live.members()).data(), numbers(live.edges()).data(), kStretchMomentWeight,
                     &group.data()->mass, member.data()->q.data()},
                    groups);
    for (uint32_t i = 0; i < n; ++i) {
        ++revision[groups[i]];
        group[groups[i]].plastic_key = plastic_key(plastic_deformation[groups[i]]);
    }
}

GroupStiffness group_stiffness(const GroupShape& shape, double rest_trace, double rest_volume,
                               const Material& material) {
    GroupStiffness s;
    if (shape.positions_trace <= 0) return s;
    SUNDER_ASSERT(rest_trace > 0 && rest_volume > 0);
    const double nu = material.poisson_ratio, mu = material.youngs_modulus / (2 * (1 + nu));
    s.k = 6 * mu * rest_volume / rest_trace;
    s.volume_ratio = nu / (1 - 2 * nu);
    return s;
}

}  // namespace sunder
