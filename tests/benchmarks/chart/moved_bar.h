// A bar moved by one of the methods that the chart compares, and the processor time that this takes.
#pragma once

#include <memory>
#include <string>

#include "solver/solver.h"
#include "tests/support/plain_method.h"

namespace sunder::chart {

/// What moves the bar: the solver's methods, and the paper's as printed, without and with its section 3.3.
enum class Mover { projective, jacobi, gauss_seidel, plain, plain_corrected };
const char* name_of(Mover mover);
bool is_solver(Mover mover);    // one of Sunder's own
Method method_of(Mover mover);  // of the solver; projective for the plain method, which it does not move

/// One point of the sweep.
struct Setting {
    Mover mover = Mover::projective;
    int cells = 4;  // across the bar; cells x cells x 5 cells particles
    int substeps = 8, iterations = 2;
    double error_budget = 0;  // above 0 the solver chooses substeps and iterations

    int particles() const { return 5 * cells * cells * cells; }
};

/// What the plain method has instead of a rate of flow in 1/s: the share of the excess strain that flows in a step,
/// right for this many steps a second, as an artist would have found it once.
constexpr double kPlainTunedRate = 192;

/// The square bar of the reference study, 0.2 x 0.2 x 1 m, its particles joined to 6 neighbours; a foot (below 0.1 m)
/// that is held and a head (above 0.9 m) that is moved.
class MovedBar {
public:
    MovedBar(const Setting& setting, const Material& material);

    /// One frame: the head from one pose to the other, or free. False when the method has lost the bar; its state is of
    /// no use from there on.
    bool frame(double duration, const Pose& begin, const Pose& end, bool held, double damping = 0);
    /// The head turned about the bar's axis from one angle to another (rad), `seconds` long, at 24 frames a second.
    bool turn(double from, double to, double seconds, double damping);
    bool let_go(double seconds, double damping);

    /// Angle of the last layer against the first, followed layer by layer, rad.
    double twist() const;

    const SimulationMesh& rest() const { return scene_.rest; }
    FrameState state;
    Setting setting;
    double simulated_s = 0;         // by frames so far
    std::vector<double> frame_cpu;  // processor time of this thread for each frame, s
    int last_substeps = 0;          // of the last frame
    double total_substeps = 0;

private:
    Scene scene_;
    Material material_;
    std::unique_ptr<Solver> solver_;
    std::unique_ptr<test::PlainMethod> plain_;
};

Pose turned(double angle);  // about z, rad

}  // namespace sunder::chart
