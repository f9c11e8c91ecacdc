#include "solver/collision/flowed_shape.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "solver/motion.h"
#include "tests/solver/collision/collision_cases.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

// Symmetric, det 1, principal stretches within `ratio` of one another.
Mat3 random_flow(std::mt19937_64& rng, double ratio) {
    Vec3 log_stretch = uniform3(rng, 0, std::log(ratio));
    log_stretch.array() -= log_stretch.mean();
    const Mat3 V = random_axes(rng);
    return V * Vec3(log_stretch.array().exp()).asDiagonal() * V.transpose();
}

// A row of cubic cells of side 1.
SimulationMesh two_cells() { return test::lattice_mesh({{2, 1, 1}, 1.0, 6, 1000, {}}); }

TEST(flowed_shape, is_the_ellipsoid_that_flow_makes_of_the_one_at_rest) {
    auto rng = generator(1);
    for (int k = 0; k < 1000; ++k) {
        const Ellipsoid rest = random_ellipsoid(rng, 1, 10);
        const Mat3 F_P = random_flow(rng, 8);
        const ContactShape shape = flowed_shape(Quat(rest.axes), rest.radii, F_P);
        const Ellipsoid flowed{Vec3::Zero(), shape.orientation.toRotationMatrix(), shape.radii};
        EXPECT_NEAR(shape.radii.prod(), rest.radii.prod(), 1e-9 * rest.radii.prod());
        EXPECT_GE(flowed_radius(rest.radii, F_P), shape.radii.maxCoeff());
        for (int j = 0; j < 8; ++j) {
            const Vec3 n = random_direction(rng);
            const double expected = support(rest, F_P * n);  // of F_P's image
            EXPECT_NEAR(support(flowed, n), expected, 1e-9 * expected);
        }
    }
}

TEST(flowed_shape, without_flow_keeps_the_bits_of_rest) {
    auto rng = generator(2);
    const Quat q(random_axes(rng));
    const Vec3 radii(0.3, 0.1, 0.2);
    const ContactShape shape = flowed_shape(q, radii, Mat3::Identity());
    EXPECT_EQ(shape.orientation.coeffs(), q.coeffs());
    EXPECT_EQ(shape.radii, radii);
    EXPECT_EQ(flowed_radius(radii, Mat3::Identity()), 0.3);
}

// Whatever flow both had, the overlap at rest goes with it: what touched at rest touches still.
TEST(flowed_shape, what_fits_at_rest_fits_where_a_body_flows_evenly) {
    auto rng = generator(3);
    for (const double radius : {0.5, 0.6}) {  // cells that touch, and that overlap by 0.2
        SimulationMesh rest = two_cells();
        for (Vec3& radii : rest.radii) radii.setConstant(radius);
        const RestFit fit = rest_fit(rest, 0, 1);
        EXPECT_NEAR(fit.gap, 1 - 2 * radius, 1e-12);
        EXPECT_NEAR((fit.normal + Vec3::UnitX()).norm(), 0, 1e-9);
        EXPECT_EQ(fitting_gap(rest, fit, Mat3::Identity(), Mat3::Identity(), 0, 1), std::min(0.0, fit.gap));
        for (int k = 0; k < 100; ++k) {
            const Mat3 F_P = random_flow(rng, 8);
            // The slab between the two planes, as F_P deforms it.
            const double expected = fit.gap / (F_P.inverse().transpose() * fit.normal).norm();
            EXPECT_NEAR(fitting_gap(rest, fit, F_P, F_P, 0, 1), expected, 1e-9);
        }
    }
    // One alone that grew towards the other: as much as it grew beyond what both groups moved apart.
    const SimulationMesh rest = two_cells();
    const Mat3 drawn = Vec3(2, std::sqrt(0.5), std::sqrt(0.5)).asDiagonal();
    EXPECT_NEAR(fitting_gap(rest, rest_fit(rest, 0, 1), drawn, Mat3::Identity(), 0, 1), 1.5 - (1 + 0.5), 1e-9);
}

TEST(flowed_shape, shapes_follow_each_change) {
    const SimulationMesh rest = two_cells();
    auto rng = generator(4);
    FlowedShapes shapes;
    std::vector<Mat3> F_P = {Mat3::Identity(), random_flow(rng, 3)};
    shapes.update(rest, F_P, WorkerPool(1));
    F_P[1] = random_flow(rng, 3);
    shapes.update(rest, F_P, WorkerPool(1));
    EXPECT_EQ(shapes[0].radii, rest.radii[0]);
    EXPECT_EQ(shapes[1].radii, flowed_shape(rest.rest_orientation[1], rest.radii[1], F_P[1]).radii);
}

struct Dropped {
    Scene scene;
    FrameInput input;
    SolverSettings settings;
    std::unique_ptr<Solver> solver;
    FrameState state;

