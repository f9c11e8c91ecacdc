#include "solver/matching/bending_shape.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>

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
    Mat3 basis = Mat3::Zero();

    Span(const Mat3& A, int rank) {
        const Eigen::SelfAdjointEigenSolver<Mat3> of(A);
        for (int i = 3 - rank; i < 3; ++i) {
            if (!(of.eigenvalues()[i] > kSmallestSpan * of.eigenvalues()[2])) continue;
            const Vec3 e = of.eigenvectors().col(i);
            projection += e * e.transpose(), inverse += e * e.transpose() / of.eigenvalues()[i];
            basis.col(2 - i) = e;
        }
    }
};

// How far the intact edges of a fragment span its axes.
Cover cover_of(const SimulationMesh& rest, const LiveTopology& live, ParticleIndex g) {
    Cover cover(rest, g);
    for (uint32_t slot = live.begin(g); slot < live.end(g); ++slot)
        if (const ParticleId j = live.member(slot); j != g) cover.add(rest, g, j, rest.edges[live.edge(slot)].area);
    return cover;
}

// A number that is another whenever a member's weight is: edges that fade weigh less.
double weights_of(const LiveTopology& live, const GroupShapes& shapes, ParticleIndex g) {
    double sum = 0;
    for (uint32_t slot = live.begin(g); slot < live.end(g); ++slot) sum = 1.0625 * sum + shapes.member_mass(live, slot);
    return sum;
}

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
    // Across n: of curvatures kappa_ii = K_ji, kappa_jj = -K_ij and kappa_ij = (K_jj - K_ii) / 2.
    const auto add_across = [&](int n, double twisting) {
        const int i = (n + 1) % 3, j = (n + 2) % 3;
        add_row({{at(j, i), 1}}, 2 * muV * rho2[n], form);
        add_row({{at(i, j), 1}}, 2 * muV * rho2[n], form);
        add_row({{at(j, i), 1}, {at(i, j), -1}}, s.plane_pressure() * s.volume * rho2[n], form);
        add_row({{at(j, j), 0.5}, {at(i, i), -0.5}}, 4 * muV * twisting, form);
    };
    if (s.rank == 3) {  // what is twisted warps: half of the least moment
        for (int n = 0; n < 3; ++n) add_across(n, 0.5 * rho2.minCoeff());
        return form;
    }
    const int n = s.normal, i = (n + 1) % 3, j = (n + 2) % 3;
    add_across(n, rho2[n]);
    add_row({{at(n, i), 1}}, EV * rho2[j], form);
    add_row({{at(n, j), 1}}, EV * rho2[i], form);
    return form;
}

// The Hessian of a group's energy at rest along motions that shift its members.
class HessianAtRest {
public:
    explicit HessianAtRest(const BendingShape& s)
        : s_(s), held_((2 * s.mu * s.volume) * (s.spanned.trace() * Mat3::Identity() - s.spanned)) {
        held_ += Mat3((s.volume * s.shear).asDiagonal());
        held_ = held_.inverse().eval();
    }

    /// What a motion of three numbers does: to the members' own places, as k w m (shift^T X shift) summed, and to the
    /// columns of F.
    struct Shifts {
        Mat3 square = Mat3::Zero(), F[3] = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
    };
    /// Of one motion beside another, where `square` is of both.
    Mat3 operator()(const Mat3& square, const Shifts& a, const Shifts& b) const {
        const Mat3 X = s_.softness.asDiagonal();
        const double muV2 = 2 * s_.mu * s_.volume;
        Mat3 H = square, torque_a = Mat3::Zero(), torque_b = torque_a;
        Eigen::RowVector3d trace_a = Eigen::RowVector3d::Zero(), trace_b = trace_a;
        for (int c = 0; c < 3; ++c) {
            H += muV2 * a.F[c].transpose() * b.F[c];
            const Mat3 cross = muV2 * cross_matrix(s_.spanned.col(c));
            torque_a += cross * a.F[c], torque_b += cross * b.F[c];
            trace_a += s_.spanned.col(c).transpose() * a.F[c], trace_b += s_.spanned.col(c).transpose() * b.F[c];
            Mat3 known = Mat3::Zero();
            for (int d = 0; d < 3; ++d) known += s_.A(c, d) * b.F[d];
            H -= s_.k * a.F[c].transpose() * X * known;
        }
        H += s_.pressure() * s_.volume * trace_a.transpose() * trace_b;
        return H - torque_a.transpose() * held_ * torque_b;
    }

