#include "solver/sweep_store.h"

#include <algorithm>
#include <cmath>

#include "solver/polar_decomposition.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = LaneLayout::kLanes;

void exact_rotation(const double* A, double* rotation) {
    const Mat3 matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(A);
    const Quat R = optimal_rotation_svd(matrix);
    for (int i = 0; i < 4; ++i) rotation[i] = R.coeffs()(i);
}

}  // namespace

template <class Real>
bool SweepStore<Real>::take_up(const SweepInput& in, const WorkerPool& workers) {
    const bool anew = layout_.update(in.live);
    if (anew) {
        revision_.assign(in.rest.n_particles(), 0);  // no shape has it
        rows_.assign(layout_.n_rows(), SweepRow<Real>());
        groups_.assign(layout_.n_blocks(), SweepGroups<Real>());
        for (SweepGroups<Real>& g : groups_) std::fill_n(g.rotation[3], kLanes, Real(1));
        particles_.assign(layout_.n_lanes(), SweepParticle<Real>{{0, 0, 0}, 0, {0, 0, 0, 1}});
        goals_.resize(layout_.n_lanes()), bounds_.resize(layout_.n_lanes());
    }
    workers.for_range(in.rest.n_particles(), kTakeUpGrain, [&](size_t begin, size_t end) {
        for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g)
            if (revision_[g] != in.shapes.revision[g] && layout_.lane(g) != LaneLayout::kNone) take_up_group(in, g);
    });
    return anew;
}

template <class Real>
void SweepStore<Real>::take_up_group(const SweepInput& in, uint32_t g) {
    revision_[g] = in.shapes.revision[g];
    for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s) {
        const MemberShape& m = in.shapes.member[s];
        const uint32_t own = layout_.cell(s), other = layout_.cell(in.live.twin(s));
        SweepRow<Real>& row = rows_[own / kLanes];
        row.weight[own % kLanes] = static_cast<Real>(m.weight);
        put_lane(m.q, own % kLanes, row.q);
        put_lane(m.moment, own % kLanes, row.moment);
        put_lane(m.q, other % kLanes, rows_[other / kLanes].q_other);
    }
    const GroupShape& shape = in.shapes.group[g];
    const uint32_t lane = layout_.lane(g) % kLanes;
    SweepGroups<Real>& to = groups_[layout_.lane(g) / kLanes];
    // What keeps a sweep stable: the largest of Q, and the norm of what pressure adds to G.
    bounds_[layout_.lane(g)] = {shape.most_isotropy,
                                shape.positions_trace / std::sqrt(3.0) * shape.volume_gradient.norm()};
    to.inverse_mass[lane] = static_cast<Real>(1 / shape.mass);
    to.volume_rest[lane] = static_cast<Real>(shape.volume_rest);
    to.spread[lane] = static_cast<Real>(shape.positions_trace / 3);
    put_lane(to_sym(shape.isotropy), lane, to.isotropy);
    put_lane(to_sym((Mat3::Identity() - shape.isotropy) * shape.affine_inverse), lane, to.N);
    put_lane(to_sym(shape.stiffness_moment), lane, to.stiffness_moment);
    put_lane(to_sym(shape.volume_gradient), lane, to.volume_gradient);
}

template <class Real>
void SweepStore<Real>::load(const SweepInput& in, std::span<const MovingParticle> particles,
                            std::span<const GroupGoal> goals, size_t begin, size_t end) {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t j = layout_.particle(l);
        if (j == LaneLayout::kNone) continue;
        const MovingParticle& p = particles[j];
        const Vec3 x = std::is_same_v<Real, float> ? Vec3(p.x - piece_origin(in.live, particles, j)) : p.x;
        SweepParticle<Real>& to = particles_[l];
        for (int i = 0; i < 3; ++i) to.x[i] = static_cast<Real>(x(i));
        to.mass = static_cast<Real>(in.rest.mass[j]);
        for (int i = 0; i < 4; ++i) to.d[i] = static_cast<Real>(p.d.coeffs()(i));

        SweepGroups<Real>& group = groups_[l / kLanes];
        const double b = in.span[j] * in.span[j] * in.stiffness[j].k, ratio = in.stiffness[j].volume_ratio;
        group.b[l % kLanes] = static_cast<Real>(b);
        group.bound[l % kLanes] = static_cast<Real>(b * (bounds_[l].elastic + ratio * bounds_[l].pressure));
        group.volume_ratio[l % kLanes] = static_cast<Real>(ratio);
        put_lane(goals[j].rotation, l % kLanes, group.rotation);
    }
}

template <class Real>
void SweepStore<Real>::give_rotations(std::span<GroupGoal> io_goals, size_t begin, size_t end) const {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t g = layout_.particle(l);
        if (g == LaneLayout::kNone) continue;
        const auto& rotation = groups_[l / kLanes].rotation;
        const auto at = [&](int i) { return static_cast<double>(rotation[i][l % kLanes]); };
        io_goals[g].rotation = Quat(at(3), at(0), at(1), at(2));
        if (std::is_same_v<Real, float>) io_goals[g].rotation.normalize();
    }
}

template <class Real>
SweepArrays<Real> SweepStore<Real>::arrays() {
    return {layout_.row_begin(),
            layout_.neighbours(),
            rows_.data(),
            groups_.data(),
            particles_.data(),
            goals_.data(),
            nullptr,
            nullptr,
            nullptr,
            kOrientationWeight,
            exact_rotation};
}

template class SweepStore<float>;
template class SweepStore<double>;

}  // namespace sunder
