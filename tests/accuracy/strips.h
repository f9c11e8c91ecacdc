// Cantilevers and strips that are bent and let go, against beam theory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "solver/data/rotations.h"
#include "tests/support/lattice_scene.h"

namespace sunder::test {

inline constexpr double kDegrees = 180 / std::numbers::pi;

inline SolverSettings fine_steps() {
    SolverSettings settings;
    settings.substeps = 16;
    settings.self_collision = false, settings.sleeping = false;
    return settings;
}

// Curvature of a cantilever under its own weight over M / (E I), by least squares between inner cells, beside an offset
// and a slope, which are the clamp's; of what is left when Timoshenko's shear is off. `aspect`: width of a cell over
// its thickness, of which there are `through`; askew in space.
inline double curvature_of_cantilever(int width, double aspect, int neighbours, double poisson_ratio, int through = 1) {
    constexpr double kThickness = 0.02, kGravity = 9.81;
    constexpr int n_free = 20;
    const double cell = kThickness / through * aspect, length = n_free * cell, density = aspect < 10 ? 5000 : 500;
    const Quat askew = rotation_about(Vec3(1, 2, 3).normalized(), 0.7);
    SimulationMesh mesh;
    {
        LatticeSettings lattice;
        lattice.cells = {n_free + 2, width, through};
        lattice.size = Vec3((n_free + 2) * cell, width * cell, kThickness);
        lattice.center = Vec3(lattice.size.x() / 2, 0, 0);
        lattice.neighbours = neighbours;
        const auto fragments = make_lattice(lattice, "lattice");
        EXPECT_TRUE(fragments);
        SimulationMeshSettings settings;
        settings.density = density;
        mesh = build_simulation_mesh(*fragments, settings).take();
    }
    const std::vector<Vec3> straight = mesh.rest_position;
    Scene scene;
    add_body(scene, mesh, {Vec3(1, 2, 3), askew});
    const Vec3 origin(1, 2, 3);
    add_pin(scene, [&](const Vec3& x) { return (askew.conjugate() * (x - origin)).x() < 2 * cell; });
    Material material;
    material.youngs_modulus =
        1.5 * density * kGravity * length * length * length / (0.03 * kThickness * kThickness);  // sags by 3 %
    material.poisson_ratio = poisson_ratio, material.slender = 1;
    FrameInput input = quiet_input(scene, material);
    input.gravity = askew * Vec3(0, 0, -kGravity);
    SolverSettings settings = fine_steps();
    settings.damping = 8;
    const auto solver = make_solver(scene);
    FrameState state = solver->initial_state({material});
    for (int f = 0; f < 200; ++f) advance(*solver, input, settings, state);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vec3 right = Vec3::Zero();
    const double load = density * kGravity * kThickness;
    const double stiffness = material.youngs_modulus * std::pow(kThickness, 3) / 12;
    const double shear_stiffness = 5.0 / 6 * material.youngs_modulus / (2 * (1 + poisson_ratio)) * kThickness;
    for (size_t i = 0; i < straight.size(); ++i) {
        const double x = straight[i].x() - 2 * cell;
        if (x < 3 * cell) continue;
        const double sag = straight[i].z() - (askew.conjugate() * (state.position[i] - origin)).z();
        const double theory = load * x * x / (24 * stiffness) * (6 * length * length - 4 * length * x + x * x);
        const double sheared = load * (length * x - x * x / 2) / shear_stiffness;
        const Vec3 row(theory, x, 1);
        normal += row * row.transpose(), right += row * (sag - sheared);
    }
    return normal.ldlt().solve(right).x();
}

// A strip of 0.4 x 0.02 m, `width` and `through` cells wide and thick, whose clamped ends turn by half of `angle` each
// and come nearer along the arc; one is then slowly let go. Its free middle is 0.2 m.
struct BentStrip {
    static constexpr double kFree = 0.2, kThickness = 0.02;
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState state;
    double angle;
    Grip grip;  // of the second clamp

