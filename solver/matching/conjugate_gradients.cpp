#include "solver/matching/conjugate_gradients.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sunder {
namespace {

constexpr double kRounding = 1e-11;  // of a group's radius: residuals below it are rounding, and left

bool is_seen(const UnitResidual& r) { return r.now > kRounding * kRounding * r.size; }
double scale_of(const UnitResidual& r) { return 1 / std::sqrt(r.now); }

// force . shift + torque . turn of what the diagonal makes of them.
template <class Real>
double bending_magnitude(const BlockDiagonal<Real>& diagonal, size_t lane, const Vec3& force, const Vec3& torque) {
    Sym3 shift, turn;
    for (size_t i = 0; i < 6; ++i) {
        shift[i] = static_cast<double>(diagonal.inverse_shift[i][lane]);
        turn[i] = static_cast<double>(diagonal.inverse_turn[i][lane]);
    }
    return force.dot(product(shift, force)) + torque.dot(product(turn, torque));
}

// In stored order: the same bits for any number of threads.
double total(std::span<const double> of_blocks) { return std::accumulate(of_blocks.begin(), of_blocks.end(), 0.0); }

}  // namespace

template <class Real>
void CgStore<Real>::take_up(const SweepInput& in, const LaneLayout& layout, size_t unit, const SweepKernels& kernels,
                            const UnitBlocks& blocks) {
    if (watch_.look(in.shapes, layout, unit, blocks)) {
        const size_t n_blocks = watch_.unit().n_blocks();
        rows_.resize(watch_.unit().n_rows());
        vectors_.resize(n_blocks), momentum_.resize(watch_.n_lanes()), pulls_.resize(watch_.n_lanes());
        magnitude_.resize(n_blocks), curvature_.resize(n_blocks);
    }
    const ShapeRecords records = shape_records(in, watch_);
    blocks([&](size_t begin, size_t end) {
        std::fill(vectors_.begin() + begin, vectors_.begin() + end, CgVectors<Real>());
        if (!watch_.is_any_changed()) return;
        for (size_t block = begin; block < end; ++block) {
            if (!watch_.are_rows_changed(block)) continue;
            if constexpr (std::is_same_v<Real, float>)
                kernels.expand_for_gradients(records, watch_.row_begin(), rows_.data(), block, block + 1);
            else
                kernels.expand_for_gradients_full(records, watch_.row_begin(), rows_.data(), block, block + 1);
        }
    });
}

template <class Real>
CgArrays<Real> CgStore<Real>::arrays(const CgGroups<Real>* groups, CgParticles<Real>* particles,
                                     const BendingArrays<Real>* bending) {
    return {watch_.row_begin(),
            watch_.neighbours(),
            rows_.data(),
            groups,
            particles,
            vectors_.data(),
            momentum_.data()->numbers,
            pulls_.data()->numbers,
            magnitude_.data(),
            curvature_.data(),
            static_cast<Real>(kOrientationWeight),
            bending};
}

template <class Real>
void ConjugateGradients<Real>::fit(const LaneLayout& layout) {
    groups_.resize(layout.n_blocks()), particles_.resize(layout.n_blocks());
}

template <class Real>
void ConjugateGradients<Real>::take_residual(const LaneLayout::Unit& unit, std::span<const NewtonParticles> newton,
                                             const UnitResidual& residual, const UnitBlocks& blocks) {
    if (!is_seen(residual)) return;
    const double scale = scale_of(residual);
    CgParticles<Real>* to = particles(unit);
    blocks([&](size_t begin, size_t end) {
        for (size_t block = begin; block < end; ++block)
            for (int i = 0; i < 6; ++i)
                for (size_t lane = 0; lane < kLanes; ++lane)
                    to[block].residual[i][lane] = static_cast<Real>(scale * newton[block].residual[i][lane]);
    });
}