    /// Of a shift that F takes as shift f^T.
    Mat3 of_shift(const Mat3& square, const Vec3& f) const {
        const double muV2 = 2 * s_.mu * s_.volume;
        const Vec3 spanned = s_.spanned * f;
        const Mat3 torque = muV2 * cross_matrix(spanned);
        Mat3 H = square - torque.transpose() * held_ * torque;
        H += s_.pressure() * s_.volume * spanned * spanned.transpose();
        H -= s_.k * f.dot(s_.A * f) * Mat3(s_.softness.asDiagonal());
        return H + muV2 * f.squaredNorm() * Mat3::Identity();
    }

private:
    const BendingShape& s_;
    Mat3 held_;  // inverse
};

// Pressure is of R, which F turns: what that adds to the slope. A turn changes the stretch by a = sum R e x F e, and is
// held by the second slope of what R makes least.
Mat3 turned_by_pressure(const BendingShape& s, const BentGroup& of, double stretch) {
    Vec3 a = Vec3::Zero();
    for (int c = 0; c < 3; ++c) a += of.R.col(c).cross(of.F.col(c));
    const double muV2 = 2 * s.mu * s.volume;
    Mat3 drawn = muV2 * of.F;
    drawn += Mat3((s.volume * s.shear_frame()).asDiagonal());
    const Mat3 together = of.R * drawn.transpose(), held = together.trace() * Mat3::Identity() - together;
    const Vec3 turn = s.pressure() * s.volume * stretch * muV2 * (held.inverse() * a);
    return cross_matrix(turn) * of.R;
}

}  // namespace

void BendingShapes::update(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const GroupStiffness> stiffness, const Bending& bending,
                           const WorkerPool& workers) {
    const size_t n = bending.thin.size();
    SUNDER_ASSERT(n == rest.n_particles() && bending.pinned.size() == n && bending.plastic_deformation.size() == n);
    SUNDER_ASSERT(bending.plastic_curvature.empty() || bending.plastic_curvature.size() == n);
    SUNDER_ASSERT(stiffness.size() == n && shapes.revision.size() == n);
    if (member_.size() != live.n_slots() || version_ != live.version() || !std::ranges::equal(given_, bending.thin) ||
        !std::ranges::equal(pinned_, bending.pinned)) {
        shape_.assign(n, {}), member_.assign(live.n_slots(), {}), key_.assign(n, {}), offset_.clear();
        blocks_key_.assign(n, {});
        revision_.resize(n);
        for (uint64_t& revision : revision_) ++revision;
        curvature_.assign(n, Mat3::Zero()), given_.assign(bending.thin.begin(), bending.thin.end()), thin_ = given_;
        for (size_t g = 0; g < n; ++g)
            if (given_[g] == kSlender && live.count(g) > 1 && !cover_of(rest, live, g).spans_all()) thin_[g] = 0;
        pinned_.assign(bending.pinned.begin(), bending.pinned.end());
        version_ = live.version();
    }
    const bool same_offsets = std::ranges::equal(offset_, bending.edge_offset);
    if (!same_offsets) offset_.assign(bending.edge_offset.begin(), bending.edge_offset.end());
    workers.for_range(n, kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g) {
            if (!thin_[g] || bending.pinned[g] || live.count(g) < 2) continue;
            if (!same_offsets) take_up_offsets(rest, live, bending.edge_offset, g);
            const Key key = {shapes.revision[g], stiffness[g].k, stiffness[g].volume_ratio};
            Mat3 curvature = Mat3::Zero();
            if (!bending.plastic_curvature.empty()) curvature = bending.plastic_curvature[g];
            if (key == key_[g] && curvature == curvature_[g]) continue;
            // Blocks only precondition: of what is slender, which has more of them, those of what never flowed do.
            const bool is_slender = bending.thin[g] == kSlender;
            key_[g] = key, curvature_[g] = curvature, ++revision_[g];
            if (const BlocksKey blocks{key.k, key.volume_ratio, is_slender ? weights_of(live, shapes, g) : 0};
                is_slender && blocks != blocks_key_[g]) {
                blocks_key_[g] = blocks;
                build(rest, live, shapes, stiffness[g], bending, {}, g);
                find_blocks(live, g);
            }
            build(rest, live, shapes, stiffness[g], bending, {bending.plastic_deformation[g], curvature}, g);
            if (!is_slender) find_blocks(live, g);
        }
    });
}

