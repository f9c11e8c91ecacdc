#include "solver/matching/bending_unit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "solver/lanes/instruction_set.h"
#include "solver/matching/arc.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/matching/section_flow.h"

namespace sunder {
namespace {

// What of a group flows on in the step, were its particles to stay where they are.
Yielding yielding_of(const SweepInput& in, ParticleIndex g, const BentGroups& groups, size_t lane) {
    if (!in.tether.empty() && in.tether[g] > 0) return {};
    const double yield = in.flow->yield[g], share = in.flow->share[in.rest.material_of(g)];
    const double most = in.flow->rate[g] * in.flow->seconds;
    if (yield == kNever || share == 0 || most == 0) return {};
    const BendingShape& s = in.bending->shape(g);
    const BentShape group = bent_shape(groups, lane);
    const Unexplained rest = unexplained(s, groups, lane);
    const LayerStrain& layers = in.flow->layers[g];
    if (s.rank == 3 && !may_flow(s, group, s.plastic_curvature, layers, rest, yield)) return {};
    Yielding yielding = flow_section(s, section_strain(s, group, s.plastic_curvature), layers, rest, yield, share);
    yielding.hold_to(most);
    return yielding;
}

template <size_t n>
Vec3 vector_of(const double (&from)[n][4], size_t lane) {
    static_assert(n >= 3);
    return Vec3(from[0][lane], from[1][lane], from[2][lane]);
}
Mat3 matrix_of(const double (&from)[3][3][4], size_t lane) {
    Mat3 m;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) m(i, k) = from[i][k][lane];
    return m;
}
void put_matrix(const Mat3& m, size_t lane, double (*to)[3][4]) {
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) to[i][k][lane] = m(i, k);
}

void exact_arc(const double* turn, const double* q, double* o_arc) {
    const Arc arc(Vec3(turn[0], turn[1], turn[2]), Vec3(q[0], q[1], q[2]));
    for (int i = 0; i < 3; ++i) o_arc[i] = arc.place[i];
    for (int i = 0; i < 9; ++i) o_arc[3 + i] = arc.rate(i / 3, i % 3);
}

// Numbers that are rounding beside the largest of them (drop_noise of the kernels).
constexpr double kNoise = 1e-12;
template <class Real>
void put_columns(const Mat3& span, const Vec3& v, int n, size_t lane, Real (*to)[8]) {
    double numbers[3], most = 0;
    for (int c = 0; c < n; ++c) numbers[c] = span.col(c).dot(v), most = std::max(most, std::abs(numbers[c]));
    for (int c = 0; c < n; ++c)
        to[c][lane] = static_cast<Real>(std::abs(numbers[c]) < kNoise * most ? 0.0 : numbers[c]);
}

}  // namespace

const BentKernels& bent_kernels() {
    static const BentKernels& best = SUNDER_BEST_KERNELS(kBentKernels);
    return best;
}

BentRecords bent_records(const BendingShapes& shapes, const LiveTopology& live,
                         std::span<const MovingParticle> particles) {
    constexpr size_t number = sizeof(double);
    using M = BendingMember;
    static_assert(sizeof(M) == BentRecords::kMember * number);
    static_assert(offsetof(M, weight) == 3 * number && offsetof(M, pull) == 4 * number);
    static_assert(offsetof(M, mean_part) == 7 * number && offsetof(M, arm) == 8 * number);
    static_assert(offsetof(M, pull_arm) == 11 * number && offsetof(M, offset) == 14 * number);
    static_assert(offsetof(M, own) == 17 * number && offsetof(MemberOffset, turn) == 3 * number);
    static_assert(offsetof(M, shift_block) == BentRecords::kShiftBlock * number);
    static_assert(offsetof(M, turn_block) == BentRecords::kTurnBlock * number);
    using S = BendingShape;
    static_assert(sizeof(S) == BentRecords::kShape * number && offsetof(S, axes) == BentRecords::kAxes * number);
    static_assert(sizeof(bool) == 1 && offsetof(S, is_pinned) == BentRecords::kFlags);
    static_assert(offsetof(S, thins) == BentRecords::kFlags + 1);
    static_assert(offsetof(S, extent) == BentRecords::kExtent * number);
    static_assert(offsetof(S, volume) == BentRecords::kVolume * number);
    static_assert(offsetof(S, mu) == BentRecords::kMu * number && offsetof(S, k) == BentRecords::kK * number);
    static_assert(offsetof(S, softness) == BentRecords::kSoftness * number);
    static_assert(offsetof(S, turn_moment) == BentRecords::kTurnMoment * number);
    static_assert(offsetof(S, shear) == BentRecords::kShear * number);
    static_assert(offsetof(S, spanned) == BentRecords::kSpanned * number);
    static_assert(offsetof(S, bending) == BentRecords::kBending * number);
    static_assert(offsetof(S, plastic_curvature) == BentRecords::kPlasticCurvature * number);
    static_assert(offsetof(S, span) == BentRecords::kSpan * number);
    static_assert(offsetof(S, lambda) == BentRecords::kLambda * number);
    static_assert(offsetof(S, thinning) == BentRecords::kThinning * number);
    return {moving_records(particles),
            reinterpret_cast<const double*>(shapes.members().data()),
            reinterpret_cast<const double*>(shapes.shapes().data()),
            live.begins().data(),
            live.ends().data(),
            numbers(live.members()).data(),
            optimal_rotation_svd,
            exact_arc};
}

