// Method jacobi gives nothing to what flies, however far its sweeps go beyond their answers, and however many there
// are.
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Three sweeps at 1.75 and more ended so far beyond the implicit step that a stiff body had 10^4 to 10^7 times its
// energy within a second.
TEST(over_relaxation, what_flies_gains_nothing_by_any_number_of_sweeps) {
    Scene scene = test::lattice_scene({{2, 3, 6}, 0.1, 6, 1000, {}});
    scene.bodies[0].angular_velocity = Vec3(0.3, 0.4, 0.2);
    double most = 0;
    for (const double youngs_modulus : {1e5, 5e6, 1e9})
        for (const double over_relaxation : {1.5, 1.75, 1.9})
            for (int sweeps = 2; sweeps <= 9; ++sweeps) {
                Material material;
                material.youngs_modulus = youngs_modulus, material.poisson_ratio = 0.45;
                const FrameInput input = test::quiet_input(scene, material);
                SolverSettings settings;
                settings.method = Method::jacobi;
                settings.iterations = sweeps, settings.over_relaxation = over_relaxation;
                const auto solver = test::make_solver(scene);
                FrameState state = solver->initial_state(input.materials);
                const auto energy = [&] {
                    return test::energy(solver->scene(), material, input.gravity, state).kinetic();
                };
                const double start = energy();
                for (int frame = 0; frame < 36; ++frame) {
                    ASSERT_TRUE(solver->advance(input, settings, state));
                    most = std::max(most, energy() / start);
                    // Single precision and vibrations come and go: a hundredth is far above both.
                    EXPECT_LE(energy(), 1.01 * start)
                        << youngs_modulus << " Pa, " << over_relaxation << ", " << sweeps << " sweeps, frame " << frame;
                }
            }
    std::printf("most energy of motion: %.4f of the start's\n", most);
}

}  // namespace
}  // namespace sunder
