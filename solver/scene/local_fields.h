// What forces that differ from place to place do to one thing.
#pragma once

#include <vector>

#include "solver/scene/local_force.h"

namespace sunder {

/// Added to what forces do that are the same everywhere (FieldsOfForce).
struct Pull {
    Vec3 acceleration = Vec3::Zero();  // of what does not move, m/s2
    double drag = 0;                   // 1/s

    bool acts() const { return drag > 0 || !acceleration.isZero(0); }
};

/// Those of a frame that act all along it; blasts do not.
class LocalFields {
public:
    explicit LocalFields(const FrameInput& input);
    bool empty() const { return forces_.empty(); }
    Pull at(const Vec3& place) const;

private:
    std::vector<const LocalForce*> forces_;
};

}  // namespace sunder
