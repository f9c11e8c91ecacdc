#include "solver/jacobi_sweep.h"

#include "solver/instruction_set.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = LaneLayout::kLanes;

}  // namespace

JacobiSweep::JacobiSweep() : kernels_(&kSweepKernelsPortable) {
#ifdef SUNDER_HAS_AVX2
    if (instruction_set() == InstructionSet::avx2) kernels_ = &kSweepKernelsAvx2;
#endif
}

void JacobiSweep::load_inertial(const SweepInput& in, std::span<const MovingParticle> particles, size_t begin,
                                size_t end) {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t j = store_.layout().particle(l);
        if (j == LaneLayout::kNone) continue;
        JacobiParticles& to = particles_[l / kLanes];
        put_lane(Vec3(particles[j].x_inertial - piece_origin(in.live, particles, j)), l % kLanes, to.x_inertial);
        put_lane(particles[j].d_inertial, l % kLanes, to.d_inertial);
    }
}

void JacobiSweep::move(const SweepInput& in, std::span<MovingParticle> io_particles, size_t begin, size_t end) const {
    for (size_t l = begin * kLanes; l < end * kLanes; ++l) {
        const uint32_t j = store_.layout().particle(l);
        if (j == LaneLayout::kNone || in.held[j]) continue;
        const JacobiParticles& from = particles_[l / kLanes];
        MovingParticle& p = io_particles[j];
        for (int i = 0; i < 3; ++i) p.x(i) += static_cast<double>(from.x_step[i][l % kLanes]);
        for (int i = 0; i < 4; ++i) p.d.coeffs()(i) = static_cast<double>(from.d[i][l % kLanes]);
        p.d.normalize();
        p.D = p.d.toRotationMatrix();
    }
}

void JacobiSweep::apply(const SweepInput& in, double omega, const WorkerPool& workers, std::span<GroupGoal> io_goals,
                        std::span<MovingParticle> io_particles) {
    constexpr size_t kGrain = SweepStore<float>::kGrain;
    if (store_.take_up(in, workers)) particles_.assign(store_.layout().n_blocks(), JacobiParticles());
    const SweepArrays<float> arrays = store_.arrays();
    const size_t n_blocks = store_.layout().n_blocks();
    workers.for_range(n_blocks, kGrain, [&](size_t begin, size_t end) {
        store_.load(in, io_particles, io_goals, begin, end);
        load_inertial(in, io_particles, begin, end);
    });
    workers.for_range(n_blocks, kGrain, [&](size_t begin, size_t end) {
        kernels_->match(arrays, begin, end);
        store_.give_rotations(io_goals, begin, end);
    });
    workers.for_range(n_blocks, kGrain, [&](size_t begin, size_t end) {
        kernels_->average(arrays, particles_.data(), static_cast<float>(omega), begin, end);
        move(in, io_particles, begin, end);
    });
}

}  // namespace sunder