BentShape bent_shape(const BentGroups& groups, size_t lane) {
    BentShape of;
    of.K = matrix_of(groups.K, lane);
    of.F = matrix_of(groups.F, lane), of.R = matrix_of(groups.R, lane);
    return of;
}

void bent_members(std::span<const BentRow> rows, size_t lane, std::span<BentMember> o_members) {
    for (size_t j = 0; j < o_members.size(); ++j)
        o_members[j].r = vector_of(rows[j].r, lane), o_members[j].sigma = vector_of(rows[j].sigma, lane);
}

Unexplained unexplained(const BendingShape& s, const BentGroups& groups, size_t lane) {
    Unexplained sum;
    for (int i = 0; i < 3; ++i) {
        (s.shift_stretches(i) ? sum.stretch : sum.bend) += groups.shift_square[i][lane];
        (s.turn_stretches(i) ? sum.stretch : sum.bend) += groups.turn_square[i][lane];
    }
    const double to_square = s.k / (s.youngs_modulus() * s.volume);  // as `unexplained` of bending_shape.h
    return {to_square * sum.stretch, to_square * sum.bend};
}

template <class Real>
bool BendingUnit<Real>::open(const SweepInput& in, const LaneLayout& layout, size_t unit) {
    const BendingShapes& shapes = *in.bending;
    const LaneLayout::Unit& u = layout.units()[unit];
    const size_t first = size_t{kLanes} * u.begin_block, n_lanes = size_t{kLanes} * u.n_blocks();
    const auto bends = [&](size_t lane) {
        const uint32_t g = layout.particle(first + lane);
        return g != kNone && shapes.pulls(g);
    };
    const auto is_thin = [&](ParticleId g) { return g.is_none() || shapes.is_thin(g); };
    const bool is_known = layout_ == &layout && version_ == layout.version() && unit_ == unit;
    if (is_known && !lane_group_.empty()) {
        bool same = true;
        for (size_t lane = 0; lane < n_lanes && same; ++lane) same = (lane_group_[lane] != kNone) == bends(lane);
        if (same) return true;
    }
    layout_ = &layout, unit_ = unit, version_ = layout.version();
    lane_group_.clear();
    bool any = false;
    for (size_t lane = 0; lane < n_lanes && !any; ++lane) any = bends(lane);
    if (!any) return false;
    lane_group_.resize(n_lanes);
    columns_.assign(u.n_blocks(), 0), all_pull_.assign(u.n_blocks(), 1);
    for (size_t lane = 0; lane < n_lanes; ++lane) {
        lane_group_[lane] = bends(lane) ? layout.particle(first + lane) : kNone;
        if (bends(lane)) columns_[lane / kLanes] = 2;
        if (!bends(lane) && layout.particle(first + lane) != kNone) all_pull_[lane / kLanes] = 0;
    }
    rows_.assign(u.n_rows(), {}), groups_.assign(u.n_blocks(), {}), diagonal_.assign(u.n_blocks(), {});
    kept_.assign(u.n_blocks(), {});
    motion_.assign(n_lanes, {}), pulls_.assign(kLanes * u.n_rows() + 1, {}), cell_torque_.assign(4 * n_lanes, 0);
    pull_.assign(kLanes * u.n_rows() + 1, {}), at_rest_.assign(n_lanes, {});
    twin_.assign(kLanes * u.n_rows(), kLanes * static_cast<uint32_t>(u.n_rows()));
    const uint32_t* const row_begin = layout.row_begin(unit);
    for (size_t lane = 0; lane < n_lanes; ++lane) {
        const uint32_t j = layout.particle(first + lane);
        if (j == kNone) continue;
        for (uint32_t slot = in.live.begin(j); slot < in.live.end(j); ++slot) {
            const uint32_t g = in.live.member(slot);
            if (!shapes.pulls(g)) continue;
            const size_t of_group = layout.lane(g) - first;
            const uint32_t row = row_begin[of_group / kLanes] + (in.live.twin(slot) - in.live.begin(g));
            twin_[kLanes * (row_begin[lane / kLanes] + (slot - in.live.begin(j))) + lane % kLanes] =
                kLanes * row + static_cast<uint32_t>(of_group % kLanes);
        }
    }
    arrays_ = {rows_.data(),
               groups_.data(),
               columns_.data(),
               twin_.data(),
               diagonal_.data(),
               kept_.data(),
               motion_.data()->numbers,
               pulls_.data()->numbers,
               cell_torque_.data(),
               std::ranges::all_of(layout.particles().subspan(first, n_lanes), is_thin)};
    return true;
}

