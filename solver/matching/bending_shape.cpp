#include "solver/matching/bending_shape.h"

#include <Eigen/Dense>
#include <algorithm>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/arc.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/matching/thin_groups.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

constexpr double kShearFactor = 5.0 / 6;  // of a rectangular section (Timoshenko)
constexpr double kPinnedWeight = 4;       // of a pinned neighbour, which stands at half its distance
constexpr double kSmallestSpan = 1e-9;    // of A's largest eigenvalue: smaller ones have no inverse

// The `rank` largest principal directions of A, as A^+ and as a projection.
struct Span {
    Mat3 inverse = Mat3::Zero(), projection = Mat3::Zero();

    Span(const Mat3& A, int rank) {
        const Eigen::SelfAdjointEigenSolver<Mat3> of(A);
        for (int i = 3 - rank; i < 3; ++i) {
            if (!(of.eigenvalues()[i] > kSmallestSpan * of.eigenvalues()[2])) continue;
            const Vec3 e = of.eigenvectors().col(i);
            projection += e * e.transpose(), inverse += e * e.transpose() / of.eigenvalues()[i];
        }
    }
};

// tr A_qq of the whole ring at rest about the cell; a pinned member weighs four times as much at half its distance.
double trace_about_cell(const SimulationMesh& rest, const GroupShapes& shapes, ParticleIndex g) {
    static_assert(kPinnedWeight == 4);
    double trace = 0;
    for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
        const ParticleId j = rest.group_member[s];
        if (j != g)
            trace += shapes.edge_weight[rest.member_edge[s]] * rest.mass[j] *
                     (rest.rest_position[j] - rest.rest_position[g]).squaredNorm();
    }
    return trace;
}

void add_row(std::initializer_list<std::pair<int, double>> terms, double factor, Mat9& io_form) {
    Vec9 row = Vec9::Zero();
    for (const auto& [i, number] : terms) row[i] += number;
    io_form += factor * row * row.transpose();
}

// The energy of bending and twist of the fragment's own section, as a form of K.
Mat9 bending_form(const BendingShape& s, const Vec3& rho2) {
    const auto at = [](int row, int column) { return row + 3 * column; };
    const double EV = s.youngs_modulus() * s.volume, muV = s.mu * s.volume;
    Mat9 form = Mat9::Zero();
    if (s.rank == 1) {
        const int a = s.axis, i = (a + 1) % 3, k = (a + 2) % 3;
        const double thin = std::min(rho2[i], rho2[k]), wide = std::max(rho2[i], rho2[k]);
        const double ratio = std::sqrt(thin / wide);
        const double ratio2 = ratio * ratio;
        add_row({{at(i, a), 1}}, EV * rho2[k], form);
        add_row({{at(k, a), 1}}, EV * rho2[i], form);
        // Torsion constant of a rectangle over its area (Roark): J = 4 rho^2 (1 - 0.63 s + 0.052 s^5).
        add_row({{at(a, a), 1}}, muV * 4 * thin * (1 - 0.63 * ratio + 0.052 * ratio2 * ratio2 * ratio), form);
        return form;
    }
    const int n = s.normal, i = (n + 1) % 3, j = (n + 2) % 3;
    add_row({{at(j, i), 1}}, 2 * muV * rho2[n], form);
    add_row({{at(i, j), 1}}, 2 * muV * rho2[n], form);
    add_row({{at(j, i), 1}, {at(i, j), -1}}, s.pressure() * s.volume * rho2[n], form);
    add_row({{at(j, j), 0.5}, {at(i, i), -0.5}}, 4 * muV * rho2[n], form);
    add_row({{at(n, i), 1}}, EV * rho2[j], form);
    add_row({{at(n, j), 1}}, EV * rho2[i], form);
    return form;
}

// What a motion of three numbers does to a group, and the Hessian of the group's energy at rest along it.
struct OwnMotion {
    std::vector<Mat3> shift, turn;  // of p_j, of phi_j (members)
    Mat3 K[3];                      // columns of K

