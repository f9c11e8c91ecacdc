#include "solver/matching/newton_step.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/data/invariant.h"
#include "solver/data/rotations.h"
#include "solver/lanes/instruction_set.h"
#include "solver/matching/step_limit.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

// A piece moves freely as a whole, 1 beside the b of its groups in H: with single precision that is 6e-8 of some 7 b.
constexpr double kStiffestSingle = 5e3;  // largest b, -
constexpr size_t kKeptBlocks = 4096;     // scenes of more have rest shapes expanded when they are needed

}  // namespace

NewtonStep::NewtonStep()
    : sweep_kernels_(&SUNDER_BEST_KERNELS(kSweepKernels)), cg_kernels_(&SUNDER_BEST_KERNELS(kNewtonKernels)) {}

size_t NewtonStep::n_stores(const WorkerPool& workers) const {
    return layout_.n_blocks() <= kKeptBlocks ? layout_.units().size() : static_cast<size_t>(workers.threads());
}

size_t NewtonStep::store_of(size_t unit, size_t slot) const { return layout_.n_blocks() <= kKeptBlocks ? unit : slot; }

template <class Real>
UnitKernels<Real> NewtonStep::kernels_of(const Precision<Real>& precision, size_t unit) const {
    const bool bends = unit < precision.bending.size() && precision.bending[unit].bends();
    const BendingArrays<Real>* const bending = bends ? &precision.bending[unit].arrays() : nullptr;
    if constexpr (std::is_same_v<Real, float>)
        return {*sweep_kernels_, bends ? cg_kernels_->single_bending : cg_kernels_->single, bending};
    else
        return {*sweep_kernels_, bends ? cg_kernels_->full_bending : cg_kernels_->full, bending};
}

bool NewtonStep::moves(const SweepInput& in, const LaneLayout::Unit& unit) const {
    const auto lanes = layout_.particles().subspan(kLanes * unit.begin_block, kLanes * unit.n_blocks());
    return std::ranges::any_of(lanes, [&](ParticleId j) { return !j.is_none() && in.role[j] == Role::free; });
}

// Squared, of the whole scene, for a unit of size 1.
double NewtonStep::mean_residual() const {
    double magnitude = 0, size = 0;
    for (const BlockResidual& block : block_residual_) magnitude += block.magnitude, size += block.size;
    return magnitude / size;
}

template <class Real, class Change>
void NewtonStep::find_residuals(Precision<Real>& precision, bool first_iteration, const SweepInput& in,
                                const WorkerPool& workers, std::span<GroupGoal> io_goals,
                                std::span<const MovingParticle> particles, const Change& change) {
    ConjugateGradients<Real>& gradients = precision.gradients;
    gradients.fit(layout_);
    precision.stores.resize(n_stores(workers));
    precision.bending.resize(in.bending ? layout_.units().size() : 0);
    no_rows_.resize(in.bending ? layout_.n_blocks() + 1 : 0);
    for_units(layout_, kSharedUnit, workers, [&](size_t u, size_t slot, const UnitBlocks& blocks) {
        const LaneLayout::Unit& unit = layout_.units()[u];
        UnitResidual& residual = residual_[u];
        if (!first_iteration && !moves(in, unit)) {
            residual.now = 0;
            for (uint32_t block = unit.begin_block; block < unit.end_block; ++block)
                block_residual_[block].magnitude = 0;
            return;
        }
        SweepStore<double>& store = stores_[store_of(u, slot)];
        Scratch& scratch = scratch_[slot];
        scratch.particles.resize(unit.n_blocks()), scratch.ellipsoids.resize(kLanes * unit.n_blocks());
        store.open(in, layout_, u, blocks);
        BendingUnit<Real>* const bending = in.bending ? &precision.bending[u] : nullptr;
        const bool bends = bending && bending->open(in, layout_, u), all_thin = bends && bending->is_all_thin();
        SweepArrays<double> arrays = store.arrays();
        arrays.ellipsoids = scratch.ellipsoids.data();
        if constexpr (std::is_same_v<Real, float>)
            arrays.newton = gradients.groups(unit);
        else
            arrays.newton_full = gradients.groups(unit);
        const NewtonRecords records{moving_records(particles), in.shapes.particle_moment.data()->data(),
                                    in.rest.mass.data(),       in.role.data(),
                                    in.brace.data(),           in.tether.data(),
                                    store.lane_particles()};
        blocks([&](size_t begin, size_t end) {
            sweep_kernels_->take_in_for_newton(records, scratch.particles.data(), store.particles(),
                                               scratch.ellipsoids.data(), begin, end);
        });
        blocks([&](size_t begin, size_t end) {
            for (size_t block = begin; block < end; ++block) {  // what is taken up is matched while it is near
                store.take_up(in, *sweep_kernels_, block, block + 1);
                if (all_thin && bending->all_pull(block)) continue;
                store.load(in, io_goals, block, block + 1);
                sweep_kernels_->match_for_newton(arrays, block, block + 1);
                store.give_rotations(io_goals, block, block + 1);
            }
        });
        if (all_thin) arrays.row_begin = no_rows_.data();  // matched groups pull nothing
        blocks([&](size_t begin, size_t end) {
            if constexpr (std::is_same_v<Real, float>)
                sweep_kernels_->gather_residual(arrays, scratch.particles.data(), gradients.particles(unit), begin,
                                                end);
            else
                sweep_kernels_->gather_residual_full(arrays, scratch.particles.data(), gradients.particles(unit), begin,
                                                     end);
        });
        if (bends) {
            bending->linearise(in, particles, blocks, io_goals);
            bending->add_residual(scratch.particles, {gradients.particles(unit), unit.n_blocks()}, blocks);
        }
        change(u, blocks, std::span(scratch.particles), precision.stores[store_of(u, slot)]);
        residual.now = residual.size = 0;
        double way = 0;
        for (size_t block = 0; block < unit.n_blocks(); ++block) {
            const NewtonParticles& p = scratch.particles[block];
            if (bends && in.is_first) way += p.way;
            block_residual_[unit.begin_block + block] = {p.magnitude, p.size};
            residual.now += p.magnitude, residual.size += p.size;
        }
        // What begins in its own shape, at rest or in steady flight, is solved to a part of what moves it.
        if (first_iteration) residual.reference = std::max(residual.now, way);
        gradients.take_residual(unit, scratch.particles, residual, blocks);
    });
}

