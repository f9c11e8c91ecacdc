// What stands between the centre of a blast and things.
#pragma once

#include <vector>

#include "solver/collision/shape_distance.h"
#include "solver/scene/local_force.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Straight lines from the centre to the middle of a thing: what crosses one hides it. Fragments are taken for their
/// ellipsoids, larger by so much that those of a wall leave no gaps. What the centre lies in hides nothing.
class BlastShadow {
public:
    BlastShadow(const StepContext& context, const Blast& blast, const FrameState& state);

    /// Whether anything but itself hides a movable whose middle is `there`.
    bool hides(MovableId movable, const Vec3& there) const;

private:
    struct Solid {
        PlacedShape shape;
        MovableId owner;  // none: a collider
    };
    struct Fragment {
        Vec3 center;   // from the blast's centre, m
        Mat3 to_unit;  // takes its ellipsoid about it to the unit ball
        MovableId owner;
    };

    void add_solids(const StepContext& context, const FrameState& state);
    void add_fragments(const StepContext& context, const FrameState& state);
    void add_to_cells(uint32_t fragment, double radius);

    Vec3 center_;
    std::vector<Solid> solids_;
    std::vector<Fragment> fragments_;
    std::vector<std::vector<uint32_t>> cells_;  // of directions: the fragments that lie in them, or empty
};

}  // namespace sunder
