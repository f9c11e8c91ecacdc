// What a step is taken of, with and when.
#pragma once

#include <span>

#include "solver/scene/scene.h"
#include "solver/threads/parallel.h"

namespace sunder {

struct StepContext {
    const Scene& scene;
    const FrameInput& input;
    const SolverSettings& settings;
    const WorkerPool& workers;
    double contact_margin;  // how far beyond touching contacts reach, m
    // Sleepers, and what stands by: there to be touched, and nothing moves them (n_movables), or empty.
    std::span<const uint8_t> fixed = {};
    bool wakes = true;  // a step that is felt by what is fixed ends there and tells what to wake

    size_t n_particles() const { return scene.rest.n_particles(); }
    size_t n_movables() const { return n_particles() + scene.rigid_bodies.size(); }
    const Material& material(ParticleIndex particle) const { return input.materials[scene.rest.material_of(particle)]; }
};

/// In `FrameState::asleep` and `StepContext::fixed`, of what moves, but not in this step: it feels whatever may come to
/// touch it.
constexpr uint8_t kStandsBy = 2;

/// Where a step stands in its pair (second_order.h).
enum class Stage { alone, first, second };

/// The second where one has begun.
inline Stage stage_of(bool begun, bool last) { return begun ? Stage::second : last ? Stage::alone : Stage::first; }

/// A step of h seconds; `begin` and `end` say where in the frame it is, in [0, 1]. `measure`: it also writes the strain
/// of groups that neither flow nor break.
struct StepTime {
    Stage stage;
    double h, begin, end;
    bool measure;
};

}  // namespace sunder
