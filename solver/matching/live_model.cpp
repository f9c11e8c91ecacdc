#include "solver/matching/live_model.h"

#include <atomic>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/thin_groups.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// Waves that run further than this in a step, as a multiple of the piece's size (cbrt of its particles), are not
// resolved.
constexpr double kFarthestWave = 1.6;

// Those of `former` whose rings hold the same particles as before.
std::vector<ParticleId> with_same_ring(std::span<const ParticleId> former, const LiveTopology& before,
                                       const LiveTopology& now, const WorkerPool& workers) {
    std::vector<ParticleId> known(former.begin(), former.end());
    const auto is_same = [&](size_t g) {
        if (now.count(g) != before.count(former[g])) return false;
        for (uint32_t k = 0; k < now.count(g); ++k)
            if (former[now.member(now.begin(g) + k)] != before.member(before.begin(former[g]) + k)) return false;
        return true;
    };
    workers.for_range(known.size(), kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g)
            if (!former[g].is_none() && !is_same(g)) known[g] = ParticleId::none();
    });
    return known;
}

bool is_in_line(const LiveModel& model, const FrameState& state, const WorkerPool& workers) {
    const size_t n = state.n_particles();
    if (model.edges != state.edge_intact || model.hold != state.edge_hold || model.live.begins().size() != n + 1)
        return false;
    std::atomic<bool> same{true};
    workers.for_range(n, kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g)
            if (model.shapes.group[g].plastic_key != plastic_key(state.plastic_deformation[g])) same = false;
    });
    return same;
}

}  // namespace

bool LiveModel::synchronise(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers) {
    SUNDER_ASSERT(state.n_particles() == rest.n_particles() && state.edge_intact.size() == rest.n_edges());
    if (is_in_line(*this, state, workers)) return false;
    live.reset(rest, state.edge_intact, workers);
    shapes.reset(rest, live, state.plastic_deformation, state.edge_hold);
    edges = state.edge_intact, hold = state.edge_hold;
    return true;
}

std::vector<ParticleId> LiveModel::renumber(const SimulationMesh& rest, const FrameState& state,
                                            std::span<const ParticleId> former, const WorkerPool& workers) {
    SUNDER_ASSERT(former.size() == rest.n_particles() && state.n_particles() == rest.n_particles());
    SUNDER_ASSERT(state.edge_intact.size() == rest.n_edges());
    const LiveTopology before = live;
    live.reset(rest, state.edge_intact, workers);
    std::vector<ParticleId> known = with_same_ring(former, before, live, workers);
    shapes.renumber(rest, live, state.plastic_deformation, state.edge_hold, {known, before}, workers);
    edges = state.edge_intact, hold = state.edge_hold;
    return known;
}

void LiveModel::take_up_stiffness(const SimulationMesh& rest, const Material& material, double factor,
                                  ParticleIndex g) {
    stiffness[g] = group_stiffness(shapes.group[g], shapes.rest_trace[g], rest.volume[g], material);
    stiffness[g].k *= factor;
}

void LiveModel::take_up_materials(const SimulationMesh& rest, std::span<const Material> materials,
                                  const FrameState& state, bool may_bend, const WorkerPool& workers) {
    const size_t n = rest.n_particles();
    stiffness.resize(n);
    workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g)
            take_up_stiffness(rest, materials[rest.material_of(g)],
                              state.stiffness_factor.empty() ? 1 : state.stiffness_factor[g], g);
    });
    thin.assign(may_bend && sunder::bends(rest, materials) ? n : 0, 0);
    for (size_t g = 0; g < thin.size(); ++g) thin[g] = bending_kind(rest, materials, g);
}

void LiveModel::take_up_bending(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers) {
    if (thin.empty()) return;
    bending.update(rest, live, shapes, stiffness,
                   {thin, pinned, state.plastic_deformation, state.plastic_curvature, state.edge_offset}, workers);
}

bool resolves_waves(const LiveModel& model, std::span<const ParticleId> particles, double h) {
    if (particles.size() == 1) return true;
    double stiffest = 0;
    for (const ParticleId j : particles) stiffest = std::max(stiffest, model.live.count(j) * model.stiffness[j].k);
    return waves_in_step(h * h * stiffest) <= kFarthestWave * math::cbrt(static_cast<double>(particles.size()));
}

double sum_of_pulls(const LiveModel& model, double h, ParticleIndex i) {
    double b = 0;
    for (uint32_t s = model.live.begin(i); s < model.live.end(i); ++s) {
        const ParticleId g = model.live.member(s);
        b += h * h * model.stiffness[g].k * (model.thin.empty() ? 1 : model.bending.softness(g));
    }
    return b;
}

}  // namespace sunder