template <class Real, class Move>
void NewtonStep::solve(Precision<Real>& precision, const SweepInput& in, const WorkerPool& workers, const Move& move) {
    const double mean = mean_residual();
    for_units(layout_, kSharedUnit, workers, [&](size_t u, size_t slot, const UnitBlocks& blocks) {
        const LaneLayout::Unit& unit = layout_.units()[u];
        CgStore<Real>& store = precision.stores[store_of(u, slot)];
        const double scale =
            precision.gradients.solve(in, layout_, u, residual_[u], mean, kernels_of(precision, u), blocks, store);
        if (scale == 0) return;
        const CgParticles<Real>* solved = precision.gradients.particles(unit);
        const auto for_free = [&](const UnitBlocks& some, const auto& body) {
            some([&](size_t begin, size_t end) {
                for (size_t lane = begin * kLanes; lane < end * kLanes; ++lane) {
                    if (solved[lane / kLanes].inverse_turn[lane % kLanes] == 0) continue;  // held, or padding
                    body(lane, layout_.particle(size_t{kLanes} * unit.begin_block + lane),
                         Vec3(store.shift(lane) / scale), Vec3(store.turn(lane) / scale));
                }
            });
        };
        move(unit, slot, blocks, for_free);
    });
}

template <class Real>
void NewtonStep::apply_in(Precision<Real>& precision, bool first_iteration, const SweepInput& in,
                          const WorkerPool& workers, std::span<GroupGoal> io_goals,
                          std::span<MovingParticle> io_particles) {
    find_residuals(precision, first_iteration, in, workers, io_goals, io_particles, [](const auto&...) {});
    const auto move = [&](const LaneLayout::Unit& unit, size_t slot, const UnitBlocks& blocks, const auto& for_free) {
        std::vector<Quat>& turned = scratch_[slot].turned;
        turned.resize(kLanes * unit.n_blocks());
        const auto cosine = [&](size_t lane, ParticleId j) { return std::abs(io_particles[j].d.dot(turned[lane])); };
        std::atomic<bool> any_far{false};
        for_free(blocks, [&](size_t lane, ParticleId j, const Vec3&, const Vec3& turn) {
            turned[lane] = (rotation_of(turn) * io_particles[j].d).normalized();
            if (StepLimit::may_be_far(cosine(lane, j))) any_far = true;
        });
        const bool is_far = any_far;
        StepLimit limit;
        if (is_far)
            for_free(UnitBlocks(unit.n_blocks(), nullptr), [&](size_t lane, ParticleId j, const Vec3&, const Vec3&) {
                limit.add(in.live.piece(j), cosine(lane, j));
            });
        for_free(blocks, [&](size_t lane, ParticleId j, const Vec3& shift, const Vec3&) {
            MovingParticle& p = io_particles[j];
            const Vec3 x = p.x + shift;
            const double share = is_far ? limit.share(in.live.piece(j)) : 1;
            p.x = share < 1 ? Vec3(p.x + share * (x - p.x)) : x;
            p.d = share < 1 ? slerp(p.d, share, turned[lane]) : turned[lane];
        });
    };
    solve(precision, in, workers, move);
}

