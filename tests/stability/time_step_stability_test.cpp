// The step as artists choose it: frames of a 24th to a 60th of a second, in 1 to 64 substeps; and far too long ones.
#include <gtest/gtest.h>

#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Drop {
    Scene scene;
    Material material;
    SolverSettings settings;
    FrameState state;
    double highest = -1e300, start = 0;  // energy, J
    double fastest = 0;                  // ever, m/s

    Drop() {
        scene.colliders.resize(1);
        scene.colliders[0].shape.kind = ShapeKind::plane;
        test::add_body(scene, test::lattice_mesh({{6, 3, 2}, 0.05, 6, 1000, {}}), {Vec3(0, 0, 0.3), Quat::Identity()});
        material.youngs_modulus = 5e5;
    }
    void run(double seconds, double frame) {
        const auto solver = test::make_solver(scene);
        state = solver->initial_state({material});
        FrameInput in = test::quiet_input(scene, material, frame);
        in.gravity = Vec3(0, 0, -9.81);
        start = test::energy(solver->scene(), material, in.gravity, state).total();
        for (int f = 0; f < std::lround(seconds / frame); ++f) {
            test::advance(*solver, in, settings, state);
            highest = std::max(highest, test::energy(solver->scene(), material, in.gravity, state).total());
            fastest = std::max(fastest, speed());
        }
    }
    double speed() const {
        double v = 0;
        for (const Vec3& x : state.velocity) v = std::max(v, x.norm());
        return v;
    }
    double lowest() const {
        double z = 1e9;
        for (const Vec3& x : state.position) z = std::min(z, x.z());
        return z;
    }
};

TEST(time_step, a_dropped_body_lands_and_rests_at_any_frame_rate_and_substep_count) {
    for (double rate : {24.0, 25.0, 30.0, 60.0})
        for (int substeps : {1, 2, 4, 8, 16, 32, 64}) {
            Drop drop;
            drop.settings.substeps = substeps;
            drop.run(4, 1 / rate);
            std::printf(
                "%2.0f fps x %2d: lowest %.4f m, last speed %.1e m/s, fastest %.2f m/s, energy %+.1e J of %.1f\n", rate,
                substeps, drop.lowest(), drop.speed(), drop.fastest, drop.highest - drop.start, drop.start);
            // It falls 0.3 m: 2.43 m/s. A body that tips over as it lands moves its far end by twice that at most.
            EXPECT_LE(drop.fastest, 2 * 2.43);
            EXPECT_LE(drop.highest - drop.start, 1e-3 * drop.start);  // J
            EXPECT_LE(drop.speed(), 0.024);                           // at rest: a millimetre in a 24th of a second
            EXPECT_NEAR(drop.lowest(), 0.025, 2e-3);                  // spheres of radius 0.025 on the floor
        }
}

// A hundred times the default substep of 1/192 s: over half a second in one.
TEST(time_step, a_hundredfold_step_gains_nothing_and_ends_at_the_same_place) {
    for (const double youngs_modulus : {5e5, 2e7, 1e9}) {
        Drop fine, coarse;
        fine.material.youngs_modulus = coarse.material.youngs_modulus = youngs_modulus;
        fine.settings.substeps = 8;
        fine.run(8, 1.0 / 24);
        coarse.settings.substeps = 1;
        coarse.run(16, 100.0 / 192);
        double apart = 0;
        for (size_t i = 0; i < fine.state.n_particles(); ++i)
            apart = std::max(apart, std::abs(fine.state.position[i].z() - coarse.state.position[i].z()));
        std::printf("%g Pa: heights differ by %.2e m, last speed %.1e m/s, energy %+.1e J of %.1f\n", youngs_modulus,
                    apart, coarse.speed(), coarse.highest - coarse.start, coarse.start);
        // Under a twentieth of the particle spacing; a millimetre a frame; no energy from nowhere.
        EXPECT_LE(apart, 2e-3);
        EXPECT_LE(coarse.speed(), 0.024);
        EXPECT_LE(coarse.highest - coarse.start, 1e-3 * coarse.start);
    }
}

}  // namespace
}  // namespace sunder