    Dropped(const SimulationMesh& mesh, const Material& material, const Pose& pose, const Vec3& velocity) {
        test::add_body(scene, mesh, pose, velocity);
        scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.6, 0.0});
        input = test::quiet_input(scene, material);
        input.gravity = FrameInput().gravity;
        solver = test::make_solver(scene);
        state = solver->initial_state(input.materials);
    }
    void run(int frames) {
        for (int f = 0; f < frames; ++f) advance(*solver, input, settings, state);
    }
    // Lowest corner of cell i as the skin shows it, m: R F_P of a cube of `side`.
    double bottom(uint32_t i, double side) const {
        const Quat R = state.orientation[i] * scene.rest.rest_orientation[i].conjugate();
        const Mat3 shown = R.toRotationMatrix() * state.plastic_deformation[i];
        return state.position[i].z() - 0.5 * side * shown.row(2).cwiseAbs().sum();
    }
    double lowest_bottom(double side) const {
        double least = kNever;
        for (uint32_t i = 0; i < scene.rest.n_particles(); ++i) least = std::min(least, bottom(i, side));
        return least;
    }
};

// A block of heavy, limp stuff is squashed by its fall and comes to lie on the floor: neither above it, as with the
// radii of rest, nor in it. Cells that shear hang a corner below their ellipsoids, hence the tolerance.
TEST(flowed_shape, a_flattened_block_lies_on_the_floor) {
    Material lead;
    lead.youngs_modulus = 2e6, lead.poisson_ratio = 0.4, lead.yield = 0.004, lead.flow_rate = 600;
    constexpr double kSide = 0.1;
    Dropped d(test::lattice_mesh({{4, 4, 4}, kSide, 6, 11300, {}}), lead, {}, Vec3(0, 0, -4));
    d.settings.substeps = 12;
    d.run(60);
    double most = 1;
    for (const Mat3& F_P : d.state.plastic_deformation) most = std::min(most, F_P(2, 2));
    EXPECT_LT(most, 0.75);  // else this tells nothing
    EXPECT_NEAR(d.lowest_bottom(kSide), 0, 0.05 * kSide);
}

// Loose fragments that were drawn to needles, pressed to discs or sheared lie on what they are now.
TEST(flowed_shape, lone_fragments_lie_on_their_present_surface) {
    SimulationMesh one = test::lattice_mesh({{1, 1, 1}, 0.1, 6, 1000, {}});
    const Vec3 stretches[] = {{2, 1, 0.5}, {1, 1.6, 1 / 1.6}, {0.5, 0.5, 4}};
    for (const Vec3& stretch : stretches) {
        Dropped d(one, Material(), {Vec3(0, 0, 0.3), Quat::Identity()}, Vec3::Zero());
        d.state.plastic_deformation[0] = stretch.asDiagonal();
        double least = kNever;
        for (int f = 0; f < 12; ++f) {
            d.run(1);
            const Mat3 R = d.state.orientation[0].toRotationMatrix();
            const Mat3 E = R * d.state.plastic_deformation[0];
            least = std::min(least, d.state.position[0].z() - 0.05 * E.row(2).norm());
        }
        EXPECT_NEAR(least, 0, 0.002) << stretch.transpose();  // of 0.1 m; contacts reach 1e-3 m
    }
}

// What flew by a sleeper's rest shape, and meets what the sleeper flowed to, must be seen coming.
TEST(flowed_shape, a_sleeper_is_as_large_as_it_flowed) {
    Scene scene;
    test::add_body(scene, test::lattice_mesh({{1, 1, 1}, 0.1, 6, 1000, {}}));
    scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.6, 0.0});
    RigidBody ball;
    ball.name = "ball", ball.shape.radius = 0.02, ball.mass = 4;
    ball.pose.position = Vec3(0.17, -40, 0.03), ball.velocity = Vec3(0, 40, 0);
    scene.rigid_bodies.push_back(ball);
    FrameInput input = test::quiet_input(scene, Material());
    input.gravity = Vec3(0, 0, -1e-3);
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state(input.materials);
    state.plastic_deformation[0] = Vec3(4, 0.5, 0.5).asDiagonal();  // 0.2 m long on both sides
    state.position[0].z() = 0.025;
    for (int f = 0; f < 14; ++f) advance(*solver, input, SolverSettings(), state);
    ASSERT_TRUE(state.asleep[0]);
    for (int f = 0; f < 14; ++f) advance(*solver, input, SolverSettings(), state);
    EXPECT_FALSE(state.asleep[0]);
    EXPECT_GT(state.angular_velocity[0].norm(), 0.1);  // it was hit near its end
}

}  // namespace
}  // namespace sunder