    Mat3 hessian(const BendingShape& s, std::span<const BendingMember> members) const {
        const Mat3 X = s.softness.asDiagonal(), Gamma = s.turn_moment.asDiagonal();
        Mat3 H = Mat3::Zero(), F[3] = {H, H, H}, mean = H;
        for (size_t j = 0; j < members.size(); ++j) mean += members[j].mean_part * shift[j];
        for (size_t j = 0; j < members.size(); ++j) {
            const Mat3 own = shift[j] - mean;
            H += s.k * members[j].weight * (own.transpose() * X * own + turn[j].transpose() * Gamma * turn[j]);
            for (int c = 0; c < 3; ++c) F[c] += members[j].pull[c] * own;
        }
        const double muV2 = 2 * s.mu * s.volume;
        Mat3 torque = Mat3::Zero();
        Eigen::RowVector3d trace = Eigen::RowVector3d::Zero();
        for (int c = 0; c < 3; ++c) {
            H += muV2 * F[c].transpose() * F[c];
            torque += muV2 * cross_matrix(s.spanned.col(c)) * F[c];
            trace += s.spanned.col(c).transpose() * F[c];
            for (int d = 0; d < 3; ++d) {
                H -= s.k * s.A(c, d) * F[c].transpose() * X * F[d];
                H += K[c].transpose() * s.bending_less_turns.block<3, 3>(3 * c, 3 * d) * K[d];
            }
        }
        H += s.pressure() * s.volume * trace.transpose() * trace;
        Mat3 held = muV2 * (s.spanned.trace() * Mat3::Identity() - s.spanned);
        held += Mat3((s.volume * s.shear).asDiagonal());
        return H - torque.transpose() * held.inverse() * torque;
    }
};

}  // namespace

void BendingShapes::update(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const GroupStiffness> stiffness, const Bending& bending,
                           const WorkerPool& workers) {
    const size_t n = bending.thin.size();
    SUNDER_ASSERT(n == rest.n_particles() && bending.pinned.size() == n && bending.plastic_deformation.size() == n);
    SUNDER_ASSERT(bending.plastic_curvature.empty() || bending.plastic_curvature.size() == n);
    SUNDER_ASSERT(stiffness.size() == n && shapes.revision.size() == n);
    if (member_.size() != live.n_slots() || version_ != live.version() || !std::ranges::equal(thin_, bending.thin) ||
        !std::ranges::equal(pinned_, bending.pinned)) {
        shape_.assign(n, {}), member_.assign(live.n_slots(), {}), key_.assign(n, {});
        curvature_.assign(n, Mat3::Zero()), thin_.assign(bending.thin.begin(), bending.thin.end());
        pinned_.assign(bending.pinned.begin(), bending.pinned.end());
        version_ = live.version();
    }
    workers.for_range(n, kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g) {
            if (!bending.thin[g] || bending.pinned[g] || live.count(g) < 2) continue;
            take_up_offsets(rest, live, bending.edge_offset, g);
            const Key key = {shapes.revision[g], stiffness[g].k, stiffness[g].volume_ratio};
            Mat3 curvature = Mat3::Zero();
            if (!bending.plastic_curvature.empty()) curvature = bending.plastic_curvature[g];
            if (key == key_[g] && curvature == curvature_[g]) continue;
            key_[g] = key, curvature_[g] = curvature;
            build(rest, live, shapes, stiffness[g], bending, g);
        }
    });
}

void BendingShapes::take_up_offsets(const SimulationMesh& rest, const LiveTopology& live,
                                    std::span<const EdgeOffsets> offsets, ParticleIndex g) {
    for (uint32_t slot = live.begin(g); slot < live.end(g) && !offsets.empty(); ++slot)
        if (const EdgeId e = live.edge(slot); !e.is_none()) member_[slot].own = offsets[e][rest.edges[e].b == g];
}

