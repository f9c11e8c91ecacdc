#include <cmath>
#include <limits>
#include <map>

#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

Material soft() {
    Material material;
    material.youngs_modulus = 6e5;
    return material;
}

// Held at 60 degrees long enough to be at rest.
const FrameState& held(int cells) {
    static std::map<int, FrameState> states;
    if (const auto known = states.find(cells); known != states.end()) return known->second;
    MovedBar bar({Mover::projective, cells, 8, 2}, soft());
    bar.turn(0, M_PI / 3, 1, 5);
    bar.turn(M_PI / 3, M_PI / 3, 3, 5);
    FrameState state = bar.state;
    for (size_t i = 0; i < state.n_particles(); ++i) state.velocity[i].setZero(), state.angular_velocity[i].setZero();
    return states[cells] = state;
}

// Looks at the twist after every step for its first zero.
class FirstZero {
public:
    explicit FirstZero(const MovedBar& bar) : bar_(bar), last_(bar.twist()) {}
    /// After a step of h.
    void look(double h) {
        const double now = bar_.twist();
        if (std::isnan(time) && now <= 0) time = elapsed_ + h * last_ / (last_ - now);
        elapsed_ += h, last_ = now;
    }
    double time = std::numeric_limits<double>::quiet_NaN();  // s; NaN: none yet

private:
    const MovedBar& bar_;
    double last_, elapsed_ = 0;
};

// Twice the time from letting go to the first crossing of zero, s; NaN when there is none in `seconds`.
double half_period(MovedBar& io_bar, double seconds, bool to_the_end) {
    io_bar.state = held(io_bar.setting.cells);
    FirstZero zero(io_bar);
    const double h = 1.0 / 24 / io_bar.setting.substeps;
    io_bar.setting.substeps = 1;  // every step is looked at
    const int steps = static_cast<int>(std::lround(seconds / h));
    for (int k = 0; k < steps && (to_the_end || std::isnan(zero.time)); ++k) {
        if (!io_bar.frame(h, {}, {}, false)) return std::numeric_limits<double>::quiet_NaN();
        zero.look(h);
    }
    return 2 * zero.time;
}

// The same where the solver chooses the steps of whole frames: each frame is then taken again step by step to look.
double half_period_within_budget(MovedBar& io_bar, double seconds) {
    io_bar.state = held(io_bar.setting.cells);
    Setting step = io_bar.setting;
    step.error_budget = 0, step.substeps = 1;
    MovedBar looked_at(step, soft());
    looked_at.state = io_bar.state;
    FirstZero zero(looked_at);
    for (int f = 0; f < std::lround(24 * seconds); ++f) {
        looked_at.state = io_bar.state;
        if (!io_bar.frame(1.0 / 24, {}, {}, false)) return std::numeric_limits<double>::quiet_NaN();
        for (int k = 0; k < io_bar.last_substeps; ++k) {
            looked_at.frame(1.0 / 24 / io_bar.last_substeps, {}, {}, false);
            zero.look(1.0 / 24 / io_bar.last_substeps);
        }
    }
    return 2 * zero.time;
}

double limit(int cells) {
    static std::map<int, double> limits;
    if (const auto known = limits.find(cells); known != limits.end()) return known->second;
    MovedBar bar({Mover::projective, cells, 320, 3}, soft());
    return limits[cells] = half_period(bar, 0.25, false);
}

}  // namespace

Outcome release_period(const Setting& setting) {
    MovedBar bar(setting, soft());
    const double found = setting.error_budget > 0 ? half_period_within_budget(bar, 0.25) : half_period(bar, 0.25, true);
    return outcome(bar, found, limit(setting.cells));
}

}  // namespace sunder::chart
