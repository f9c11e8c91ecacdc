// How far groups are stretched where their particles are now, four groups at a time.
#pragma once

#include <span>

#include "solver/matching/shape_matching.h"
#include "solver/material/stretch_kernels.h"

namespace sunder {

/// The optimal rotation (Eq. 1) and stretch (Eq. 8) of groups, and its principal stretches.
class GroupStretcher {
public:
    /// All of it must stay while this is used; `goals` may change.
    GroupStretcher(const LiveTopology& live, const GroupShapes& shapes, std::span<const MovingParticle> particles,
                   std::span<const GroupGoal> goals);

    /// Rotations start from the goals'. A group may be among the four more than once.
    void measure(const uint32_t (&groups)[4], GroupStretches& o_stretches) const {
        kernels_->measure(records_, groups, o_stretches);
    }
    /// Principal stretches and directions of what was measured.
    void decompose(const GroupStretches& stretches, PrincipalLanes& o_principal) const {
        kernels_->decompose(stretches, o_principal);
    }
    const StretchKernels& kernels() const { return *kernels_; }

private:
    StretchRecords records_;
    const StretchKernels* kernels_;
};

/// Of one of the four.
PrincipalStretch principal_stretch(const PrincipalLanes& principal, size_t i);
/// Its largest |log lambda|, lambda clamped to [0.1, 10].
double largest_strain(const PrincipalLanes& principal, size_t i);

}  // namespace sunder
