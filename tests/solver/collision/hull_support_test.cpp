#include "solver/collision/hull_support.h"

#include <gtest/gtest.h>

#include "solver/scene/motion.h"
#include "tests/solver/collision/collision_cases.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

TEST(hull_support, faces_are_nearer_than_the_ellipsoid_and_corners_farther) {
    SimulationMesh mesh = test::lattice_mesh({{2, 1, 1}, 1.0, 6, 1000, {}});
    for (Vec3& radii : mesh.radii) radii.setConstant(0.6);
    const Mat3 none = Mat3::Identity(), drawn = Vec3(2, std::sqrt(0.5), std::sqrt(0.5)).asDiagonal();
    const Vec3 diagonal = Vec3::Ones().normalized();
    EXPECT_NEAR(standing_out(mesh, 0, none, Vec3::UnitX()), 0.1, 1e-6);
    EXPECT_NEAR(standing_out(mesh, 0, none, diagonal), 0.6 - 0.5 * std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(standing_out(mesh, 0, drawn, Vec3::UnitX()), 0.6 - 1.0, 1e-6);
    EXPECT_NEAR(standing_out(mesh, 0, drawn, Vec3::UnitZ()), 0.6 - 0.5 * std::sqrt(0.5), 1e-6);
    const std::pair<uint32_t, uint32_t> pair(0, 1);
    double gap = 0;
    rest_gaps(mesh, {&pair, 1}, &gap);
    EXPECT_NEAR(gap, 1 - 1.2, 1e-9);
    HullReach hulls;
    hulls.update(mesh, std::vector<Mat3>{none, none}, WorkerPool(1));
    EXPECT_NEAR(hulls.reach()[1], 0.5 * std::sqrt(3.0) - 0.6, 1e-6);
    hulls.update(mesh, std::vector<Mat3>{none, drawn}, WorkerPool(1));
    EXPECT_NEAR(hulls.reach()[1], std::sqrt(1 + 0.25) - 0.6, 1e-6);
    mesh.hull_offset.clear();
    EXPECT_EQ(standing_out(mesh, 0, none, diagonal), 0);  // not known
}

// Hulls of any number of points, however flat, of material that flowed: as point by point in double precision.
TEST(hull_support, the_farthest_reach_is_found_among_any_number_of_points) {
    std::mt19937_64 rng = generator(21);
    SimulationMesh mesh;
    std::vector<Mat3> F_P;
    mesh.hull_offset = {0};
    for (uint32_t k = 0; k < 300; ++k) {
        const Ellipsoid e = random_ellipsoid(rng, 0, k % 3 ? 3 : 40);
        mesh.radii.push_back(e.radii), mesh.rest_orientation.push_back(Quat(e.axes));
        const Mat3 turn = random_axes(rng);
        const double drawn = std::exp(uniform(rng, -0.7, 0.7));
        F_P.push_back(turn * Vec3(drawn, 1 / drawn, 1).asDiagonal() * turn.transpose());
        const double size = k % 5 ? 1.2 : 0.5;  // some nowhere outside
        for (uint32_t n = k < 290 ? k % 70 : 260 + k; n > 0; --n)
            mesh.hull_point.push_back(
                (uniform(rng, 0.8, 1) * size * (e.axes * e.radii.asDiagonal() * random_direction(rng))).cast<float>());
        mesh.hull_offset.push_back(static_cast<uint32_t>(mesh.hull_point.size()));
    }
    mesh.rest_position.resize(mesh.radii.size());
    HullReach hulls;
    hulls.update(mesh, F_P, WorkerPool(1));
    size_t n_outside = 0;
    for (size_t k = 0; k < F_P.size(); ++k) {
        double farthest = 0;
        for (const Vec3f& point : mesh.hull(k)) {
            const Vec3 p = F_P[k] * point.cast<double>();
            const double times = (mesh.rest_orientation[k].conjugate() * p).cwiseQuotient(mesh.radii[k]).norm();
            farthest = std::max(farthest, p.norm() * (1 - 1 / times));
        }
        EXPECT_NEAR(hulls.reach()[k], farthest, 1e-14 * farthest) << k;
        n_outside += farthest > 0;
    }
    EXPECT_GT(n_outside, 150u);
    EXPECT_LT(n_outside, 290u);
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
TEST(hull_support, a_flattened_block_lies_on_the_floor) {
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
TEST(hull_support, lone_fragments_lie_on_their_present_surface) {
    SimulationMesh one = test::lattice_mesh({{1, 1, 1}, 0.1, 6, 1000, {}});
    const Vec3 stretches[] = {{2, 1, 0.5}, {1, 1.6, 1 / 1.6}, {0.5, 0.5, 4}};
    for (const Vec3& stretch : stretches) {
        Dropped d(one, Material(), {Vec3(0, 0, 0.3), Quat::Identity()}, Vec3::Zero());
        d.state.plastic_deformation[0] = stretch.asDiagonal();
        double least = kNever;
        for (int f = 0; f < 12; ++f) {
            d.run(1);
            least = std::min(least, d.bottom(0, 0.1));
        }
        EXPECT_NEAR(least, 0, 0.002) << stretch.transpose();  // of 0.1 m; contacts reach 1e-3 m
    }
}

}  // namespace
}  // namespace sunder
