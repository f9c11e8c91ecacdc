// The elastic energy of one group (docs/theory.md, "Elasticity"), for the books of what breaks.
#pragma once

#include <span>

#include "solver/matching/live_model.h"

namespace sunder {

/// Of a group as its shape is, wherever its members are.
class GroupEnergy {
public:
    GroupEnergy(const LiveModel& model, ParticleIndex group);
    /// J. `start`: a rotation near the group's.
    double at(std::span<const MovingParticle> particles, const Quat& start) const;

private:
    const LiveModel& model_;
    ParticleIndex group_;
    // Of A_qq: its trace, kg m2; its inverse where it has any; the directions in which it has none.
    double trace_ = 0;
    Mat3 inverse_ = Mat3::Zero(), flat_ = Mat3::Zero();
};

}  // namespace sunder
