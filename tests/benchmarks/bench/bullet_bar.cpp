#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "solver/scene/motion.h"
#include "tests/benchmarks/bench/bullet.h"
#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr float kMatching =
    0.5f;  // share of the way to its goal that a cluster takes a node, as Bullet's examples have
constexpr int kKernelRuns = 200;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

btVector3 to_bullet(const Vec3& v) { return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())}; }

struct Bar {
    btSoftBodyWorldInfo world;
    std::unique_ptr<btSoftBody> body;
    const BenchScene& scene;

    explicit Bar(const BenchScene& s) : scene(s) {
        world.m_gravity.setZero();
        const SimulationMesh& rest = s.scene.rest;
        std::vector<btVector3> positions;
        std::vector<btScalar> masses;
        for (size_t i = 0; i < rest.n_particles(); ++i) {
            positions.push_back(to_bullet(rest.rest_position[i]));
            masses.push_back(btScalar(rest.mass[i]));
        }
        for (const Pin& pin : s.scene.pins)
            for (const uint32_t i : pin.particles) masses[i] = 0;
        body = std::make_unique<btSoftBody>(&world, int(positions.size()), positions.data(), masses.data());
        for (size_t g = 0; g < rest.n_particles(); ++g) {
            auto* cluster = new (btAlignedAlloc(sizeof(btSoftBody::Cluster), 16)) btSoftBody::Cluster();
            cluster->m_collide = false;
            cluster->m_matching = kMatching;
            for (uint32_t slot = rest.group_offset[g]; slot < rest.group_offset[g + 1]; ++slot)
                cluster->m_nodes.push_back(&body->m_nodes[int(rest.group_member[slot])]);
            body->m_clusters.push_back(cluster);
        }
        body->initializeClusters();
    }

    void step(const FrameInput& input, double h, double end) {
        for (size_t k = 0; k < scene.scene.pins.size(); ++k) {
            const Pose pose = interpolate(input.pins[k], end);
            for (const uint32_t i : scene.scene.pins[k].particles)
                body->m_nodes[int(i)].m_x = to_bullet(pose.apply(scene.scene.rest.rest_position[i]));
        }
        body->predictMotion(btScalar(h));
        body->solveConstraints();
        body->integrateMotion();
    }

    bool is_finite() const {
        for (int i = 0; i < body->m_nodes.size(); ++i)
            if (!std::isfinite(body->m_nodes[i].m_x.length2())) return false;
        return true;
    }
};

}  // namespace

Measurement measure_bullet_bar(const NamedScene& named, int frames, int repeats) {
    BenchScene s = named.make();
    const std::unique_ptr<Solver> solver = must(Solver::create(s.scene, 1));
    s.scene = solver->scene();  // with its one-rings
    if (frames > 0) s.frames = frames;

    const int steps = s.settings.substeps * s.settings.iterations;
    const double h = s.input.duration / steps;
    std::vector<double> best(s.frames, HUGE_VAL);
    double kernel = HUGE_VAL;
    for (int k = 0; k < repeats; ++k) {
        Bar bar(s);
        FrameInput input = s.input;
        for (int frame = 0; frame < s.frames; ++frame) {
            s.drive(frame, input);
            const auto begin = Clock::now();
            for (int i = 0; i < steps; ++i) bar.step(input, h, (i + 1.0) / steps);
            best[frame] = std::min(best[frame], seconds_since(begin));
        }
        if (!bar.is_finite()) throw std::runtime_error("Bullet's bar is not finite");
        const auto start = Clock::now();
        for (int i = 0; i < kKernelRuns; ++i) bar.body->updateClusters();
        kernel = std::min(kernel, seconds_since(start));
    }

    Measurement m;
    m.gigahertz = clock_gigahertz();
    const SimulationMesh& rest = s.scene.rest;
    m.particles = rest.n_particles(), m.edges = rest.n_edges(), m.members = rest.group_member.size();
    m.pieces = 1, m.frames = s.frames, m.substeps = s.settings.substeps, m.iterations = s.settings.iterations;
    m.least_ms = 1e3 * quantile(best, 0), m.median_ms = 1e3 * quantile(best, 0.5);
    m.slowest_ms = 1e3 * quantile(best, 0.99);
    m.ns_group = 1e9 * kernel / (double(m.particles) * kKernelRuns);
    m.shape = 1;
    return m;
}

}  // namespace sunder::bench
