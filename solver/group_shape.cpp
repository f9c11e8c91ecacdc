#include "solver/group_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "solver/data/frame_state.h"

namespace sunder {

namespace {

constexpr double kLeastWeight = 0.02;
constexpr double kFullWeightArea = 0.25;  // of the section of a cube of the fragments' volume

double edge_weight_of(const SimulationMesh& rest, const Edge& edge) {
    const double section = std::pow(rest.volume[edge.a] * rest.volume[edge.b], 1.0 / 3);
    return std::clamp(edge.area / (kFullWeightArea * section), kLeastWeight, 1.0);
}

// A ring on a face of a body has more members along the face than across it. Weighed by A_qq alone the group would be
// too stiff along it, 1.24 times on a face of a lattice and 1.67 times on an edge; weighed by s it is mu |F - R|^2 in
// every direction. Where the ring is thin, s falls with a: what few members tell of F there must not be blown up. Where
// it is flat they tell nothing, and their goal is carried by R as in the paper.
void balance_directions(const Mat3& A, GroupShape& io_shape) {
    constexpr double kThinnest = 0.25, kFlattest = 1e-6;
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A);
    const Vec3& a = eigen.eigenvalues();
    const Mat3& E = eigen.eigenvectors();
    const double mean = a.sum() / 3, most = a(2);
    Vec3 inverse = Vec3::Zero(), ratio = Vec3::Ones();
    for (int i = 0; i < 3; ++i) {
        if (!(a(i) > kFlattest * most)) continue;
        inverse(i) = 1 / a(i);
        ratio(i) = mean / std::max(a(i), kThinnest * most);
    }
    Mat3 isotropy, affine_inverse, stiffness_moment;
    affine_inverse = E * inverse.asDiagonal() * E.transpose();
    isotropy = E * ratio.asDiagonal() * E.transpose();
    io_shape.isotropy = to_sym(isotropy);
    io_shape.N = to_sym((Mat3::Identity() - isotropy) * affine_inverse);
    stiffness_moment = E * ratio.cwiseProduct(a).asDiagonal() * E.transpose();
    io_shape.stiffness_moment = to_sym(stiffness_moment);
    io_shape.most_isotropy = std::max(1.0, ratio.maxCoeff());
}

}  // namespace

std::vector<double> rest_traces(const SimulationMesh& rest) {
    std::vector<double> traces(rest.n_particles());
    for (uint32_t g = 0; g < traces.size(); ++g) {
        Vec3 center = Vec3::Zero();
        double mass = 0, second = 0;
        for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
            const uint32_t j = rest.group_member[s], e = rest.member_edge[s];
            const Vec3 r = rest.rest_position[j] - rest.rest_position[g];
            const double m = rest.mass[j] * (e == SimulationMesh::kNone ? 1.0 : edge_weight_of(rest, rest.edges[e]));
            mass += m, center += m * r, second += m * r.squaredNorm();
        }
        traces[g] = second - center.squaredNorm() / mass;
    }
    return traces;
}

void GroupShapes::find_moment(const SimulationMesh& rest, size_t i) {
    const Mat3 Rbar = rest.rest_orientation[i].toRotationMatrix();
    const Vec3 a = rest.mass[i] / 5.0 * rest.radii[i].cwiseProduct(rest.radii[i]);
    particle_moment[i] = to_sym(Rbar * a.asDiagonal() * Rbar.transpose());
}

void GroupShapes::renumber(const SimulationMesh& rest, const LiveTopology& live,
                           std::span<const Mat3> plastic_deformation, const FormerNumbers& former,
                           const WorkerPool& workers) {
    constexpr size_t kGrain = 256;  // fewest groups a thread is worth waking for
    const uint32_t n = static_cast<uint32_t>(rest.n_particles());
    std::swap(group, group_before_), std::swap(member, member_before_);
    const std::vector<Sym3> moment_before = std::move(particle_moment);
    group.resize(n), member.resize(live.n_slots()), particle_moment.resize(n);
    particle_mass = rest.mass;
    edge_weight.assign(rest.n_edges(), 0);  // of broken ones it does not matter
    rest_trace = rest.group_trace.empty() ? rest_traces(rest) : rest.group_trace;
    revision.assign(n, uint64_t{++resets_} << 32);
    const auto for_groups = [&](const auto& body) {
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t g = first; g < last; ++g) body(static_cast<uint32_t>(g), former.of[g]);
        });
    };
    // What groups are made of: moments, and weights of edges, each by the first of its ends.
    for_groups([&](uint32_t g, uint32_t before) {
        const bool is_known = before != FormerNumbers::kNone;
        if (is_known)
            particle_moment[g] = moment_before[before];
        else
            find_moment(rest, g);
        for (uint32_t s = live.begin(g), k = 0; s < live.end(g); ++s, ++k)
            if (live.member(s) > g)
                edge_weight[live.edge(s)] = is_known ? member_before_[former.live.begin(before) + k].weight
                                                     : edge_weight_of(rest, rest.edges[live.edge(s)]);
    });
    for_groups([&](uint32_t g, uint32_t before) {
        if (before != FormerNumbers::kNone) {
            const auto slots = member_before_.begin() + former.live.begin(before);
            std::copy_n(slots, live.count(g), member.begin() + live.begin(g));
            if (group_before_[before].plastic_key == plastic_key(plastic_deformation[g])) {
                group[g] = group_before_[before];
                return;
            }
        }
        rebuild(rest, live, plastic_deformation[g], g);
    });
}

