// A brittle beam shattered by a heavy hit: pieces must not leave with more energy than there was. They once spun at
// 1200 rad/s and more, for two reasons, both in contacts. A push that turned a small fragment by radians in a substep
// was booked linearly but applied through a quaternion, so that the fragment kept the difference as spin. And a push on
// a bound particle moved it as if nothing held it: in a stiff body the strain that this made was energy from nowhere
// (thousands of joules in a scene of 1400), which the cuts then set free. Later a pair of fragments that were pinched
// between the weight and the floor were turned by tens of radians within a substep, along straight paths: twice the
// energy of the scene, on some of eight hits a few millimetres apart.
#include <gtest/gtest.h>

#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Hit {
    const char* name;
    double youngs_modulus, toughness;  // Pa, -
    double speed, mass;                // of the weight; mass 0: the beam itself falls, m/s, kg
    int substeps;                      // a frame of 1/24 s
    double stretch;                    // of the ellipsoids along one axis, shrunk along another, -
    double aside = 0;                  // of the weight, m
};

[[maybe_unused]] void PrintTo(const Hit& hit, std::ostream* out) { *out << hit.name; }

// Fragments that are no spheres, each turned its own way, as those of clustered meshes.
void make_irregular(SimulationMesh& io_mesh, double stretch) {
    for (size_t i = 0; i < io_mesh.n_particles(); ++i) {
        io_mesh.radii[i] = io_mesh.radii[i].cwiseProduct(Vec3(1, stretch, 1 / stretch));
        const Vec3 axis(std::sin(double(i)), std::cos(3.0 * double(i)), 0.3);
        io_mesh.rest_orientation[i] = Quat(Eigen::AngleAxisd(double(i), axis.normalized()));
    }
}

// Most energy gained in a pair of substeps, over that of the start.
double shatter(const Hit& hit) {
    Scene scene;
    SimulationMesh mesh = test::lattice_mesh({{20, 4, 4}, 0.05, 6, 1000, {}});
    if (hit.stretch != 1) make_irregular(mesh, hit.stretch);
    const Quat tilt(Eigen::AngleAxisd(hit.mass > 0 ? 0.0 : 0.3, Vec3::UnitY()));  // flat on its face it would not break
    test::add_body(scene, mesh, {Vec3(0, 0, 0.5), tilt});
    scene.colliders.resize(1);
    scene.colliders[0].shape.kind = ShapeKind::plane;
    if (hit.mass > 0) {
        RigidBody weight;
        weight.name = "weight";
        weight.shape.radius = 0.1;
        weight.mass = hit.mass;
        weight.pose.position = Vec3(0.013 + hit.aside, 0.017, 0.83);
        weight.velocity = Vec3(0, 0, -hit.speed);
        scene.rigid_bodies.push_back(weight);
    } else {
        scene.bodies[0].velocity = Vec3(0, 0, -hit.speed);
    }
    Material material;
    material.youngs_modulus = hit.youngs_modulus;
    material.toughness = hit.toughness;
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({material});
    FrameInput in = test::quiet_input(scene, material, 2.0 / 24 / hit.substeps);
    in.gravity = Vec3(0, 0, -9.81);
    SolverSettings settings;
    settings.substeps = 2;  // a pair

    const double start = test::energy(solver->scene(), material, in.gravity, state).total();
    double highest = -1e300, rise = 0, rim = 0, spin = 0, last = start;
    for (int k = 0; k < 6 * hit.substeps; ++k) {  // half a second: the hit and the fall
        test::advance(*solver, in, settings, state);
        const double now = test::energy(solver->scene(), material, in.gravity, state).total();
        highest = std::max(highest, now - start);
        rise = std::max(rise, now - last);
        last = now;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            spin = std::max(spin, state.angular_velocity[i].norm());
            rim = std::max(rim, state.angular_velocity[i].norm() * scene.rest.radii[i].maxCoeff());
        }
    }
    std::printf(
        "%s: %zu pieces, energy %.0f J, above it %.2f J, most in a pair of substeps %.2f J, fastest spin %.0f rad/s\n",
        hit.name, test::count_pieces(solver->scene().rest, state), start, highest, rise, spin);
    EXPECT_GE(test::count_pieces(solver->scene().rest, state), 10u) << "else this tells nothing";
    EXPECT_LE(highest, 1e-3 * start);  // no motor in the scene
    // A fragment that rolls between the weight and the floor has rim speed at most that of the weight; recoil of
    // released strain may double it.
    EXPECT_LE(rim, 2 * (hit.speed + std::sqrt(2 * 9.81 * 0.9)));
    return rise / start;
}

class Shatter : public testing::TestWithParam<Hit> {};

// What implicit steps lose hides nothing: a single pair of substeps may not gain either. A contact's work is taken
// along the straight path of the substep; a hundredth of the whole covers its error.
TEST_P(Shatter, pieces_leave_with_no_more_energy_than_there_was) { EXPECT_LE(shatter(GetParam()), 0.01); }

INSTANTIATE_TEST_SUITE_P(hits, Shatter,
                         testing::Values(Hit{"pinched", 2e6, 0.02, 10, 20, 16, 1},
                                         Hit{"stiff", 2e7, 0.005, 10, 20, 16, 1},
                                         Hit{"stiffest", 1e8, 0.005, 20, 60, 32, 1},
                                         Hit{"crumbs", 2e6, 0.01, 20, 5, 16, 1.6},
                                         Hit{"overlapping ellipsoids", 2e7, 0.005, 10, 20, 16, 2},
                                         Hit{"soft", 2e5, 0.07, 8, 100, 8, 1}, Hit{"fall", 1e8, 0.001, 10, 0, 32, 1.3}),
                         [](const auto& info) {
                             std::string name = info.param.name;
                             std::erase(name, ',');
                             std::replace(name.begin(), name.end(), ' ', '_');
                             return name;
                         });

// A soft beam beneath a heavy weight, wherever it is hit: pieces are squeezed far out of shape, and the straight paths
// are the worst there. Of 81 shots six gain more than a hundredth in their worst pair (0.018 at most), with substeps
// divided for the hit as without; the median is 0.003.
TEST(Shatter, a_soft_beam_gains_nothing_wherever_it_is_hit) {
    std::vector<double> rises;
    for (int k = -10; k <= 10; ++k) rises.push_back(shatter({"soft, aside", 2e5, 0.07, 8, 100, 8, 1, 0.002 * k}));
    std::ranges::sort(rises);
    EXPECT_LE(rises[rises.size() / 2], 0.005);
    EXPECT_LE(rises.back(), 0.02);
}

}  // namespace
}  // namespace sunder
