#include "solver/newton_step.h"

#include <algorithm>
#include <cmath>

#include "solver/instruction_set.h"
#include "solver/motion.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = LaneLayout::kLanes;
// A piece moves freely as a whole, 1 beside the b of its groups in H: with single precision that is 6e-8 of some 7 b.
constexpr double kStiffestSingle = 5e3;  // largest b, -

}  // namespace

NewtonStep::NewtonStep() : sweep_kernels_(&kSweepKernelsPortable), cg_kernels_(&kNewtonKernelsPortable) {
#ifdef SUNDER_HAS_AVX2
    if (instruction_set() == InstructionSet::avx2)
        sweep_kernels_ = &kSweepKernelsAvx2, cg_kernels_ = &kNewtonKernelsAvx2;
#endif
}

void NewtonStep::load(const SweepInput& in, std::span<const MovingParticle> particles, size_t begin, size_t end) {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t j = store_.layout().particle(l);
        if (j == LaneLayout::kNone) continue;
        const MovingParticle& p = particles[j];
        NewtonParticles& to = newton_[l / kLanes];
        const size_t lane = l % kLanes;
        const Sym3 H = to_sym(in.inertia[j]);
        put_lane(p.x, lane, to.x), put_lane(p.d, lane, to.d);
        put_lane(p.x_inertial, lane, to.x_inertial), put_lane(p.d_inertial, lane, to.d_inertial);
        put_lane(H, lane, to.inertia);
        to.mass[lane] = in.rest.mass[j];
        to.free[lane] = in.held[j] ? 0 : 1;
        std::copy(H.begin(), H.end(), inertia_[l].H);
    }
}

template <class Real>
void NewtonStep::prepare(ConjugateGradients<Real>& gradients, const SweepInput& in, const WorkerPool& workers,
                         std::span<GroupGoal> io_goals, std::span<const MovingParticle> particles) {
    const LaneLayout& layout = store_.layout();
    gradients.take_up(in, layout, workers);
    SweepArrays<double> arrays = store_.arrays();
    arrays.inertia = inertia_.data();
    const auto for_blocks = [&](const auto& body) {
        workers.for_range(layout.n_blocks(), SweepStore<double>::kGrain, body);
    };
    for_blocks([&](size_t begin, size_t end) {
        store_.load(in, particles, io_goals, begin, end);
        load(in, particles, begin, end);
    });
    if constexpr (std::is_same_v<Real, float>)
        arrays.newton = gradients.groups();
    else
        arrays.newton_full = gradients.groups();
    for_blocks([&](size_t begin, size_t end) {
        sweep_kernels_->match_for_newton(arrays, begin, end);
        store_.give_rotations(io_goals, begin, end);
    });
    for_blocks([&](size_t begin, size_t end) {
        if constexpr (std::is_same_v<Real, float>)
            sweep_kernels_->gather_residual(arrays, newton_.data(), gradients.particles(), begin, end);
        else
            sweep_kernels_->gather_residual_full(arrays, newton_.data(), gradients.particles(), begin, end);
    });
}

template <class Real>
void NewtonStep::apply_in(ConjugateGradients<Real>& gradients, const NewtonKernels<Real>& kernels, bool first_iteration,
                          const SweepInput& in, const WorkerPool& workers, std::span<GroupGoal> io_goals,
                          std::span<MovingParticle> io_particles) {
    const LaneLayout& layout = store_.layout();
    prepare(gradients, in, workers, io_goals, io_particles);
    gradients.solve(first_iteration, layout, newton_, kernels, workers, reference_);
    workers.for_range(layout.n_lanes(), kLanes * SweepStore<double>::kGrain, [&](size_t begin, size_t end) {
        for (size_t lane = begin; lane < end; ++lane) {
            if (!gradients.is_moved(lane)) continue;
            MovingParticle& p = io_particles[layout.particle(lane)];
            p.x += gradients.shift(lane);
            p.d = (rotation_of(gradients.turn(lane)) * p.d).normalized();
            p.D = p.d.toRotationMatrix();
        }
    });
}

template <class Real>
void NewtonStep::damp_in(ConjugateGradients<Real>& gradients, const NewtonKernels<Real>& kernels, const SweepInput& in,
                         const WorkerPool& workers, std::span<GroupGoal> io_goals,
                         std::span<const MovingParticle> particles, std::span<Vec3> io_shift, std::span<Vec3> io_turn) {
    const LaneLayout& layout = store_.layout();
    prepare(gradients, in, workers, io_goals, particles);
    for (size_t lane = 0; lane < layout.n_lanes(); ++lane) {
        const uint32_t j = layout.particle(lane);
        if (j == LaneLayout::kNone) continue;
        NewtonParticles& block = newton_[lane / kLanes];
        put_lane(io_shift[j], lane % kLanes, block.residual), put_lane(io_turn[j], lane % kLanes, block.residual + 3);
        io_shift[j] = io_turn[j] = Vec3::Zero();
    }
    gradients.pull_on_motion(layout, newton_, kernels, workers);
    gradients.solve(true, layout, newton_, kernels, workers, reference_);
    for (size_t lane = 0; lane < layout.n_lanes(); ++lane) {
        if (!gradients.is_moved(lane)) continue;
        const uint32_t j = layout.particle(lane);
        io_shift[j] = gradients.shift(lane), io_turn[j] = gradients.turn(lane);
    }
}

bool NewtonStep::take_up(const SweepInput& in, const WorkerPool& workers) {
    if (store_.take_up(in, workers)) {
        const LaneLayout& layout = store_.layout();
        newton_.assign(layout.n_blocks(), NewtonParticles());
        for (NewtonParticles& p : newton_) std::fill_n(p.d[3], kLanes, 1.0), std::fill_n(p.d_inertial[3], kLanes, 1.0);
        inertia_.assign(layout.n_lanes(), InertiaRecord());
        reference_.resize(layout.units().size());
    }
    double stiffest = 0;
    for (size_t g = 0; g < in.stiffness.size(); ++g) {
        const GroupStiffness& s = in.stiffness[g];
        stiffest = std::max(stiffest, in.span[g] * in.span[g] * s.k * (1 + s.volume_ratio));
    }
    return stiffest > kStiffestSingle;
}

void NewtonStep::apply(bool first_iteration, const SweepInput& in, const WorkerPool& workers,
                       std::span<GroupGoal> io_goals, std::span<MovingParticle> io_particles) {
    if (take_up(in, workers))
        apply_in(full_, cg_kernels_->full, first_iteration, in, workers, io_goals, io_particles);
    else
        apply_in(single_, cg_kernels_->single, first_iteration, in, workers, io_goals, io_particles);
}

void NewtonStep::damp(const SweepInput& in, const WorkerPool& workers, std::span<GroupGoal> io_goals,
                      std::span<const MovingParticle> particles, std::span<Vec3> io_shift, std::span<Vec3> io_turn) {
    if (take_up(in, workers))
        damp_in(full_, cg_kernels_->full, in, workers, io_goals, particles, io_shift, io_turn);
    else
        damp_in(single_, cg_kernels_->single, in, workers, io_goals, particles, io_shift, io_turn);
}

}  // namespace sunder