template <class Real>
void NewtonStep::damp_in(Precision<Real>& precision, const SweepInput& in, const WorkerPool& workers,
                         std::span<GroupGoal> io_goals, std::span<const MovingParticle> particles,
                         std::span<Vec3> io_shift, std::span<Vec3> io_turn) {
    const auto take_motion = [&](size_t u, const UnitBlocks& blocks, std::span<NewtonParticles> io_newton,
                                 CgStore<Real>& io_store) {
        const size_t first = size_t{kLanes} * layout_.units()[u].begin_block;
        blocks([&](size_t begin, size_t end) {
            for (size_t lane = begin * kLanes; lane < end * kLanes; ++lane) {
                const ParticleId j = layout_.particle(first + lane);
                if (j.is_none()) continue;
                NewtonParticles& block = io_newton[lane / kLanes];
                put_lane(io_shift[j], lane % kLanes, block.residual);
                put_lane(io_turn[j], lane % kLanes, block.residual + 3);
                io_shift[j] = io_turn[j] = Vec3::Zero();
            }
        });
        precision.gradients.pull_on_motion(in, layout_, u, io_newton, kernels_of(precision, u), blocks, io_store);
    };
    find_residuals(precision, true, in, workers, io_goals, particles, take_motion);
    solve(precision, in, workers, [&](const auto&, size_t, const UnitBlocks& blocks, const auto& for_free) {
        for_free(blocks, [&](size_t, ParticleId j, const Vec3& shift, const Vec3& turn) {
            io_shift[j] = shift, io_turn[j] = turn;
        });
    });
}

bool NewtonStep::take_up(const SweepInput& in, const WorkerPool& workers) {
    const size_t n = in.live.ends().size();
    SUNDER_ASSERT(in.rest.n_particles() == n && in.shapes.group.size() == n && in.stiffness.size() == n);
    SUNDER_ASSERT(in.role.size() >= n && in.span.size() >= n && (in.brace.empty() || in.brace.size() >= n) &&
                  (in.tether.empty() || in.tether.size() == n));
    if (layout_.update(in.live, workers)) {
        residual_.resize(layout_.units().size());
        block_residual_.resize(layout_.n_blocks());
    }
    stores_.resize(n_stores(workers));
    scratch_.resize(static_cast<size_t>(workers.threads()));
    std::atomic<bool> any{false};
    workers.for_range(in.stiffness.size(), kParticleGrain, [&](size_t first, size_t last) {
        double stiffest = 0;
        for (size_t g = first; g < last; ++g) {
            const GroupStiffness& s = in.stiffness[g];
            stiffest = std::max(stiffest, in.span[g] * in.span[g] * s.k * (1 + s.volume_ratio));
        }
        if (stiffest > kStiffestSingle) any = true;
    });
    return any;
}

void NewtonStep::apply(bool first_iteration, const SweepInput& in, const WorkerPool& workers,
                       std::span<GroupGoal> io_goals, std::span<MovingParticle> io_particles) {
    SUNDER_ASSERT(io_goals.size() == in.live.ends().size() && io_particles.size() >= io_goals.size());
    if (take_up(in, workers))
        apply_in(full_, first_iteration, in, workers, io_goals, io_particles);
    else
        apply_in(single_, first_iteration, in, workers, io_goals, io_particles);
}

void NewtonStep::damp(const SweepInput& in, const WorkerPool& workers, std::span<GroupGoal> io_goals,
                      std::span<const MovingParticle> particles, std::span<Vec3> io_shift, std::span<Vec3> io_turn) {
    SUNDER_ASSERT(io_shift.size() == io_turn.size() && io_shift.size() >= io_goals.size());
    if (take_up(in, workers))
        damp_in(full_, in, workers, io_goals, particles, io_shift, io_turn);
    else
        damp_in(single_, in, workers, io_goals, particles, io_shift, io_turn);
}

}  // namespace sunder