void BendingShapes::build(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                          const GroupStiffness& stiffness, const Bending& bending, ParticleIndex g) {
    BendingShape s;
    s.axes = rest.rest_orientation[g].toRotationMatrix();
    s.volume = rest.volume[g];
    s.plastic_curvature = curvature_[g];
    s.mu = stiffness.k * shapes.rest_trace[g] / (6 * s.volume);
    s.nu = stiffness.volume_ratio / (1 + 2 * stiffness.volume_ratio);
    const Vec3 rho2 = section_moments(rest, g);
    s.extent = (12 * rho2).cwiseSqrt();
    const std::span<BendingMember> members(member_.data() + live.begin(g), live.count(g));
    Cover cover(rest, g);
    double mass = 0, neighbours = 0;
    Vec3 mean = Vec3::Zero();
    for (uint32_t slot = live.begin(g); slot < live.end(g); ++slot) {
        const ParticleId j = live.member(slot);
        BendingMember& m = members[slot - live.begin(g)];
        const bool pinned = bending.pinned[j] != 0;
        const Vec3 x = rest.rest_position[j] - rest.rest_position[g];
        m.offset = pinned ? Vec3(-0.5 * x) : Vec3(Vec3::Zero());
        m.weight = shapes.member_mass(live, slot) * (pinned ? kPinnedWeight : 1);
        m.arm = s.axes.transpose() * (bending.plastic_deformation[g] * (x + m.offset));
        s.is_pinned |= pinned;
        mass += m.weight, mean += m.weight * m.arm;
        if (j == g) continue;
        cover.add(rest, g, j, rest.edges[live.edge(slot)].area);
        s.reach2 += m.weight * m.arm.squaredNorm(), neighbours += m.weight;
    }
    s.reach2 /= neighbours;
    s.rank = std::max(1, std::min(2, cover.directions()));
    s.normal = cover.least(), s.axis = cover.most();
    mean = s.is_pinned ? Vec3(Vec3::Zero()) : Vec3(mean / mass);
    s.A.setZero(), s.A_arm.setZero(), s.pull_sum.setZero();
    for (uint32_t slot = live.begin(g); slot < live.end(g); ++slot) {
        BendingMember& m = members[slot - live.begin(g)];
        m.mean_part = s.is_pinned ? (live.member(slot) == g ? 1.0 : 0.0) : m.weight / mass;
        m.q = m.arm - mean;
        s.A += m.weight * m.q * m.q.transpose();
        s.A_arm += m.weight * m.arm * m.arm.transpose();
    }
    const Span span(s.A, s.rank), span_arm(s.A_arm, s.rank);
    s.spanned = span.projection;
    for (BendingMember& m : members) {
        m.pull = m.weight * (span.inverse * m.q);
        m.pull_arm = m.weight * (span_arm.inverse * m.arm);
        s.pull_sum += m.pull;
    }
    s.k = 6 * s.mu * s.volume / (s.is_pinned ? trace_about_cell(rest, shapes, g) : shapes.rest_trace[g]);
    // chi(t) = 1 / (1 + (5/6) (mu/E) d^2/t^2): no shear is stiffer than a cell's bending (MacNeal's residual bending
    // flexibility), or wide cells lock.
    const auto chi = [&](double t2) { return 1 / (1 + kShearFactor * s.mu / s.youngs_modulus() * s.reach2 / t2); };
    const Vec3 t2 = 12 * rho2;
    for (int i = 0; i < 3; ++i) {
        const double thinner = std::min(t2[(i + 1) % 3], t2[(i + 2) % 3]);
        const bool lies_in_sheet = s.rank == 2 && i != s.normal;
        s.softness[i] = lies_in_sheet ? 1 : chi(t2[i]);
        s.turn_moment[i] = thinner / 12;
        s.shear[i] = s.mu / (1 / (chi(thinner) * kShearFactor) - 0.5);
    }
    s.bending = s.bending_less_turns = bending_form(s, rho2);
    for (int c = 0; c < 3; ++c)
        for (int d = 0; d < 3; ++d)
            s.bending_less_turns.block<3, 3>(3 * c, 3 * d) -= Mat3((s.k * s.A_arm(c, d) * s.turn_moment).asDiagonal());
    shape_[g] = s;
    find_blocks(live, g);
}