template <class Real>
void ConjugateGradients<Real>::pull_on_motion(const SweepInput& in, const LaneLayout& layout, size_t unit,
                                              std::span<NewtonParticles> io_newton, const UnitKernels<Real>& kernels,
                                              const UnitBlocks& blocks, CgStore<Real>& io_store) {
    const LaneLayout::Unit& u = layout.units()[unit];
    io_store.take_up(in, layout, unit, kernels.sweep, blocks);
    CgParticles<Real>* const cg = particles(u);
    CgVectors<Real>* const vectors = io_store.vectors();
    const CgArrays<Real> arrays = io_store.arrays(groups(u), cg, kernels.bending);
    const auto for_lanes = [&](const auto& body) {
        blocks([&](size_t begin, size_t end) {
            for (size_t block = begin; block < end; ++block)
                for (size_t lane = 0; lane < kLanes; ++lane) body(block, lane);
        });
    };
    const auto torque_of = [](const NewtonParticles& p, size_t lane, const Vec3& turn) {
        Sym3 H;
        for (size_t i = 0; i < 6; ++i) H[i] = p.inertia[i][lane];
        return Vec3(to_matrix(H) * turn);
    };
    const auto vector = [](const double(*numbers)[8], size_t lane) {
        return Vec3(numbers[0][lane], numbers[1][lane], numbers[2][lane]);
    };
    for_lanes([&](size_t block, size_t lane) {
        const NewtonParticles& p = io_newton[block];
        const Vec3 force = p.mass[lane] * vector(p.residual, lane);
        const Vec3 torque = torque_of(p, lane, vector(p.residual + 3, lane));
        Real* to = io_store.momentum(block * kLanes + lane);
        for (int i = 0; i < 3; ++i) to[i] = static_cast<Real>(force[i]), to[i + 4] = static_cast<Real>(torque[i]);
        to[3] = to[7] = 0;
        for (size_t i = 0; kernels.bending && i < 6; ++i)
            kernels.bending->motion[8 * (block * kLanes + lane) + i + i / 3] = static_cast<Real>(p.residual[i][lane]);
        for (auto& numbers : cg[block].residual) numbers[lane] = 0;  // nothing of the particle's own in `product`
        if (kernels.bending && lane == 0) kernels.bending->kept[block] = {};
    });
    blocks([&](size_t begin, size_t end) { kernels.newton.fit_groups(arrays, begin, end); });
    blocks([&](size_t begin, size_t end) { kernels.newton.gather_product(arrays, begin, end); });
    for_lanes([&](size_t block, size_t lane) {
        NewtonParticles& p = io_newton[block];
        const CgParticles<Real>& c = cg[block];
        const double own[2] = {static_cast<double>(c.own_shift[lane]) - 1, static_cast<double>(c.own_turn[lane]) - 1};
        const double free[2] = {p.free[lane], p.free_turn[lane]};
        for (size_t i = 0; i < 6; ++i)
            p.residual[i][lane] = free[i / 3] * (-static_cast<double>(vectors[block].product[i][lane]) -
                                                 own[i / 3] * p.residual[i][lane]);
        const Vec3 shift = vector(p.residual, lane), turn = vector(p.residual + 3, lane);
        if (lane == 0) p.magnitude = 0;
        const Vec3 force = p.mass[lane] * shift, torque = torque_of(p, lane, turn);
        p.magnitude += kernels.bending ? bending_magnitude(kernels.bending->diagonal[block], lane, force, torque)
                                       : static_cast<double>(c.inverse_turn[lane]) *
                                             (p.mass[lane] * shift.squaredNorm() + turn.dot(torque));
    });
}

// The two scalar products of an iteration are taken together (Chronopoulos and Gear, 1989).
template <class Real>
double ConjugateGradients<Real>::solve(const SweepInput& in, const LaneLayout& layout, size_t unit,
                                       const UnitResidual& residual, double mean, const UnitKernels<Real>& kernels,
                                       const UnitBlocks& blocks, CgStore<Real>& io_store) {
    // A quiet piece of a violent scene needs no more than its share of what the scene is solved to.
    const double tolerance =
        kTolerance * kTolerance * std::max(1.0, std::max(residual.reference, mean * residual.size) / residual.now);
    if (!is_seen(residual) || tolerance >= 1) return 0;

    const LaneLayout::Unit& u = layout.units()[unit];
    io_store.take_up(in, layout, unit, kernels.sweep, blocks);
    const CgArrays<Real> arrays = io_store.arrays(groups(u), particles(u), kernels.bending);
    blocks([&](size_t begin, size_t end) { kernels.newton.precondition(arrays, begin, end); });
    double rz = total(io_store.magnitude()), last_rz = 1, alpha = 0;
    const int most = kernels.bending ? kMaxBendingIterations : kMaxIterations;
    for (int k = 0; k < most && rz > tolerance; ++k) {
        blocks([&](size_t begin, size_t end) { kernels.newton.fit_groups(arrays, begin, end); });
        blocks([&](size_t begin, size_t end) { kernels.newton.gather_product(arrays, begin, end); });
        const double beta = k == 0 ? 0 : rz / last_rz;
        const double curvature = total(io_store.curvature()) - (k == 0 ? 0 : beta * rz / alpha);
        if (!(curvature > 0)) break;  // nothing left but rounding
        alpha = rz / curvature;
        last_rz = rz;
        blocks([&](size_t begin, size_t end) {
            kernels.newton.advance(arrays, static_cast<Real>(alpha), static_cast<Real>(beta), begin, end);
        });
        rz = total(io_store.magnitude());
    }
    return scale_of(residual);
}

template class CgStore<float>;
template class CgStore<double>;
template class ConjugateGradients<float>;
template class ConjugateGradients<double>;

}  // namespace sunder
