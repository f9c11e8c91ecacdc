#include "solver/awake_reach.h"

#include <bit>
#include <cmath>

#include "solver/collision/shape_distance.h"
#include "solver/data/invariant.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"

namespace sunder {

double reach_of(const Scene& scene, size_t i) {
    const size_t n = scene.rest.n_particles();
    return i < n ? scene.rest.radii[i].maxCoeff() : bounding_radius(scene.rigid_bodies[i - n].shape);
}

std::vector<Aabb> reach(const StepContext& context, const FrameState& state, std::span<const uint8_t> rests,
                        double seconds, double end, double skin) {
    const size_t n = state.n_particles();
    SUNDER_ASSERT(rests.size() == n + state.rigid_bodies.size() && seconds > 0 && skin >= 0);
    const double fall = fall_in_step(seconds, acceleration_of(context.input));
    std::vector<Aabb> boxes(rests.size());
    std::vector<double> size(rests.size());
    const auto find = [&](size_t i) {
        const bool is_particle = i < n;
        const RigidBodyState* rigid = is_particle ? nullptr : &state.rigid_bodies[i - n];
        const Vec3& x = is_particle ? state.position[i] : rigid->position;
        const Vec3 way = seconds * (is_particle ? state.velocity[i] : rigid->velocity);
        const double angle = seconds * (is_particle ? state.angular_velocity[i] : rigid->angular_velocity).norm();
        const double radius = reach_of(context.scene, i);
        size[i] = radius * (1 + skin + std::min(angle, 1.0)) + context.contact_margin + fall + skin * way.norm();
        boxes[i] = ball(x, size[i]);
        boxes[i].min += way.cwiseMin(0.0), boxes[i].max += way.cwiseMax(0.0);
    };
    context.workers.for_range(rests.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (!rests[i]) find(i);
    });
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        if (!context.input.pins[k].active) continue;
        const Pose pose = interpolate(context.input.pins[k], end);
        for (const ParticleId i : context.scene.pins[k].particles) {
            if (rests[i]) continue;
            const Aabb there = ball(pose.apply(context.scene.rest.rest_position[i]), size[i]);
            boxes[i].extend(there.min), boxes[i].extend(there.max);
        }
    }
    return boxes;
}

template <class Visit>
void CellFilter::for_cells(const Aabb& box, const Visit& visit) const {
    const auto cell = [&](double x) { return static_cast<int64_t>(std::floor(x * inverse_)); };
    for (int64_t x = cell(box.min.x()); x <= cell(box.max.x()); ++x)
        for (int64_t y = cell(box.min.y()); y <= cell(box.max.y()); ++y)
            for (int64_t z = cell(box.min.z()); z <= cell(box.max.z()); ++z) {
                uint64_t k = uint64_t(x) * 0x9e3779b97f4a7c15u + uint64_t(y) * 0xc2b2ae3d27d4eb4fu +
                             uint64_t(z) * 0x165667b19e3779f9u;
                k = (k ^ k >> 32) * 0xd6e8feb86659fd93u;
                visit((k ^ k >> 32) & (64 * bits_.size() - 1));
            }
}

CellFilter::CellFilter(std::span<const Aabb> boxes, std::span<const uint8_t> counts, const WorkerPool& workers) {
    SUNDER_ASSERT(counts.size() == boxes.size());
    double extent = 0;
    size_t n_boxes = 0;
    for (size_t i = 0; i < boxes.size(); ++i)
        if (counts[i]) extent += (boxes[i].max - boxes[i].min).maxCoeff(), ++n_boxes;
    inverse_ = 1 / std::max(extent / static_cast<double>(std::max<size_t>(n_boxes, 1)), 1e-6);
    bits_ = std::vector<std::atomic<uint64_t>>(std::bit_ceil(64 * n_boxes + 1024) / 64);
    for (size_t i = 0; i < boxes.size(); ++i)
        if (counts[i] && covers_many(boxes[i])) large_.push_back(boxes[i]);
    const auto mark = [&](uint64_t bit) {  // in any order
        std::atomic<uint64_t>& word = bits_[bit / 64];
        const uint64_t mask = uint64_t{1} << bit % 64;
        if (!(word.load(std::memory_order_relaxed) & mask)) word.fetch_or(mask, std::memory_order_relaxed);
    };
    workers.for_range(boxes.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (counts[i] && !covers_many(boxes[i])) for_cells(boxes[i], mark);
    });
}

bool CellFilter::may_meet(const Aabb& box) const {
    for (const Aabb& other : large_)
        if (overlap(box, other)) return true;
    if (covers_many(box)) return true;
    bool meets = false;
    for_cells(box, [&](uint64_t bit) { meets |= bits_[bit / 64] >> bit % 64 & 1; });
    return meets;
}

bool CellFilter::covers_many(const Aabb& box) const {
    const Vec3 cells = (box.max - box.min) * inverse_ + Vec3::Ones();
    return !(cells.prod() < 512) || !(box.min.cwiseAbs().maxCoeff() * inverse_ < 1e9);
}

}  // namespace sunder
