// What forces that differ from place to place do to one thing.
#pragma once

#include <span>
#include <vector>

#include "solver/scene/pressure.h"

namespace sunder {

/// Added to what forces do that are the same everywhere (FieldsOfForce).
struct Pull {
    Vec3 acceleration = Vec3::Zero();  // of what does not move, m/s2
    double drag = 0;                   // 1/s
    Vec3 turn = Vec3::Zero();          // the same of spins, rad/s2
    double turn_drag = 0;              // 1/s

    bool acts() const { return drag > 0 || !acceleration.isZero(0) || turn_drag > 0; }
};

/// A particle or rigid body, and a step that it is about to take.
struct Pulled {
    MovableIndex movable;
    const Vec3& place;          // m
    const Quat& turn;           // since rest
    double h;                   // s
    double begin = 0, end = 1;  // of the step, in the frame
};

/// Those of a frame that act all along it; blasts do not. `asleep`: what does not move in the step, or empty.
class LocalFields {
public:
    LocalFields(const Scene& scene, const FrameInput& input, const FrameState& state,
                std::span<const uint8_t> asleep = {});
    bool empty() const { return forces_.empty(); }
    Pull on(const Pulled& thing) const;

private:
    struct Acting {
        const LocalForce* force;
        uint32_t body;  // that alone it acts on, or none: on all
        Gas gas;        // of a pressure
    };
    const SimulationMesh& rest_;
    std::vector<Acting> forces_;
};

}  // namespace sunder