void BendingShapes::find_blocks(const LiveTopology& live, ParticleIndex g) {
    const BendingShape& s = shape_[g];
    const std::span<BendingMember> members(member_.data() + live.begin(g), live.count(g));
    const size_t n = members.size();
    std::vector<Mat3> rate(n);
    std::vector<Vec3> lever(n);
    Vec3 mean = Vec3::Zero();
    for (size_t j = 0; j < n; ++j) {
        const Arc arc(s.plastic_curvature * members[j].arm, members[j].arm);
        rate[j] = arc.rate, lever[j] = members[j].q + arc.place;
        mean += members[j].mean_part * lever[j];
    }
    OwnMotion motion;
    // Shifts and turns of the whole bent shape by K.
    const auto bend_by_K = [&] {
        for (size_t i = 0; i < n; ++i)
            for (int c = 0; c < 3; ++c) motion.shift[i] -= members[i].arm[c] * rate[i] * motion.K[c];
    };
    for (size_t j = 0; j < n; ++j) {
        motion.shift.assign(n, Mat3::Zero()), motion.turn.assign(n, Mat3::Zero());
        std::ranges::fill(motion.K, Mat3::Zero());
        motion.shift[j].setIdentity();
        members[j].shift_block = motion.hessian(s, members);
        motion.shift[j].setZero();
        const bool is_cell = live.member(live.begin(g) + static_cast<uint32_t>(j)) == g;
        for (size_t i = 0; i < n; ++i) {
            if (!is_cell && i != j) continue;
            if (is_cell) motion.shift[i] = cross_matrix(lever[i] - mean);
            if (is_cell && i == j) continue;
            const double sign = is_cell ? -1 : 1;
            motion.turn[i] = sign * Mat3::Identity();
            for (int c = 0; c < 3; ++c) motion.K[c] += sign * members[i].pull_arm[c] * Mat3::Identity();
        }
        bend_by_K();
        members[j].turn_block = motion.hessian(s, members);
    }
}

BentGroup bend(const BendingShapes& shapes, const LiveTopology& live, std::span<const MovingParticle> particles,
               ParticleIndex g, std::span<BentMember> o_members) {
    SUNDER_ASSERT(o_members.size() == live.count(g));
    const BendingShape& s = shapes.shape(g);
    const uint32_t begin = live.begin(g);
    const MovingParticle& cell = particles[g];
    BentGroup of;
    of.axes = cell.d.toRotationMatrix() * s.axes;
    of.K.setZero(), of.F.setZero();
    Vec3 center = Vec3::Zero();
    for (size_t j = 0; j < o_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        const ParticleId i = live.member(begin + static_cast<uint32_t>(j));
        BentMember& m = o_members[j];
        m.p = particles[i].x - cell.x;
        if (s.is_pinned) m.p += particles[i].d * rest.offset;
        center += rest.mean_part * m.p;
        m.turn = i == g ? Vec3(Vec3::Zero())
                        : Vec3(s.axes.transpose() * rotation_vector(cell.d.conjugate() * particles[i].d));
        of.K += (m.turn - rest.own.turn) * rest.pull_arm.transpose();
    }
    Vec3 mean = Vec3::Zero();  // of the bent shape's places
    for (size_t j = 0; j < o_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        BentMember& m = o_members[j];
        const Arc arc(of.K * rest.arm, rest.arm);
        m.p = of.axes.transpose() * (m.p - center);
        m.r = arc.place + rest.own.shift, m.arc_rate = arc.rate;
        m.turn_rate = rotation_vector_rate(m.turn);
        mean += rest.mean_part * m.r;
    }
    for (size_t j = 0; j < o_members.size(); ++j) {
        BentMember& m = o_members[j];
        m.r = m.p - (m.r - mean);
        of.F += m.r * shapes.member(begin + j).pull.transpose();
    }
    const Vec3 frame = s.shear_frame();
    Mat3 A = 2 * s.mu * s.volume * of.F;
    A += Mat3((s.volume * frame).asDiagonal());
    of.R = optimal_rotation(A, Quat::Identity()).toRotationMatrix();
    const Mat3 FP = of.F, RP = of.R * s.spanned;
    const double stretch = (RP.transpose() * FP).trace() - s.rank;
    of.stretch = s.volume * (s.mu * (FP - RP).squaredNorm() + 0.5 * s.pressure() * stretch * stretch + frame.sum() -
                             frame.dot(of.R.diagonal()));
    const Mat3 elastic = of.K - s.plastic_curvature;
    const Eigen::Map<const Vec9> of_K(elastic.data());
    of.bend = 0.5 * of_K.dot(s.bending * of_K);
    for (size_t j = 0; j < o_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        BentMember& m = o_members[j];
        m.r -= rest.q - s.spanned * rest.q + of.F * rest.q;
        m.sigma = m.turn - rest.own.turn - of.K * rest.arm;
        of.rest += 0.5 * s.k * rest.weight *
                   (s.softness.dot(m.r.cwiseProduct(m.r)) + s.turn_moment.dot(m.sigma.cwiseProduct(m.sigma)));
    }
    return of;
}

