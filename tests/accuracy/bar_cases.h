// The square bar under the loads of the continuum references (tests/accuracy/reference), brought to equilibrium by the
// solver, and how far it then lies from them.
#pragma once

#include <string>
#include <vector>

#include "tests/stability/bars.h"

namespace sunder::test {

constexpr double kShearModulus = 1e6;  // Pa, as the references

/// Motion of the bar's upper end. `amount` is in percent of the free length (stretch) or in degrees.
enum class Load { stretch, twist, bend };

/// Rest place -> place of the upper end. Bend turns it about x with its centre on the arc that keeps the axis' length.
Pose head_pose(Load load, double amount);

/// Equilibria do not depend on the step (the fields by 1e-5, residual angles by 0.2 degrees), so few are enough.
inline SolverSettings slow_load_settings() {
    SolverSettings settings;
    settings.substeps = 2;
    settings.damping = 5;
    return settings;
}

struct BarSetup {
    Load load = Load::twist;
    int n = 4;           // particles across; n x n x 5n in all
    int neighbours = 6;  // 6, 18 or 26
    double poisson_ratio = 0;
    double yield = kNever;   // principal log strain in pure shear
    double flow_rate = 100;  // 1/s
    bool slender = false;    // else as blocks
    SolverSettings settings = slow_load_settings();
    double frame_rate = 24;  // 1/s
};

class LoadedBar {
public:
    explicit LoadedBar(const BarSetup& setup);

    /// Moves the head from where it is to `amount` in `seconds`.
    void drive(double amount, double seconds);
    /// Holds until the bar moves less than `tolerance` of its mean displacement in a hundredth of a second, for 20 s
    /// at most; returns the seconds that it took, or -1 when it did not come to rest.
    double settle(double tolerance = 1e-5);
    /// Lets the head go and waits `seconds`.
    void release(double seconds);

    /// What the head's pin holds against: the axial force (N) of a stretch, else the moment (N m) about z or, through
    /// the head's centre, about x. Measured from outside: the momentum that the head's particles gain when they are
    /// let go for a microsecond.
    double reaction() const;
    /// Twist about z or bend about x of the uppermost layer against the lowest, in degrees.
    double angle() const;
    double amount() const { return amount_; }
    const Bar& bar() const { return bar_; }

private:
    Load load_;
    double frame_time_;
    double amount_ = 0;
    Bar bar_;
};

/// An elastic reference on the n x n x 5n lattice.
struct Reference {
    double reaction = 0;         // as LoadedBar::reaction()
    std::vector<Vec3> position;  // of the free particles, x fastest, z slowest (4 n^3 x 3), m
};
/// Throws std::runtime_error when the file or the lattice is missing.
Reference read_reference(Load load, double poisson_ratio, int n);
/// Angle at zero moment (degrees) of an elastoplastic reference such as "twist90_j2_yield0.02".
double reference_residual(const std::string& name);

struct FieldError {
    double l2 = 0;   // sqrt(sum |x - x_ref|^2 / sum |x_ref - X|^2) over free particles
    double max = 0;  // largest |x - x_ref| over largest |x_ref - X|
};
FieldError field_error(const Bar& bar, int n, const Reference& reference);

/// The elastic case's name, "twist90_nu0.30", and its amount: 20 %, 90 or 60 degrees.
std::string reference_name(Load load, double poisson_ratio);
double reference_amount(Load load);

/// Loads slowly to `most` degrees, then unloads: driven back until the moment is zero, and let go.
struct PlasticOutcome {
    double moment = 0;    // at full load, N m
    double residual = 0;  // angle of the head at zero moment, degrees
};
PlasticOutcome load_and_unload(const BarSetup& setup, double most);
/// Angle of the upper end two seconds after it was let go, degrees.
double load_and_let_go(const BarSetup& setup, double most);

}  // namespace sunder::test
