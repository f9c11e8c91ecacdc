#include "nodes/types/carried.h"

#include <algorithm>
#include <array>

#include "nodes/types/solver_scene.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

constexpr double kStep = 1e-3;  // of the frame; differences of places of 1 m are right to 1e-9 m/s2 and (kStep w h)^2

/// The moment that is asked for, and three about it, within the frame.
struct Moments {
    explicit Moments(double share) : middle(std::clamp(share, kStep, 1 - kStep)) {
        shares = {share, middle - kStep, middle, middle + kStep};
    }
    double middle;
    std::array<double, 4> shares;
};

/// `pose`: of a particle from its rest placement at one of the moments, by its number.
template <class PoseAt>
Carried carried(const SimulationMesh& rest, ParticleId i, const Moments& moments, double duration, PoseAt&& pose) {
    std::array<Vec3, 4> x;
    for (size_t m = 0; m < x.size(); ++m) x[m] = pose(m).apply(rest.rest_position[i]);
    const double dt = kStep * duration;
    const Vec3 acceleration = (x[3] - 2 * x[2] + x[1]) / (dt * dt);
    const Vec3 velocity = (x[3] - x[1]) / (2 * dt) + (moments.shares[0] - moments.middle) * duration * acceleration;
    return {i, x[0], velocity, acceleration};
}

std::vector<SourceWay> ways_of(const FrameInput::SourceDrive& drive, const Moments& moments) {
    std::vector<SourceWay> ways;
    for (const double share : moments.shares) ways.emplace_back(*drive.begin, *drive.end, drive.pivot, share);
    return ways;
}

}  // namespace

std::vector<Carried> carried_by(const Scene& scene, const FrameInput& input, const FrameState& end, double share) {
    std::vector<Carried> all;
    const SimulationMesh& rest = scene.rest;
    const Moments moments(share);
    const auto add = [&](ParticleId i, auto&& pose) { all.push_back(carried(rest, i, moments, input.duration, pose)); };
    const auto add_by_source = [&](ParticleId i, const std::vector<SourceWay>& ways) {
        add(i, [&](size_t m) { return ways[m].pose(rest.fragment[i], rest.rest_position[i]); });
    };
    for (size_t k = 0; k < scene.sources.size(); ++k) {
        const std::vector<SourceWay> ways = ways_of(input.sources[k], moments);
        for (const ParticleId i : scene.sources[k].particles)
            if (i < end.inactive.size() && end.inactive[i].follows()) add_by_source(i, ways);
    }
    for (size_t k = 0; k < scene.pins.size(); ++k) {
        if (!input.pins[k].active || !input.pins[k].grip.is_rigid()) continue;
        if (const FrameInput::SourceDrive* source = input.pin_source(k)) {
            const std::vector<SourceWay> ways = ways_of(*source, moments);
            for (const ParticleId i : scene.pins[k].particles) add_by_source(i, ways);
            continue;
        }
        std::array<Pose, 4> poses;
        for (size_t m = 0; m < poses.size(); ++m) poses[m] = interpolate(input.pins[k], moments.shares[m]);
        for (const ParticleId i : scene.pins[k].particles) add(i, [&](size_t m) { return poses[m]; });
    }
    return all;
}

Result<std::vector<Carried>> carried_at(CookContext& context, const Scene& scene, const FrameState& end,
                                        const SceneTime& at) {
    if (scene.pins.empty() && scene.sources.empty()) return std::vector<Carried>();
    const Result<FrameInput> input = frame_input(context, at.grid() + 1);
    if (!input) return input.error();
    return carried_by(scene, *input, end, at.share());
}

}  // namespace sunder
