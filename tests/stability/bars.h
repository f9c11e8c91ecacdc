// The square bar of the reference study, 0.2 x 0.2 x 1 m: clamped below 0.1 and above 0.9, n x n x 5n particles. Moved
// by Sunder's solver, or by the paper's plain method to see where that fails.
#pragma once

#include <Eigen/SVD>
#include <optional>

#include "tests/support/lattice_scene.h"
#include "tests/support/plain_method.h"

namespace sunder::test {

struct Bar {
    Scene scene;
    Material material;
    SolverSettings settings;
    std::unique_ptr<Solver> solver;
    FrameState state;
    std::optional<PlainSettings> plain;  // set: the plain method moves the bar, with the damping of `settings`
    bool sound = true;                   // false once the plain method is lost; then nothing moves any more

    explicit Bar(int n = 4, int neighbours = 6) : scene(lattice_scene({{n, n, 5 * n}, 0.2 / n, neighbours, 1000, {}})) {
        add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
        add_pin(scene, [](const Vec3& x) { return x.z() > 0.9; });
        material.youngs_modulus = 2e6;
    }
    void start() {
        solver = make_solver(scene);
        state = solver->initial_state({material});
        if (plain) plain_method = std::make_unique<PlainMethod>(scene);
    }
    /// One frame with the head going from one pose to another; `held` false lets the head go.
    StepReport frame(double duration, const Pose& begin, const Pose& end, bool held = true) {
        FrameInput in = quiet_input(scene, material, duration);
        if (in.pins.size() > 1) in.pins[1] = {begin, end, held};
        if (!plain) return advance(*solver, in, settings, state);
        plain->damping = settings.damping;
        sound = sound && plain_method->advance(in, *plain, state);
        StepReport report;
        report.edges_broken = state.broken.size();
        return report;
    }
    /// Turns the head about z from one angle to another (rad) in `seconds`, at 24 frames a second.
    void turn(double from, double to, double seconds) {
        const int frames = std::max(1, static_cast<int>(std::lround(seconds * 24)));
        for (int f = 0; f < frames; ++f)
            frame(seconds / frames, turned(from + (to - from) * f / frames),
                  turned(from + (to - from) * (f + 1) / frames));
    }
    void hold(double angle, double seconds) { turn(angle, angle, seconds); }
    void let_go(double seconds) {
        const int frames = static_cast<int>(std::lround(seconds * 24));
        for (int f = 0; f < frames; ++f) frame(1.0 / 24, {}, {}, false);
    }
    static Pose turned(double angle) { return {Vec3::Zero(), Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()))}; }

    /// Twist of the top layer against the bottom one, rad, followed layer by layer.
    double twist() const {
        const SimulationMesh& rest = scene.rest;
        const int layer = static_cast<int>(std::lround(std::cbrt(rest.n_particles() / 5.0)));
        const size_t in_layer = static_cast<size_t>(layer * layer);
        double total = 0, last = 0;
        for (size_t first = 0; first < rest.n_particles(); first += in_layer) {
            Vec3 center = Vec3::Zero();
            for (size_t i = first; i < first + in_layer; ++i) center += state.position[i] / double(in_layer);
            double cosine = 0, sine = 0;
            for (size_t i = first; i < first + in_layer; ++i) {
                const Vec3 &a = rest.rest_position[i], b = state.position[i] - center;
                cosine += a.x() * b.x() + a.y() * b.y(), sine += a.x() * b.y() - a.y() * b.x();
            }
            const double angle = std::atan2(sine, cosine);
            total += std::remainder(angle - last, 2 * M_PI);
            last = angle;
        }
        return total;
    }
    double fastest() const {
        double v = 0;
        for (const Vec3& x : state.velocity) v = std::max(v, x.norm());
        return v;
    }
    /// Largest ratio of principal stretches of F_P.
    double plastic_ratio() const {
        double ratio = 1;
        for (const Mat3& F : state.plastic_deformation) {
            const Vec3 p = Eigen::JacobiSVD<Mat3>(F).singularValues();
            ratio = std::max(ratio, p(0) / p(2));
        }
        return ratio;
    }

private:
    std::unique_ptr<PlainMethod> plain_method;
};

constexpr double kDegree = M_PI / 180;

}  // namespace sunder::test