    BentStrip(int width, int neighbours, double yield, double degrees, double toughness = kNever, int through = 1)
        : angle(degrees / kDegrees) {
        LatticeBody body;
        body.cells = {20 * through, width, through}, body.spacing = kThickness / through;
        body.neighbours = neighbours, body.density = 7800;
        scene = lattice_scene(body);
        add_pin(scene, [&](const Vec3& p) { return p.x() < -kFree / 2; });
        add_pin(scene, [&](const Vec3& p) { return p.x() > kFree / 2; });
        material.youngs_modulus = 2e8, material.yield = yield, material.flow_rate = 1000;
        material.toughness = toughness, material.slender = 1;
        solver = make_solver(scene);
        state = solver->initial_state({material});
    }
    Pose pose(int side, double share) const {
        const double half = share * angle / 2, near = half > 0 ? kFree / 2 * (1 - std::sin(half) / half) : 0;
        const Quat turn = rotation_about(Vec3::UnitY(), side * half);
        const Vec3 pivot(side * kFree / 2, 0, kThickness / 2);
        return {pivot - turn * pivot + Vec3(-side * near, 0, 0), turn};
    }
    void run(int frames, double from, double to, bool both, double damping) {
        SolverSettings settings = fine_steps();
        settings.damping = damping;
        for (int f = 0; f < frames; ++f) {
            FrameInput input = quiet_input(scene, material);
            const double begin = from + (to - from) * f / frames, end = from + (to - from) * (f + 1) / frames;
            for (int side : {-1, 1}) {
                DrivenPose& drive = input.pins[side < 0 ? 0 : 1];
                drive = {pose(side, begin), pose(side, end)};
                drive.active = side < 0 || both;
                if (side > 0) drive.grip = grip;
                drive.pivot = Vec3(side * kFree / 2, 0, kThickness / 2);
            }
            advance(*solver, input, settings, state);
        }
    }
    // Between the clamped ends, degrees.
    double bent() const {
        Quat first = state.orientation[0], last = state.orientation[0];
        double least = 1e9, most = -1e9;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const double at = scene.rest.rest_position[i].x();
            const Quat since_rest = state.orientation[i] * scene.rest.rest_orientation[i].conjugate();
            if (at < least) least = at, first = since_rest;
            if (at > most) most = at, last = since_rest;
        }
        return angle_between(first, last) * kDegrees;
    }
    // How far the second clamp's end lies off the first clamp's plane, towards where it is bent, m.
    double tip() const {
        size_t last = 0;
        for (size_t i = 0; i < state.n_particles(); ++i)
            if (scene.rest.rest_position[i].x() > scene.rest.rest_position[last].x()) last = i;
        const Pose first = pose(-1, 1);
        return -(first.orientation.conjugate() * (state.position[last] - first.position)).z() +
               scene.rest.rest_position[last].z();
    }
    // Lets go at once, or within a second: flow that a jerk adds is none of bending.
    double bend_and_let_go(bool slowly = false) {
        run(60, 0, 1, true, 4), run(10, 1, 1, true, 4);
        EXPECT_NEAR(bent(), angle * kDegrees, 0.1);
        for (int f = 0; slowly && f < 24; ++f) {
            grip = {1 - f / 24.0, 1 - (f + 1) / 24.0, 1};
            run(1, 1, 1, true, 8);
        }
        grip = {};
        run(130, 1, 1, false, 8);
        return bent();
    }
};

// Of a narrow, elastic, perfectly plastic beam: kappa - 1.5 kappa_Y (1 - (kappa_Y / kappa)^2 / 3), kappa_Y = 2 s / t,
// of the uniaxial yield strain s = 1.5 yield / (1 + nu).
inline double kept_of_narrow_beam(double degrees, double yield) {
    const double kappa = degrees / kDegrees / BentStrip::kFree, first = 2 * 1.5 * yield / BentStrip::kThickness;
    if (kappa <= first) return 0;
    return BentStrip::kFree * (kappa - 1.5 * first * (1 - first * first / (kappa * kappa) / 3)) * kDegrees;
}

}  // namespace sunder::test
