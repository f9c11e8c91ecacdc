// Things that begin in one another, as an artist's do: they part, and no faster than they are asked to. Boxes that
// began in soft blocks squeezed them from all sides, until both left at up to 125 m/s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "solver/scene/motion.h"
#include "tests/stability/random_shot.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Two or three of: blocks of 1 to 125 fragments, spheres and boxes that move, and colliders; above a floor or nothing.
struct Tangle {
    Scene scene;
    std::vector<Material> materials;
    std::vector<DrivenPose> poses;  // of the colliders
    std::string what;

    // `breaks_at`: waves that carry such a speed break the blocks, m/s.
    Tangle(uint64_t seed, double breaks_at) : draw_(seed), size_(draw_.logarithmic(0.1, 2)), breaks_at_(breaks_at) {
        if (draw_.one_in(2)) add_floor();
        const double near = size_ * draw_.uniform(0.2, 1);
        for (uint64_t left = 2 + draw_.index(2); left > 0; --left) {
            const Vec3 at(near * draw_.uniform(-0.5, 0.5), near * draw_.uniform(-0.5, 0.5),
                          near * draw_.uniform(-0.3, 0.8));
            const Pose pose{at, rotation_of(draw_.vector(2))};
            if (materials.empty() || !draw_.one_in(3))
                add_block(pose);
            else
                add_solid(pose);
        }
    }

    // The fastest that anything ever was, m/s: bodies as wholes, or each fragment.
    double fastest(const SolverSettings& settings, bool as_wholes, int frames) const {
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state(materials);
        FrameInput in = test::quiet_input(scene, materials.front());
        in.materials = materials, in.colliders = poses;
        double fastest = 0;
        for (int frame = 0; frame < frames; ++frame) {
            test::advance(*solver, in, settings, state);
            for (const Body& body : scene.bodies) {
                Vec3 momentum = Vec3::Zero();
                double mass = 0;
                for (uint32_t i = body.particle_begin; i < body.particle_end; ++i)
                    momentum += scene.rest.mass[i] * state.velocity[i], mass += scene.rest.mass[i];
                fastest = std::max(fastest, momentum.norm() / mass);
            }
            for (const Vec3& velocity : state.velocity)
                if (!as_wholes) fastest = std::max(fastest, velocity.norm());
            for (const RigidBodyState& body : state.rigid_bodies) fastest = std::max(fastest, body.velocity.norm());
        }
        return fastest;
    }

private:
    void add_floor() {
        Shape plane;
        plane.kind = ShapeKind::plane;
        add_collider(plane, Pose());
        what += "floor ";
    }
    void add_collider(const Shape& shape, const Pose& pose) {
        Collider collider;
        collider.name = "collider " + std::to_string(scene.colliders.size()), collider.shape = shape;
        scene.colliders.push_back(collider), poses.push_back({pose, pose});
    }
    void add_block(const Pose& pose) {
        test::LatticeBody block;
        for (int& n : block.cells) n = 1 + static_cast<int>(draw_.index(5));
        block.spacing = draw_.uniform(0.6, 1) * size_ / std::ranges::max(block.cells);
        block.density = draw_.logarithmic(200, 8000);
        const Vec3 middle(0, 0, 0.5 * block.spacing * block.cells[2]);
        test::add_body(scene, test::lattice_mesh(block), {pose.position - pose.orientation * middle, pose.orientation});
        Material material;
        material.youngs_modulus = draw_.logarithmic(2e4, 1e9);
        material.yield = 1e6;
        material.toughness = breaks_at_ / std::sqrt(material.youngs_modulus / block.density);
        materials.push_back(material);
        what += "block ";
    }
    void add_solid(const Pose& pose) {
        Shape shape;
        shape.kind = draw_.of({ShapeKind::box, ShapeKind::sphere, ShapeKind::capsule});
        const double a = draw_.uniform(0.15, 0.6), b = draw_.uniform(0.15, 0.6), c = draw_.uniform(0.1, 0.4);
        shape.half_extents = size_ * Vec3(a, b, c);
        shape.radius = size_ * draw_.uniform(0.1, 0.4), shape.half_height = size_ * draw_.uniform(0.05, 0.4);
        what += shape.kind == ShapeKind::box ? "box " : shape.kind == ShapeKind::sphere ? "sphere " : "capsule ";
        const double mass = draw_.logarithmic(300, 8000) * 8 * shape.half_extents.prod();
        if (shape.kind == ShapeKind::capsule || draw_.one_in(3)) return add_collider(shape, pose);
        RigidBody solid;
        solid.name = "solid " + std::to_string(scene.rigid_bodies.size());
        solid.shape = shape, solid.mass = mass, solid.pose = pose;
        scene.rigid_bodies.push_back(solid);
    }

    test::Draw draw_;
    double size_;       // m
    double breaks_at_;  // m/s
};

// Of so many tangles in steps of three lengths: what goes faster than `limit`, in units of the depenetration speed,
// m/s.
std::vector<double> faster(double limit, uint64_t tangles, double breaks_at, bool as_wholes) {
    std::vector<double> found;
    for (uint64_t seed = 0; seed < tangles; ++seed) {
        const Tangle tangle(seed, breaks_at);
        for (const auto& [substeps, iterations] : {std::pair(4, 1), std::pair(8, 2), std::pair(32, 1)}) {
            SolverSettings settings;
            settings.substeps = substeps, settings.iterations = iterations;
            const double fastest = tangle.fastest(settings, as_wholes, 48);
            if (fastest < limit * settings.depenetration_speed) continue;
            std::printf("tangle %d of %sat %d substeps of %d: %.2f m/s\n", static_cast<int>(seed), tangle.what.c_str(),
                        substeps, iterations, fastest);
            found.push_back(fastest);
        }
    }
    return found;
}

// Each of three may part from the next at the depenetration speed, 1 m/s, and what is light between two goes faster. Of
// 900, these and others, two go faster than four times that, at 5 and 7 m/s (before 50, up to 125).
TEST(Overlap, what_begins_in_one_another_does_not_fly_apart) { EXPECT_TRUE(faster(4, 40, 1e9, true).empty()); }

// And what breaks meanwhile is let go with no more than that breaking speed besides. As long as torn pieces worked off
// their overlap each contact by itself, of 300 such runs six had a fragment at more than eight times the depenetration
// speed, up to 22 m/s. Rounding decides which fragment is light between two: two of these tangles, moved by 1e-10 m
// forty times, have one at more than that every tenth time, up to 12 m/s.
TEST(Overlap, nor_does_what_breaks_in_one_another) {
    const std::vector<double> fast = faster(8, 30, 2, false);
    EXPECT_LE(fast.size(), 2u);
    for (const double speed : fast) EXPECT_LT(speed, 16);
}

}  // namespace
}  // namespace sunder