template <class Real>
void BendingUnit<Real>::linearise(const SweepInput& in, std::span<const MovingParticle> particles,
                                  const UnitBlocks& blocks, std::span<GroupGoal> io_goals) {
    const BentRecords records = bent_records(*in.bending, in.live, particles);
    const uint32_t* const row_begin = layout_->row_begin(unit_);
    blocks([&](size_t begin, size_t end) {
        std::vector<BentRow> rows;
        for (size_t block = begin; block < end; ++block) {
            if (columns_[block] == 0) continue;
            rows.resize(row_begin[block + 1] - row_begin[block]);
            columns_[block] = 2;
            for (size_t lane = kLanes * block; lane < kLanes * (block + 1); ++lane) {
                if (lane_group_[lane] == kNone) continue;
                put_at_rest(in, lane);
                if (in.bending->shape(lane_group_[lane]).rank == 3) columns_[block] = 3;
            }
            for (size_t lane = kLanes * block; lane < kLanes * (block + 1); lane += 4)
                linearise_four(in, records, lane, rows, io_goals);
        }
    });
}

// What particles do not move, in the units of a step.
template <class Real>
void BendingUnit<Real>::put_at_rest(const SweepInput& in, size_t lane) {
    const uint32_t g = lane_group_[lane];
    const double b = in.span[g] * in.span[g];
    const AtRest now{in.bending->revision(g), b};
    if (at_rest_[lane] == now) return;
    at_rest_[lane] = now;
    const BendingShape& s = in.bending->shape(g);
    const size_t l = lane % kLanes, first = layout_->row_begin(unit_)[lane / kLanes];
    BendingGroups<Real>& to = groups_[lane / kLanes];
    put_lane(s.turn_moment, l, to.Gamma);
    const int n = std::max(2, s.rank);  // columns
    put_columns(s.span, s.pull_sum, n, l, to.pull_sum);
    for (int c = 0; c < n; ++c) to.kA[c][l] = static_cast<Real>(b * s.k * s.span.col(c).dot(s.A * s.span.col(c)));
    to.stretch[l] = static_cast<Real>(b * 2 * s.mu * s.volume);
    to.pressure[l] = static_cast<Real>(b * s.pressure() * s.volume);
    Mat9 form = Mat9::Zero();
    for (int c = 0; c < n; ++c)
        for (int d = 0; d < n; ++d)
            for (int k = 0; k < 3; ++k)
                for (int m = 0; m < 3; ++m)
                    form.block<3, 3>(3 * c, 3 * d) += b * s.arm_span(k, c) * s.arm_span(m, d) *
                                                      s.bending_less_turns.template block<3, 3>(3 * k, 3 * m);
    const double least = kNoise * form.cwiseAbs().maxCoeff();
    for (int i = 0; i < 3 * n; ++i)
        for (int k = 0; k < 3 * n; ++k)
            to.bending[i][k][l] = static_cast<Real>(std::abs(form(i, k)) < least ? 0.0 : form(i, k));
    for (size_t j = 0; j < in.live.count(g); ++j) {
        const BendingMember& m = in.bending->member(in.live.begin(g) + j);
        BendingRow<Real>& row = rows_[first + j];
        row.weight[l] = static_cast<Real>(b * s.k * m.weight), row.mean_part[l] = static_cast<Real>(m.mean_part);
        put_columns(s.arm_span, m.arm, n, l, row.arm);
        put_columns(s.span, m.pull, n, l, row.pull);
        put_columns(s.arm_span, m.pull_arm, n, l, row.pull_arm);
    }
}

