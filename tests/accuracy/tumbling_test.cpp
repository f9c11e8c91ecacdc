// Stiff bodies that are thrown spinning turn as rigid bodies do.
#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"
#include "solver/data/thin_fragments.h"
#include "solver/pieces/momentum.h"
#include "solver/scene/motion.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

SimulationMesh needles() {
    PrefractureSettings cut;
    cut.threads = 1, cut.sites.kind = SiteKind::points, cut.least_piece = 0;
    for (double x = 0.05; x < 0.4; x += 0.1)
        for (double y = 0.05; y < 0.6; y += 0.1) cut.sites.points.push_back({x + 0.1 * y, y - 0.1 * x, 0.5});
    const auto fragments = prefracture(testing::make_box(Vec3(0.4, 0.6, 1)), cut, "needles");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    return build_simulation_mesh(*fragments, {}).take();
}

struct Tumbler {
    Scene scene;
    FrameInput input;
    explicit Tumbler(const SimulationMesh& mesh, double spin = 1) {
        test::add_body(scene, mesh);
        Material stiff;
        stiff.youngs_modulus = 1e9;  // waves run several times through it in a substep
        stiff.slender = spin > 1;
        scene.bodies[0].angular_velocity = spin * Vec3(9, 11, 6);
        input = test::quiet_input(scene, stiff);
    }

    PieceMomentum momentum(const FrameState& s) const {
        const size_t n = s.n_particles();
        std::vector<Sym3> inertia(n);
        std::vector<ParticleId> all(n);
        for (uint32_t i = 0; i < n; ++i) {
            const Vec3 r = scene.rest.radii[i], moment = scene.rest.mass[i] / 5 * r.cwiseProduct(r);
            inertia[i] = turned_inertia(s.orientation[i], to_sym(Mat3(moment.asDiagonal())));
            all[i] = ParticleId(i);
        }
        return piece_momentum(scene.rest, inertia, all, s.position, s.velocity, s.angular_velocity);
    }
};

double spinning_energy(const PieceMomentum& p) { return 0.5 * p.angular.dot(rigid_spin(p, p.angular)); }

// Where a body that is not turned, of this inertia, comes to in `seconds`: d(turn)/dt = I^-1 L, by Runge and Kutta.
Quat turned_by_euler(const Mat3& inertia, const Vec3& L, double seconds) {
    const Mat3 inverse = inertia.inverse();
    const auto rate = [&](const Quat& q) {
        const Vec3 spin = q * (inverse * (q.conjugate() * L));
        return Eigen::Vector4d(0.5 * (Quat(0, spin.x(), spin.y(), spin.z()) * q).coeffs());
    };
    const auto ahead = [](const Quat& q, const Eigen::Vector4d& change) {
        return Quat(Eigen::Vector4d(q.coeffs() + change)).normalized();
    };
    const int steps = 20000;
    const double h = seconds / steps;
    Quat q = Quat::Identity();
    for (int k = 0; k < steps; ++k) {
        const Eigen::Vector4d a = rate(q), b = rate(ahead(q, h / 2 * a)), c = rate(ahead(q, h / 2 * b)),
                              d = rate(ahead(q, h * c));
        q = ahead(q, h / 6 * (a + 2 * b + 2 * c + d));
    }
    return q;
}

// What an implicit step's own turn leaves undone had blocks off by 0.1 rad, and needles by a radian, at 1.07 times
// their energy.
TEST(tumbling, stiff_bodies_turn_as_eulers_equations_say) {
    for (const SimulationMesh& mesh : {test::lattice_mesh({{2, 3, 5}, 0.1, 6, 1000, {}}), needles()}) {
        const Tumbler body(mesh);
        for (const int substeps : {8, 16}) {
            const auto solver = test::make_solver(body.scene);
            FrameState state = solver->initial_state(body.input.materials);
            SolverSettings settings;
            settings.substeps = substeps;
            const PieceMomentum start = body.momentum(state);
            const Quat rest = state.orientation[0];
            double least = 1, most = 1;
            for (int frame = 0; frame < 24; ++frame) {
                ASSERT_TRUE(solver->advance(body.input, settings, state));
                const double share = spinning_energy(body.momentum(state)) / spinning_energy(start);
                least = std::min(least, share), most = std::max(most, share);
            }
            const double error = rotation_vector(state.orientation[0] * rest.conjugate() *
                                                 turned_by_euler(start.inertia, start.angular, 1).conjugate())
                                     .norm();
            std::printf("%zu particles, %d substeps: energy of spinning %.5f to %.5f of the start's, off by %.4f rad\n",
                        mesh.n_particles(), substeps, least, most, error);
            EXPECT_LE((body.momentum(state).angular - start.angular).norm(), 1e-9 * start.angular.norm());
            EXPECT_GE(least, 0.999);
            EXPECT_LE(most, 1.001);
            EXPECT_LE(error, 0.002) << "of 15.4 rad";
        }
    }
}

// Straight ways lead apart what turns so far, and a bent shape did not come back: it lost its spin.
TEST(tumbling, what_bends_turns_as_eulers_equations_say_by_radians_in_a_substep) {
    SimulationMesh bar = test::lattice_mesh({{2, 3, 13}, 0.1, 6, 1000, {}});
    build_one_rings(bar);
    bar.thin = bending_groups(bar);
    for (const double turn : {0.6, 1.2, 2.4}) {  // of a substep, rad
        const Tumbler body(bar, turn * 24 * 8 / Vec3(9, 11, 6).norm());
        const auto solver = test::make_solver(body.scene);
        FrameState state = solver->initial_state(body.input.materials);
        SolverSettings settings;
        settings.substeps = 8;
        const PieceMomentum start = body.momentum(state);
        const Quat rest = state.orientation[0];
        const double length = (state.position.back() - state.position.front()).norm();
        const int frames = 3;
        for (int frame = 0; frame < frames; ++frame) ASSERT_TRUE(solver->advance(body.input, settings, state));
        const PieceMomentum end = body.momentum(state);
        const double error = rotation_vector(state.orientation[0] * rest.conjugate() *
                                             turned_by_euler(start.inertia, start.angular, frames / 24.0).conjugate())
                                 .norm();
        const double share = spinning_energy(end) / spinning_energy(start);
        std::printf("%.1f rad a substep: energy of spinning %.5f of the start's, off by %.4f rad of %.0f\n", turn,
                    share, error, turn * 8 * frames);
        EXPECT_LE((end.angular - start.angular).norm(), 1e-5 * start.angular.norm());  // no energy more, to rounding
        EXPECT_NEAR(share, 1, 1e-3);
        EXPECT_NEAR((state.position.back() - state.position.front()).norm(), length, 1e-3 * length);
        EXPECT_LE(error, 2e-3 * turn * 8 * frames);
    }
}

}  // namespace
}  // namespace sunder
