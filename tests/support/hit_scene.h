// A brittle block that a weight hits.
#pragma once

#include "tests/support/lattice_scene.h"

namespace sunder::test {

inline RigidBody ball(const Vec3& position, double mass, const Vec3& velocity) {
    RigidBody b;
    b.name = "ball";
    b.shape.radius = 0.15;
    b.mass = mass;
    b.pose.position = position;
    b.velocity = velocity;
    return b;
}

struct Hit {
    Scene scene;
    std::vector<Material> materials = {Material()};
    SolverSettings settings;
    double gravity = 9.81;

    explicit Hit(double off_centre = 0) {
        LatticeBody block;
        block.cells = {10, 6, 4}, block.spacing = 0.1;
        add_body(scene, lattice_mesh(block));
        materials[0].youngs_modulus = 5e5, materials[0].toughness = 0.1;
        scene.rigid_bodies.push_back(ball(Vec3(off_centre, 0.04, 0.57), 300, Vec3(0, 0, -6)));
    }
    void add_floor() {
        Collider floor;
        floor.name = "floor", floor.shape.kind = ShapeKind::plane;
        scene.colliders.push_back(floor);
    }
    FrameInput input() const {
        FrameInput in = quiet_input(scene, Material());
        in.materials = materials, in.gravity = Vec3(0, 0, -gravity);
        return in;
    }
    FrameState start(const Solver& solver) const { return solver.initial_state(materials); }
};

}  // namespace sunder::test