Unexplained unexplained(const BendingShapes& shapes, const LiveTopology& live, ParticleIndex g,
                        std::span<const BentMember> members) {
    const BendingShape& s = shapes.shape(g);
    Unexplained sum;
    for (size_t j = 0; j < members.size(); ++j) {
        const BentMember& m = members[j];
        const double weight = shapes.member(live.begin(g) + j).weight;
        for (int i = 0; i < 3; ++i) {
            (s.shift_stretches(i) ? sum.stretch : sum.bend) += weight * s.softness[i] * m.r[i] * m.r[i];
            (s.turn_stretches(i) ? sum.stretch : sum.bend) += weight * s.turn_moment[i] * m.sigma[i] * m.sigma[i];
        }
    }
    const double to_square = s.k / (s.youngs_modulus() * s.volume);  // k/2 w m r^2 = E V/2 strain^2
    return {to_square * sum.stretch, to_square * sum.bend};
}

void pull_back(const BendingShapes& shapes, const LiveTopology& live, ParticleIndex g, const BentGroup& of,
               const Yielding& yielding, std::span<BentMember> io_members) {
    SUNDER_ASSERT(io_members.size() == live.count(g));
    const BendingShape& s = shapes.shape(g);
    const uint32_t begin = live.begin(g);
    const Mat3 RP = of.R * s.spanned;
    // To the first order in the flow R stays: R^T F and the flow are symmetric.
    const double stretch = (RP.transpose() * of.F).trace() - s.rank - yielding.flowed.stretch.trace();
    const Mat3 stress =
        s.volume * (2 * s.mu * (of.F - RP - of.R * yielding.flowed.stretch) + s.pressure() * stretch * RP);
    const Mat3 elastic = of.K - s.plastic_curvature - yielding.flowed.K;
    const Vec3 shift_left = s.softness.cwiseProduct(yielding.shift_left(s)),
               turn_left = s.turn_moment.cwiseProduct(yielding.turn_left(s));
    Mat3 moment;
    Eigen::Map<Vec9>(moment.data()) = s.bending * Eigen::Map<const Vec9>(elastic.data());
    Vec3 total = Vec3::Zero(), torque = Vec3::Zero();
    for (size_t j = 0; j < io_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        BentMember& m = io_members[j];
        m.force = s.k * rest.weight * shift_left.cwiseProduct(m.r) + stress * rest.pull;
        total += m.force;
        torque += m.p.cross(m.force);
        moment -= m.arc_rate.transpose() * m.force * rest.arm.transpose();
    }
    size_t cell = 0;
    for (size_t j = 0; j < io_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        BentMember& m = io_members[j];
        m.force = -(of.axes * (m.force - rest.mean_part * total));
        if (live.member(begin + static_cast<uint32_t>(j)) == g) {
            cell = j;
            continue;
        }
        const Vec3 turned =
            m.turn_rate.transpose() * (moment * rest.pull_arm + s.k * rest.weight * turn_left.cwiseProduct(m.sigma));
        m.torque = -(of.axes * turned);
        torque += turned;
    }
    io_members[cell].torque = of.axes * torque;
}

}  // namespace sunder
