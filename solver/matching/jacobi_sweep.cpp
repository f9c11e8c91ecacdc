#include "solver/matching/jacobi_sweep.h"

#include <algorithm>

#include "solver/data/invariant.h"
#include "solver/lanes/instruction_set.h"

namespace sunder {
JacobiSweep::JacobiSweep() : kernels_(&SUNDER_BEST_KERNELS(kSweepKernels)) {}

void JacobiSweep::take_up(const SweepInput& in, const WorkerPool& workers) {
    if (!layout_.update(in.live, workers)) return;
    units_.resize(layout_.units().size());
    for (size_t u = 0; u < units_.size(); ++u) {
        const LaneLayout::Unit& unit = layout_.units()[u];
        units_[u].particles.resize(unit.n_blocks());
        units_[u].origin.clear();
        for (size_t lane = kLanes * unit.begin_block; lane < kLanes * unit.end_block; ++lane) {
            const ParticleId j = layout_.particle(lane);
            units_[u].origin.push_back(j.is_none() ? j : in.live.piece_particles(in.live.piece(j)).front());
        }
    }
}

void JacobiSweep::apply(const JacobiIteration& iteration, const SweepInput& in, const WorkerPool& workers,
                        std::span<GroupGoal> io_goals, std::span<MovingParticle> io_particles) {
    static_assert(sizeof(GroupGoal) == 4 * sizeof(double));
    SUNDER_ASSERT(io_goals.size() == in.live.ends().size() && io_particles.size() >= io_goals.size());
    SUNDER_ASSERT(iteration.number >= 0 && iteration.number < iteration.of);
    take_up(in, workers);
    for_units(layout_, kSharedUnit, workers, [&](size_t u, size_t, const UnitBlocks& blocks) {
        Unit& unit = units_[u];
        if (iteration.number == 0) {
            unit.is_touched = std::ranges::any_of(
                unit.origin, [&](uint32_t j) { return j != kNone && iteration.is_touched[in.live.piece(j)]; });
            unit.store.open(in, layout_, u, blocks);
            blocks([&](size_t begin, size_t end) {
                unit.store.take_up(in, *kernels_, begin, end);
                unit.store.load(in, io_goals, begin, end);
            });
        } else if (!unit.is_touched) {
            return;
        }
        const SweepArrays<float> arrays = unit.store.arrays();
        const JacobiRecords records{moving_records(io_particles), io_goals.data()->rotation.coeffs().data(),
                                    in.role.data(), unit.store.lane_particles(), unit.origin.data()};
        SweepParticle<float>* const particles = unit.store.particles();
        JacobiParticles* const jacobi = unit.particles.data();
        const auto omega = static_cast<float>(iteration.omega);
        blocks([&](size_t begin, size_t end) { kernels_->take_in(records, particles, jacobi, begin, end); });
        for (int sweeps = unit.is_touched ? 1 : iteration.of; sweeps > 0; --sweeps) {
            blocks([&](size_t begin, size_t end) { kernels_->match(arrays, begin, end); });
            blocks([&](size_t begin, size_t end) {
                kernels_->average(arrays, particles, jacobi, omega, begin, end);
                if (sweeps == 1) kernels_->give_back(records, particles, jacobi, arrays.groups, begin, end);
            });
        }
    });
}

}  // namespace sunder