void GroupShapes::reset(const SimulationMesh& rest, const LiveTopology& live,
                        std::span<const Mat3> plastic_deformation) {
    const size_t n = rest.n_particles();
    particle_mass = rest.mass;
    particle_moment.resize(n);
    for (size_t i = 0; i < n; ++i) find_moment(rest, i);
    edge_weight.resize(rest.n_edges());
    for (size_t e = 0; e < edge_weight.size(); ++e) edge_weight[e] = edge_weight_of(rest, rest.edges[e]);
    rest_trace = rest.group_trace.empty() ? rest_traces(rest) : rest.group_trace;
    group.assign(n, GroupShape());
    revision.assign(n, uint64_t{++resets_} << 32);
    member.assign(live.n_slots(), MemberShape{Vec3::Zero(), 0});
    for (uint32_t g = 0; g < n; ++g) rebuild(rest, live, plastic_deformation[g], g);
}

void GroupShapes::rebuild(const SimulationMesh& rest, const LiveTopology& live, const Mat3& F_P, uint32_t g) {
    ++revision[g];
    GroupShape& shape = group[g];
    shape.plastic_key = plastic_key(F_P);
    const uint32_t begin = live.begin(g), end = live.end(g);
    const Vec3& origin =
        rest.rest_position[g];  // sums relative to the centre: no cancellation far from the world's origin

    shape.mass = 0;
    Vec3 center = Vec3::Zero();
    for (uint32_t s = begin; s < end; ++s) {
        const uint32_t j = live.member(s);
        const double m = rest.mass[j] * weight(live.edge(s));
        shape.mass += m;
        center += m * (rest.rest_position[j] - origin);
    }
    center /= shape.mass;

    Sym3 positions = {}, moments = {};
    for (uint32_t s = begin; s < end; ++s) {
        const uint32_t j = live.member(s);
        MemberShape& m = member[s];
        m.weight = weight(live.edge(s));
        m.q = F_P * (rest.rest_position[j] - origin - center);
        const Vec3 mq = m.weight * rest.mass[j] * m.q;
        const Sym3 of_position = {mq.x() * m.q.x(), mq.y() * m.q.y(), mq.z() * m.q.z(),
                                  mq.x() * m.q.y(), mq.x() * m.q.z(), mq.y() * m.q.z()};
        const Sym3 of_ellipsoid = member_moment(live, s);
        for (size_t i = 0; i < 6; ++i) positions[i] += of_position[i], moments[i] += of_ellipsoid[i];
    }
    const Mat3 A_positions = to_matrix(positions);
    shape.positions_trace = end - begin > 1 ? A_positions.trace() : 0;
    const Mat3 A_qq = A_positions + kStretchMomentWeight * to_matrix(moments);
    shape.stretch = stretch_basis(A_qq);
    balance_directions(A_positions, shape);

    // Volume strain tr(R^T A_pq A_qq^-1) - 3, with the inverse bounded in thin directions: a flat group has no
    // stiffness of its own across the sheet, and an unbounded inverse would demand vanishing steps.
    constexpr double kThinnest = 0.25;
    const Mat3& V = shape.stretch.V;
    Vec3 inverse;
    const Sym3& Lam = shape.stretch.Lam;
    const double a_max = 1.0 / std::min({Lam[0], Lam[1], Lam[2]});
    for (int i = 0; i < 3; ++i) inverse(i) = 1.0 / std::max(1.0 / Lam[static_cast<size_t>(i)], kThinnest * a_max);
    Mat3 W;
    W = V * inverse.asDiagonal() * V.transpose();
    shape.volume_gradient = to_sym(W);
    shape.volume_rest = (A_positions * W).trace();
    shape.most_pressure = shape.positions_trace / std::sqrt(3.0) * W.norm();
}

GroupStiffness group_stiffness(const GroupShape& shape, double rest_trace, double rest_volume,
                               const Material& material) {
    GroupStiffness s;
    if (shape.positions_trace <= 0) return s;
    const double nu = material.poisson_ratio, mu = material.youngs_modulus / (2 * (1 + nu));
    s.k = 6 * mu * rest_volume / rest_trace;
    s.volume_ratio = nu / (1 - 2 * nu);
    return s;
}

}  // namespace sunder