template <class Real>
void BendingUnit<Real>::linearise_four(const SweepInput& in, const BentRecords& records, size_t lane,
                                       std::span<BentRow> io_rows, std::span<GroupGoal> io_goals) {
    // In a lane whose group does not bend another's is gone through, and counts nothing.
    const auto* const own = lane_group_.data() + lane;
    const auto* const any = std::find_if(own, own + 4, [](uint32_t g) { return g != kNone; });
    if (any == own + 4) return;
    uint32_t groups[4];
    double b[4];
    for (size_t i = 0; i < 4; ++i) {
        groups[i] = own[i] == kNone ? *any : own[i];
        b[i] = own[i] == kNone ? 0 : in.span[own[i]] * in.span[own[i]];
    }
    BentGroups bent;
    kernels_.bend(records, groups, io_rows.size(), true, bent, io_rows.data());
    YieldingGroups yielding;
    bool flows = false;
    for (size_t i = 0; i < 4 && in.flow; ++i) {
        const Yielding of = yielding_of(in, groups[i], bent, i);
        const BendingShape& s = in.bending->shape(groups[i]);
        flows |= of.flows();
        put_matrix(of.flowed.stretch, i, yielding.stretch), put_matrix(of.flowed.K, i, yielding.K);
        const Vec3 shift = of.shift_left(s), turn = of.turn_left(s);
        for (int c = 0; c < 3; ++c) yielding.shift_left[c][i] = shift[c], yielding.turn_left[c][i] = turn[c];
    }
    const size_t block = lane / kLanes, first = layout_->row_begin(unit_)[block];
    const BentLanes<Real> to{groups_[block], rows_.data() + first, pull_.data() + kLanes * first, lane % kLanes,
                             !in.is_first};
    if constexpr (std::is_same_v<Real, float>)
        kernels_.linearise(records, groups, b, io_rows.size(), bent, io_rows.data(), flows ? &yielding : nullptr, to);
    else
        kernels_.linearise_full(records, groups, b, io_rows.size(), bent, io_rows.data(), flows ? &yielding : nullptr,
                                to);
    for (size_t i = 0; i < 4 && !io_goals.empty(); ++i)
        if (own[i] != kNone)
            io_goals[own[i]].rotation =
                Quat(bent.rotation[3][i], bent.rotation[0][i], bent.rotation[1][i], bent.rotation[2][i]);
}

template <class Real>
void BendingUnit<Real>::add_residual(std::span<NewtonParticles> io_newton, std::span<const CgParticles<Real>> particles,
                                     const UnitBlocks& blocks) {
    const uint32_t* const row_begin = layout_->row_begin(unit_);
    blocks([&](size_t begin, size_t end) {
        for (size_t block = begin; block < end; ++block) {
            const size_t first = row_begin[block], n = row_begin[block + 1] - first;
            const uint32_t* const twins = twin_.data() + kLanes * first;
            if constexpr (std::is_same_v<Real, float>)
                kernels_.add_pulls(pull_.data(), twins, n, particles[block], io_newton[block], diagonal_[block]);
            else
                kernels_.add_pulls_full(pull_.data(), twins, n, particles[block], io_newton[block], diagonal_[block]);
        }
    });
}

template class BendingUnit<float>;
template class BendingUnit<double>;

}  // namespace sunder
