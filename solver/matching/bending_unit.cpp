#include "solver/matching/bending_unit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "solver/data/rotations.h"
#include "solver/matching/section_flow.h"

namespace sunder {
namespace {

// Numbers of a lane without what is rounding beside the largest of them: noise times noise is denormal in single
// precision, which takes a hundred times as long (a plate of 600 fragments ran 2.5 times as long).
template <class Numbers>
Numbers without_noise(const Numbers& numbers) {
    constexpr double kNoise = 1e-12;
    const double least = kNoise * numbers.cwiseAbs().maxCoeff();
    return numbers.unaryExpr([&](double x) { return std::abs(x) < least ? 0.0 : x; });
}

template <class Real>
void put_matrix(const Mat3& m, size_t lane, Real (*to)[3][8]) {
    const Mat3 numbers = without_noise(m);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) to[i][k][lane] = static_cast<Real>(numbers(i, k));
}
template <class Real>
void put_vector(const Vec3& v, size_t lane, Real (*to)[8]) {
    put_lane(without_noise(v), lane, to);
}
template <class Real>
void put_symmetric(const Mat3& m, size_t lane, Real (*to)[8]) {
    put_lane(to_sym(without_noise(m)), lane, to);
}

Sym3 turned(const Mat3& axes, const Mat3& block, double factor) {
    return to_sym(factor * (axes * block * axes.transpose()));
}

void add(const Sym3& other, Sym3& io_sum) {
    for (size_t i = 0; i < 6; ++i) io_sum[i] += other[i];
}

// What of a group flows in the step, were its particles to stay where they are.
Yielding yielding_of(const SweepInput& in, ParticleIndex g, const BentGroup& group,
                     std::span<const BentMember> members) {
    if (!in.flow || (!in.tether.empty() && in.tether[g] > 0)) return {};
    const double yield = in.flow->yield[g], share = in.flow->share[in.rest.material_of(g)];
    if (yield == kNever || share == 0) return {};
    const BendingShape& s = in.bending->shape(g);
    return flow_section(s, section_strain(s, group, s.plastic_curvature), in.flow->layers[g],
                        unexplained(*in.bending, in.live, g, members), yield, share);
}

}  // namespace

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
    is_thin_.assign(u.n_blocks(), 0);
    for (size_t lane = 0; lane < n_lanes; ++lane) {
        lane_group_[lane] = bends(lane) ? layout.particle(first + lane) : kNone;
        if (bends(lane)) is_thin_[lane / kLanes] = 1;
    }
    rows_.assign(u.n_rows(), {}), groups_.assign(u.n_blocks(), {}), diagonal_.assign(u.n_blocks(), {});
    motion_.assign(n_lanes, {}), pulls_.assign(kLanes * u.n_rows() + 1, {}), cell_torque_.assign(4 * n_lanes, 0);
    pull_.assign(kLanes * u.n_rows(), {Vec3::Zero(), Vec3::Zero(), {}, {}});
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
               is_thin_.data(),
               twin_.data(),
               diagonal_.data(),
               motion_.data()->numbers,
               pulls_.data()->numbers,
               cell_torque_.data(),
               std::ranges::all_of(layout.particles().subspan(first, n_lanes), is_thin)};
    return true;
}

template <class Real>
void BendingUnit<Real>::linearise(const SweepInput& in, std::span<const MovingParticle> particles,
                                  const UnitBlocks& blocks, std::span<GroupGoal> io_goals) {
    blocks([&](size_t begin, size_t end) {
        std::vector<BentMember> members;
        for (size_t lane = kLanes * begin; lane < kLanes * end; ++lane) {
            const uint32_t g = lane_group_[lane];
            if (g == kNone) continue;
            members.resize(in.live.count(g));
            const BentGroup group = bend(*in.bending, in.live, particles, g, members);
            const Yielding yielding = yielding_of(in, g, group, members);
            pull_back(*in.bending, in.live, g, group, yielding, members);
            put(in, g, lane, group, members);
            if (!io_goals.empty())
                io_goals[g].rotation =
                    Quat(Mat3(group.axes * group.R * in.bending->shape(g).axes.transpose())).normalized();
        }
    });
}