void BendingShapes::take_up_offsets(const SimulationMesh& rest, const LiveTopology& live,
                                    std::span<const EdgeOffsets> offsets, ParticleIndex g) {
    for (uint32_t slot = live.begin(g); slot < live.end(g) && !offsets.empty(); ++slot)
        if (const EdgeId e = live.edge(slot); !e.is_none()) member_[slot].own = offsets[e][rest.edges[e].b == g];
}

void BendingShapes::build(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                          const GroupStiffness& stiffness, const Bending& bending, const Plastic& plastic,
                          ParticleIndex g) {
    BendingShape s;
    s.axes = rest.rest_orientation[g].toRotationMatrix();
    s.volume = rest.volume[g];
    s.plastic_curvature = plastic.K_P;
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
        m.arm = s.axes.transpose() * (plastic.F_P * (x + m.offset));
        s.is_pinned |= pinned;
        mass += m.weight, mean += m.weight * m.arm;
        if (j == g) continue;
        cover.add(rest, g, j, rest.edges[live.edge(slot)].area);
        s.reach2 += m.weight * m.arm.squaredNorm(), neighbours += m.weight;
    }
    s.reach2 /= neighbours;
    s.rank = bending.thin[g] == kSlender ? 3 : std::clamp(cover.directions(), 1, 2);
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
    s.span = span.basis, s.arm_span = s.rank == 3 ? span_arm.projection : span_arm.basis;
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
    s.lambda = s.pressure();
    s.thinning = s.rank == 3 ? s.nu / (1 - s.nu) : 0, s.thins = s.thinning > 0;
    shape_[g] = s;
}

