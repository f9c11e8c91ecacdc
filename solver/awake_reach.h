// What a part of a scene may touch soon.
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/step.h"

namespace sunder {

/// Of a particle or rigid body, about its centre, m.
double reach_of(const Scene& scene, size_t movable);

inline Aabb ball(const Vec3& center, double radius) {
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
}

/// Boxes that hold each movable that does not rest for so many seconds from its present state, and whatever its
/// contacts reach, by a share `skin` of its radius more; `end`: where pins are then, of the frame. Empty for what
/// rests.
std::vector<Aabb> reach(const StepContext& context, const FrameState& state, std::span<const uint8_t> rests,
                        double seconds, double end, double skin);

/// Which cells of space hold something; it may say yes where it should say no.
class CellFilter {
public:
    /// Of the boxes of those that `counts`.
    CellFilter(std::span<const Aabb> boxes, std::span<const uint8_t> counts, const WorkerPool& workers);

    bool may_meet(const Aabb& box) const;

private:
    bool covers_many(const Aabb& box) const;
    template <class Visit>
    void for_cells(const Aabb& box, const Visit& visit) const;

    double inverse_ = 0;  // of a cell's size, 1/m
    std::vector<std::atomic<uint64_t>> bits_;
    std::vector<Aabb> large_;
};

}  // namespace sunder
