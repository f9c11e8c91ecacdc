// A substep in which something is hit, by what hangs together with the hit in parts, by all else as if nothing was hit:
// so that the parts cost only where they are needed.
#pragma once

#include <cmath>
#include <span>

#include "solver/data/progress.h"
#include "solver/sleep/awake_scene.h"

namespace sunder {

/// Calls take(time) for each of so many parts of a substep, two by two as pairs, until one fails. `progress`: of the
/// frame.
template <class Take>
Status in_parts(int parts, const StepTime& whole, const Progress& progress, const Take& take) {
    for (int k = 0; k < parts; ++k) {
        const auto at = [&](int part) { return std::lerp(whole.begin, whole.end, double(part) / parts); };
        const bool last = k + 1 == parts;
        if (!progress.report(at(k), "simulating")) return cancelled();
        const StepTime part{stage_of(k % 2 == 1, last), whole.h / parts, at(k), at(k + 1), whole.measure && last};
        if (Status ok = take(part); !ok) return ok;
    }
    return {};
}

/// Of a part of a substep, which needs no more Newton steps and passes than this, whatever the settings say.
SolverSettings settings_of_parts(const SolverSettings& settings);

class LocalHit {
public:
    /// Whether `advance` is cheaper than all of the scene in parts. `hit`: as Hit's, of the whole scene.
    static bool pays(std::span<const uint8_t> hit, int parts, const FrameState& state);

    /// Takes a substep of all that is awake. Where what is hit comes to touch anything else, nothing is done, and false
    /// is given: then all is to take the parts. `io_pair`: of all that is awake, from the first to the second substep;
    /// what is hit leaves it.
    Result<bool> advance(const StepContext& whole, std::span<const uint8_t> hit, int parts, const StepTime& time,
                         const Progress& progress, FrameState& io_state, StepPair& io_pair, StepReport& io_report);

private:
    AwakeScene hit_, rest_;
};

}  // namespace sunder
