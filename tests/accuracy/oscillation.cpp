#include "tests/accuracy/oscillation.h"

#include "tests/accuracy/bar_cases.h"

namespace sunder::test {
namespace {

constexpr double kDensity = 1000, kWidth = 0.2, kFreeLength = 0.9;

// How far the top layer went in the mode: metres, or radians.
double excursion(const Bar& bar, Mode mode) {
    if (mode == Mode::torsion) return bar.twist();
    const SimulationMesh& rest = bar.scene.rest;
    const size_t layer = static_cast<size_t>(std::lround(std::pow(rest.n_particles() / 5.0, 2.0 / 3)));
    const int axis = mode == Mode::axial ? 2 : 1;
    double sum = 0;
    for (size_t i = rest.n_particles() - layer; i < rest.n_particles(); ++i)
        sum += bar.state.position[i](axis) - rest.rest_position[i](axis);
    return sum / double(layer);
}

// One frame with the head free.
void free_frame(Bar& io_bar, double duration, const Vec3& gravity) {
    FrameInput in = quiet_input(io_bar.scene, io_bar.material, duration);
    in.gravity = gravity;
    in.pins[1].active = false;
    advance(*io_bar.solver, in, io_bar.settings, io_bar.state);
}

// Into the shape that the mode starts from, at rest.
void displace(Bar& io_bar, Mode mode) {
    io_bar.settings = slow_load_settings();
    io_bar.settings.self_collision = false;
    if (mode == Mode::bending) {
        const double sideways = 5e-7 * io_bar.material.youngs_modulus;  // m/s2: the end sags by 1.2 cm
        for (int f = 0; f < 72; ++f) free_frame(io_bar, 1.0 / 24, Vec3(0, sideways, 0));
    } else {
        const Pose moved = mode == Mode::axial ? Pose{Vec3(0, 0, 0.01), Quat::Identity()} : Bar::turned(20 * kDegree);
        io_bar.frame(1.0 / 24, {}, moved);
        for (int f = 0; f < 36; ++f) io_bar.frame(1.0 / 24, moved, moved);
    }
    for (Vec3& v : io_bar.state.velocity) v.setZero();
    for (Vec3& w : io_bar.state.angular_velocity) w.setZero();
}

}  // namespace

double half_period(const Oscillation& setup) {
    Bar bar(setup.n, setup.neighbours);
    bar.material.youngs_modulus = setup.youngs_modulus;
    bar.start();
    displace(bar, setup.mode);
    bar.settings.damping = 0;
    bar.settings.substeps = std::min(setup.substeps, 2);  // pairs belong together
    bar.settings.iterations = setup.iterations;
    const double h = 1.0 / 24 / setup.substeps * bar.settings.substeps, start = bar.state.time;
    double last = excursion(bar, setup.mode), first_zero = -1;
    while (bar.state.time - start < 10) {
        free_frame(bar, h, Vec3::Zero());
        const double now = excursion(bar, setup.mode);
        if ((now > 0) != (last > 0)) {
            const double zero = bar.state.time - h * now / (now - last);
            if (first_zero > 0) return zero - first_zero;
            first_zero = zero;
        }
        last = now;
    }
    ADD_FAILURE() << "no vibration within 10 s";
    return 0;
}

double half_period_in_theory(Mode mode, double youngs_modulus) {
    const double c = std::sqrt(youngs_modulus / kDensity), c_shear = std::sqrt(0.5) * c;  // nu = 0
    const double L = kFreeLength;
    if (mode == Mode::axial) return 2 * L / c;
    if (mode == Mode::torsion) return 2 * L / (c_shear * std::sqrt(6 * 0.1406));  // polar moment a^4 / 6
    const double radius = kWidth / std::sqrt(12.0);                               // of gyration
    const double beta = 1.8751 / L, omega = beta * beta * radius * c;
    // Rayleigh's quotient with the mode's mean slope and curvature: int w'^2 / int w^2 = 4.648 / L^2.
    const double slender = radius * radius * 4.648 / (L * L), shear = 2 / (5.0 / 6);  // E / (kappa mu)
    return M_PI / omega * std::sqrt(1 + slender * (1 + shear));
}

}  // namespace sunder::test