// Each member's shift or turn alone. Members' turns move a group by K alone, so that all have one form of K in common;
// K has as many columns as the arms' span.
void BendingShapes::find_blocks(const LiveTopology& live, ParticleIndex g) {
    const BendingShape& s = shape_[g];
    const std::span<BendingMember> members(member_.data() + live.begin(g), live.count(g));
    const HessianAtRest hessian(s);
    const Thinned thinned(s.thinning, s.extent, s.plastic_curvature);
    const Mat3 X = s.softness.asDiagonal();
    const int n = std::max(2, s.rank);  // columns
    HessianAtRest::Shifts by_K[3], by_cell;
    const Mat3 zero = Mat3::Zero();
    std::array<Mat3, 3> mean = {zero, zero, zero};
    std::array<std::array<Mat3, 3>, 3> square_K = {mean, mean, mean};
    Vec3 lever_mean = Vec3::Zero();
    std::array<std::vector<Mat3>, 3> shift;  // of places by each column
    std::vector<Vec3> lever;
    double weights = 0;
    for (const BendingMember& m : members) {
        const Arc arc(s.plastic_curvature * m.arm, m.arm);
        lever.push_back(m.q + arc.place);
        lever_mean += m.mean_part * lever.back();
        weights += m.weight;
        for (int c = 0; c < n; ++c) {
            shift[c].push_back(-s.arm_span.col(c).dot(m.arm) * arc.rate);
            shift[c].back() -=
                m.arm.cwiseProduct(m.arm).cwiseProduct(thinned.rate).asDiagonal() * cross_matrix(s.arm_span.col(c));
            mean[c] += m.mean_part * shift[c].back();
        }
    }
    Mat3 turned = zero, cross_K[3] = {zero, zero, zero};  // of the cell's turn alone, and beside K
    Vec3 cell_K = Vec3::Zero();                           // what its turn takes off K, by columns
    for (size_t i = 0; i < members.size(); ++i) {
        const BendingMember& m = members[i];
        const Mat3 swept = cross_matrix(lever[i] - lever_mean);
        std::array<Mat3, 3> own;
        for (int c = 0; c < n; ++c) own[c] = shift[c][i] - mean[c];
        turned += s.k * m.weight * swept.transpose() * X * swept;
        for (int c = 0; c < n; ++c) {
            cross_K[c] += s.k * m.weight * swept.transpose() * X * own[c];
            for (int d = 0; d < n; ++d) square_K[c][d] += s.k * m.weight * own[c].transpose() * X * own[d];
            for (int k = 0; k < 3; ++k) by_K[c].F[k] += m.pull[k] * own[c];
        }
        for (int k = 0; k < 3; ++k) by_cell.F[k] += m.pull[k] * swept;
        if (live.member(live.begin(g) + static_cast<uint32_t>(i)) != g) cell_K -= m.pull_arm;
    }
    std::array<std::array<Mat3, 3>, 3> of_K;
    for (int c = 0; c < n; ++c)
        for (int d = 0; d < n; ++d) {
            if (d < c) {
                of_K[c][d] = of_K[d][c].transpose();
                continue;
            }
            of_K[c][d] = hessian(square_K[c][d], by_K[c], by_K[d]);
            for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l)
                    of_K[c][d] += s.arm_span(k, c) * s.arm_span(l, d) * s.bending_less_turns.block<3, 3>(3 * k, 3 * l);
        }
    const auto by_columns = [&](const Vec3& a, const Vec3& b) {
        Mat3 H = Mat3::Zero();
        for (int c = 0; c < n; ++c)
            for (int d = 0; d < n; ++d) H += s.arm_span.col(c).dot(a) * s.arm_span.col(d).dot(b) * of_K[c][d];
        return H;
    };
    const Mat3 Gamma = s.turn_moment.asDiagonal();
    for (uint32_t slot = live.begin(g); slot < live.end(g); ++slot) {
        BendingMember& m = members[slot - live.begin(g)];
        const double other = weights - m.weight, part = m.mean_part;
        const double square = s.k * (m.weight * (1 - part) * (1 - part) + other * part * part);
        m.shift_block = to_sym(hessian.of_shift(square * X, m.pull - part * s.pull_sum));
        if (live.member(slot) != g) {
            m.turn_block = to_sym(by_columns(m.pull_arm, m.pull_arm) + s.k * m.weight * Gamma);
            continue;
        }
        Mat3 H = hessian(turned, by_cell, by_cell) + by_columns(cell_K, cell_K) + s.k * other * Gamma;
        for (int c = 0; c < n; ++c) {
            const Mat3 mixed = s.arm_span.col(c).dot(cell_K) * hessian(cross_K[c], by_cell, by_K[c]);
            H += mixed + mixed.transpose();
        }
        m.turn_block = to_sym(H);
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
        m.turn = continued(m.turn, s.plastic_curvature * rest.arm + rest.own.turn);
        of.K += (m.turn - rest.own.turn) * rest.pull_arm.transpose();
    }
    const Thinned thinned(s.thinning, s.extent, of.K);
    Vec3 mean = Vec3::Zero();  // of the bent shape's places
    for (size_t j = 0; j < o_members.size(); ++j) {
        const BendingMember& rest = shapes.member(begin + j);
        BentMember& m = o_members[j];
        const Arc arc(of.K * rest.arm, rest.arm);
        m.p = of.axes.transpose() * (m.p - center);
        m.r = arc.place + rest.own.shift, m.arc_rate = arc.rate;
        m.r += rest.arm.cwiseProduct(rest.arm).cwiseProduct(thinned.by);
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
    Mat3 stress = s.volume * (2 * s.mu * (of.F - RP - of.R * yielding.flowed.stretch) + s.pressure() * stretch * RP);
    if (s.rank == 3) stress += turned_by_pressure(s, of, stretch);
    const Mat3 elastic = of.K - s.plastic_curvature - yielding.flowed.K;
    const Vec3 shift_left = s.softness.cwiseProduct(yielding.shift_left(s)),
               turn_left = s.turn_moment.cwiseProduct(yielding.turn_left(s));
    const Thinned thinned(s.thinning, s.extent, of.K);
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
        moment -= cross_matrix(thinned.rate.cwiseProduct(rest.arm.cwiseProduct(rest.arm)).cwiseProduct(m.force));
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
