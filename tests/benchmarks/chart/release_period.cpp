#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

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

// Looks at the twist after every frame for its first zero.
class FirstZero {
public:
    explicit FirstZero(const MovedBar& bar) : bar_(bar), twist_{bar.twist()} {}
    /// After a frame of h.
    void look(double h) {
        if (!std::isnan(time)) return;
        time_.push_back(time_.back() + h), twist_.push_back(bar_.twist());
        if (twist_.back() > 0) return;
        // The time at which a parabola through the last three looks, in the twist, is at zero.
        time = 0;
        const size_t n = twist_.size(), first = n - std::min<size_t>(n, 3);
        for (size_t i = first; i < n; ++i) {
            double weight = 1;
            for (size_t j = first; j < n; ++j)
                if (j != i) weight *= twist_[j] / (twist_[j] - twist_[i]);
            time += weight * time_[i];
        }
    }
    double time = std::numeric_limits<double>::quiet_NaN();  // s; NaN: none yet

private:
    const MovedBar& bar_;
    std::vector<double> time_{0.0}, twist_;
};

// A look at every pair of substeps: they belong together.
int substeps_of_a_look(int substeps) { return std::min(substeps, 2); }

// Twice the time from letting go to the first crossing of zero, s; NaN when there is none in `seconds`.
double half_period(MovedBar& io_bar, double seconds, bool to_the_end) {
    io_bar.state = held(io_bar.setting.cells);
    FirstZero zero(io_bar);
    const int looks = io_bar.setting.substeps / substeps_of_a_look(io_bar.setting.substeps);
    io_bar.setting.substeps /= looks;
    const double h = 1.0 / 24 / looks;
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
    step.error_budget = 0;
    MovedBar looked_at(step, soft());
    looked_at.state = io_bar.state;
    FirstZero zero(looked_at);
    for (int f = 0; f < std::lround(24 * seconds); ++f) {
        looked_at.state = io_bar.state;
        if (!io_bar.frame(1.0 / 24, {}, {}, false)) return std::numeric_limits<double>::quiet_NaN();
        const int looks = io_bar.last_substeps / substeps_of_a_look(io_bar.last_substeps);
        looked_at.setting.substeps = io_bar.last_substeps / looks;
        for (int k = 0; k < looks; ++k) {
            looked_at.frame(1.0 / 24 / looks, {}, {}, false);
            zero.look(1.0 / 24 / looks);
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
