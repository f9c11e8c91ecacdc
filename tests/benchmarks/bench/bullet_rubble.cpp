#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "tests/benchmarks/bench/bullet.h"
#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr float kMargin =
    0.005f;  // round the hulls, m: a twentieth of a fragment; with 1, 10 and 40 mm it is no faster

btVector3 to_bullet(const Vec3& v) { return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())}; }

struct Rubble {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broad_phase;
    btSequentialImpulseConstraintSolver constraints;
    btDiscreteDynamicsWorld world{&dispatcher, &broad_phase, &constraints, &configuration};
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> bodies;  // the fragments, then the floor

    Rubble(const Scene& scene, const FrameInput& input) {
        world.setGravity(to_bullet(input.gravity));
        const SimulationMesh& rest = scene.rest;
        for (size_t i = 0; i < rest.n_particles(); ++i) {
            auto hull = std::make_unique<btConvexHullShape>();
            for (const Vec3f& p : rest.hull(i)) hull->addPoint({p.x(), p.y(), p.z()}, false);
            hull->setMargin(kMargin);
            hull->recalcLocalAabb();
            const btTransform place(btQuaternion::getIdentity(), to_bullet(rest.rest_position[i]));
            btRigidBody& body =
                add(std::move(hull), btScalar(rest.mass[i]), place, btScalar(input.materials[rest.body[i]].friction));
            body.setLinearVelocity(to_bullet(scene.bodies[rest.body[i]].velocity));
            body.setActivationState(DISABLE_DEACTIVATION);
        }
        add(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)), 0, btTransform::getIdentity(),
            btScalar(scene.colliders[0].friction));
    }
    ~Rubble() {
        for (const auto& body : bodies) world.removeRigidBody(body.get());
    }

    btRigidBody& add(std::unique_ptr<btCollisionShape> shape, btScalar mass, const btTransform& place,
                     btScalar friction) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) shape->calculateLocalInertia(mass, inertia);
        btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(), inertia);
        info.m_startWorldTransform = place;
        info.m_friction = std::sqrt(friction);  // Bullet multiplies, Sunder takes the geometric mean
        shapes.push_back(std::move(shape));
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }

    std::vector<Vec3> positions(size_t n) const {
        std::vector<Vec3> out;
        for (size_t i = 0; i < n; ++i) {
            const btVector3& x = bodies[i]->getWorldTransform().getOrigin();
            if (!std::isfinite(x.length2())) throw std::runtime_error("Bullet's rubble is not finite");
            out.emplace_back(x.x(), x.y(), x.z());
        }
        return out;
    }
};

}  // namespace

Measurement measure_bullet_rubble(const NamedScene& named, int frames, int repeats) {
    BenchScene s = named.make();
    const std::unique_ptr<Solver> solver = must(Solver::create(std::move(s.scene), 1));
    if (frames > 0) s.frames = frames;
    const size_t n = solver->scene().rest.n_particles();

    Measurement m;
    std::vector<double> best(s.frames, HUGE_VAL);
    for (int k = 0; k < repeats; ++k) {
        Rubble rubble(solver->scene(), s.input);
        std::vector<Vec3> before;
        for (int frame = 0; frame < s.frames; ++frame) {
            before = rubble.positions(n);
            const auto begin = Clock::now();
            for (int i = 0; i < s.settings.substeps; ++i)
                rubble.world.stepSimulation(btScalar(s.input.duration / s.settings.substeps), 0);
            best[frame] = std::min(best[frame], std::chrono::duration<double>(Clock::now() - begin).count());
        }
        std::vector<Quat> orientation;
        for (size_t i = 0; i < n; ++i) {
            const btQuaternion q = rubble.bodies[i]->getWorldTransform().getRotation();
            orientation.push_back(Quat(q.w(), q.x(), q.y(), q.z()) * solver->scene().rest.rest_orientation[i]);
        }
        m.lies = how_things_lie(*solver, s.input.duration, before, rubble.positions(n), orientation);
        m.contacts = 0;
        for (int i = 0; i < rubble.dispatcher.getNumManifolds(); ++i)
            m.contacts += static_cast<size_t>(rubble.dispatcher.getManifoldByIndexInternal(i)->getNumContacts());
    }
    m.gigahertz = clock_gigahertz();
    m.particles = n, m.members = n, m.pieces = n;
    m.frames = s.frames, m.substeps = s.settings.substeps, m.iterations = btContactSolverInfo().m_numIterations;
    m.least_ms = 1e3 * quantile(best, 0), m.median_ms = 1e3 * quantile(best, 0.5);
    m.slowest_ms = 1e3 * quantile(best, 0.99);
    m.contact = 1;
    return m;
}

bool bullet_knows(const std::string& scene) { return scene.starts_with("bar") || scene == "rubble"; }

Measurement measure_bullet(const NamedScene& scene, int frames, int repeats) {
    return scene.name == std::string("rubble") ? measure_bullet_rubble(scene, frames, repeats)
                                               : measure_bullet_bar(scene, frames, repeats);
}

}  // namespace sunder::bench