template <class Real>
void BendingUnit<Real>::put(const SweepInput& in, ParticleIndex g, size_t lane, const BentGroup& group,
                            std::span<const BentMember> members) {
    const BendingShape& s = in.bending->shape(g);
    const double b = in.span[g] * in.span[g];
    const size_t l = lane % kLanes, first = layout_->row_begin(unit_)[lane / kLanes];
    BendingGroups<Real>& to = groups_[lane / kLanes];
    const Mat3 RP = group.R * s.spanned;
    const double stretch = 2 * s.mu * s.volume;
    Mat3 held = stretch * (s.spanned.trace() * Mat3::Identity() - RP * group.R.transpose());
    held += Mat3((s.volume * s.shear).asDiagonal());
    put_symmetric(b * stretch * stretch * held.inverse(), l, to.held);
    put_matrix(group.axes, l, to.axes), put_matrix(RP, l, to.RP);
    put_vector(s.softness, l, to.softness), put_vector(s.turn_moment, l, to.kGamma);
    put_vector(s.pull_sum, l, to.pull_sum);
    put_symmetric(b * s.k * s.A, l, to.kA);
    to.stretch[l] = static_cast<Real>(b * stretch), to.pressure[l] = static_cast<Real>(b * s.pressure() * s.volume);
    const Mat9 bending = without_noise(Mat9(b * s.bending_less_turns));
    for (int i = 0; i < 9; ++i)
        for (int k = 0; k < 9; ++k) to.bending[i][k][l] = static_cast<Real>(bending(i, k));
    for (size_t j = 0; j < members.size(); ++j) {
        const BendingMember& rest = in.bending->member(in.live.begin(g) + j);
        const BentMember& m = members[j];
        BendingRow<Real>& row = rows_[first + j];
        row.weight[l] = static_cast<Real>(b * s.k * rest.weight), row.mean_part[l] = static_cast<Real>(rest.mean_part);
        put_vector(rest.arm, l, row.arm), put_vector(rest.pull, l, row.pull);
        put_vector(rest.pull_arm, l, row.pull_arm), put_vector(m.p, l, row.lever);
        put_matrix(m.turn_rate * group.axes.transpose(), l, row.turn_rate);
        put_matrix(m.arc_rate, l, row.arc_rate);
        pull_[kLanes * (first + j) + l] = {b * m.force, b * m.torque, turned(group.axes, rest.shift_block, b),
                                           turned(group.axes, rest.turn_block, b)};
    }
}

template <class Real>
void BendingUnit<Real>::add_residual(std::span<NewtonParticles> io_newton, std::span<const CgParticles<Real>> particles,
                                     const UnitBlocks& blocks) {
    const uint32_t* const row_begin = layout_->row_begin(unit_);
    blocks([&](size_t begin, size_t end) {
        for (size_t block = begin; block < end; ++block) {
            NewtonParticles& p = io_newton[block];
            p.magnitude = 0;
            diagonal_[block] = {};
            for (size_t lane = 0; lane < kLanes; ++lane) {
                const double inverse = static_cast<double>(particles[block].inverse_turn[lane]);
                if (inverse == 0) continue;
                const double free = particles[block].inverse_shift[lane] == 0 ? 0 : 1;
                Sym3 H;
                for (size_t i = 0; i < 6; ++i) H[i] = p.inertia[i][lane];
                const double mass = p.mass[lane];
                Vec3 force = Vec3::Zero(), torque = force;
                Sym3 shift_block = {mass / inverse, mass / inverse, mass / inverse, 0, 0, 0}, turn_block = H;
                for (double& number : turn_block) number /= inverse;
                for (size_t row = row_begin[block]; row < row_begin[block + 1]; ++row) {
                    const uint32_t twin = twin_[kLanes * row + lane];
                    if (twin == pull_.size()) continue;
                    force += pull_[twin].force, torque += pull_[twin].torque;
                    add(pull_[twin].shift_block, shift_block), add(pull_[twin].turn_block, turn_block);
                }
                const Mat3 inverse_inertia = to_matrix(H).inverse();
                Vec3 shift, turn;
                for (int i = 0; i < 3; ++i) shift[i] = p.residual[i][lane], turn[i] = p.residual[i + 3][lane];
                shift += free * (force / mass), turn += inverse_inertia * torque;
                for (int i = 0; i < 3; ++i) p.residual[i][lane] = shift[i], p.residual[i + 3][lane] = turn[i];
                const Mat3 inverse_shift = free * to_matrix(shift_block).inverse();
                const Mat3 inverse_turn = to_matrix(turn_block).inverse();
                BlockDiagonal<Real>& to = diagonal_[block];
                put_symmetric(inverse_shift, lane, to.inverse_shift);
                put_symmetric(inverse_turn, lane, to.inverse_turn);
                put_symmetric(inverse_inertia, lane, to.inverse_inertia);
                to.inverse_mass[lane] = static_cast<Real>(1 / mass);
                const Vec3 pushed = mass * shift, twisted = to_matrix(H) * turn;
                p.magnitude += pushed.dot(inverse_shift * pushed) + twisted.dot(inverse_turn * twisted);
            }
        }
    });
}

template class BendingUnit<float>;
template class BendingUnit<double>;

}  // namespace sunder
