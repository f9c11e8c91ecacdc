#include "solver/matching/sweep_store.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "solver/matching/bending_shape.h"
#include "solver/matching/polar_decomposition.h"

namespace sunder {
ShapeRecords shape_records(const SweepInput& in, const ShapeWatch& watch) {
    static_assert(sizeof(MemberShape) == ShapeRecords::kNumbers * sizeof(double));
    static_assert(offsetof(MemberShape, weight) == 3 * sizeof(double));
    return {in.shapes.member.data()->q.data(),
            in.shapes.particle_moment.data()->data(),
            in.live.begins().data(),
            in.live.ends().data(),
            in.live.twins().data(),
            numbers(in.live.members()).data(),
            numbers(watch.particles()).data()};
}

template <class Real>
void SweepStore<Real>::open(const SweepInput& in, const LaneLayout& layout, size_t unit, const UnitBlocks& blocks) {
    if (!watch_.look(in.shapes, layout, unit, blocks)) return;
    const size_t n_lanes = watch_.n_lanes();
    rows_.resize(watch_.unit().n_rows());
    groups_.resize(watch_.unit().n_blocks()), particles_.resize(n_lanes);
    goals_.resize(n_lanes), bounds_.resize(n_lanes);
    // The last block alone has padding, which nothing else writes.
    groups_.back() = SweepGroups<Real>();
    std::fill_n(groups_.back().rotation[3], kLanes, Real(1));
    std::fill(particles_.end() - kLanes, particles_.end(), SweepParticle<Real>());
}

template <class Real>
void SweepStore<Real>::take_up(const SweepInput& in, const SweepKernels& kernels, size_t begin, size_t end) {
    if (!watch_.is_any_changed()) return;
    const ShapeRecords records = shape_records(in, watch_);
    for (size_t block = begin; block < end; ++block) {
        if (!watch_.are_rows_changed(block)) continue;
        if constexpr (std::is_same_v<Real, float>)
            kernels.expand(records, watch_.row_begin(), rows_.data(), block, block + 1);
        else
            kernels.expand_full(records, watch_.row_begin(), rows_.data(), block, block + 1);
        for (size_t lane = kLanes * block; lane < kLanes * (block + 1); ++lane)
            if (watch_.is_changed(lane)) take_up_group(in.shapes.group[particle(lane)], lane);
    }
}

template <class Real>
void SweepStore<Real>::take_up_group(const GroupShape& shape, size_t l) {
    const size_t lane = l % kLanes;
    SweepGroups<Real>& to = groups_[l / kLanes];
    bounds_[l] = {shape.most_isotropy, shape.most_pressure};  // what keeps a sweep stable
    to.inverse_mass[lane] = static_cast<Real>(1 / shape.mass);
    to.volume_rest[lane] = static_cast<Real>(shape.volume_rest);
    to.spread[lane] = static_cast<Real>(shape.positions_trace / 3);
    put_lane(shape.isotropy, lane, to.isotropy);
    put_lane(shape.N, lane, to.N);
    put_lane(shape.stiffness_moment, lane, to.stiffness_moment);
    put_lane(shape.volume_gradient, lane, to.volume_gradient);
}

template <class Real>
void SweepStore<Real>::load(const SweepInput& in, std::span<const GroupGoal> goals, size_t begin, size_t end) {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t j = particle(l);
        if (j == kNone) continue;
        if constexpr (std::is_same_v<Real, float>) particles_[l].mass = static_cast<float>(in.rest.mass[j]);
        SweepGroups<Real>& group = groups_[l / kLanes];
        const double k = in.bending && in.bending->is_thin(j) ? 0 : in.stiffness[j].k;
        const double b = in.span[j] * in.span[j] * k, ratio = in.stiffness[j].volume_ratio;
        group.b[l % kLanes] = static_cast<Real>(b);
        group.bound[l % kLanes] = static_cast<Real>(b * (bounds_[l].elastic + ratio * bounds_[l].pressure));
        group.volume_ratio[l % kLanes] = static_cast<Real>(ratio);
        put_lane(goals[j].rotation, l % kLanes, group.rotation);
    }
}

template <class Real>
void SweepStore<Real>::give_rotations(std::span<GroupGoal> io_goals, size_t begin, size_t end) const {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t g = particle(l);
        if (g == kNone) continue;
        const auto& rotation = groups_[l / kLanes].rotation;
        const auto at = [&](int i) { return static_cast<double>(rotation[i][l % kLanes]); };
        io_goals[g].rotation = Quat(at(3), at(0), at(1), at(2));
    }
}

template <class Real>
SweepArrays<Real> SweepStore<Real>::arrays() {
    return {watch_.row_begin(),
            watch_.neighbours(),
            rows_.data(),
            groups_.data(),
            particles_.data(),
            goals_.data(),
            nullptr,
            nullptr,
            nullptr,
            kOrientationWeight,
            optimal_rotation_svd};
}

template class SweepStore<float>;
template class SweepStore<double>;

}  // namespace sunder
