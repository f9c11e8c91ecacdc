// How far groups are stretched where their particles are now, four groups at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "solver/shape_matching.h"
#include "solver/stretch_kernels.h"

namespace sunder {

/// The optimal rotation (polar_decomposition.h) and stretch (optimal_stretch.h) of groups: but for rounding what
/// the functions for one of them give.
class GroupStretcher {
public:
    /// All of it must stay while this is used; `goals` may change.
    GroupStretcher(const LiveTopology& live, const GroupShapes& shapes, std::span<const MovingParticle> particles,
                   std::span<const GroupGoal> goals);

    /// Rotations start from the goals'. A group may be among the four more than once.
    void measure(const uint32_t (&groups)[4], GroupStretches& o_stretches) const {
        kernels_->measure(records_, groups, o_stretches);
    }
    /// Principal stretches of each, ascending, clamped to [0.1, 10] as in principal_stretch; correct to some 1e-15.
    std::array<Vec3, 4> principal_stretches(const GroupStretches& stretches) const;

private:
    StretchRecords records_;
    const StretchKernels* kernels_;
};

/// Largest |log lambda| of principal stretches in ascending order.
inline double largest_strain(const Vec3& stretch) { return std::log(std::max(stretch(2), 1 / stretch(0))); }

/// S of one of the four.
inline Mat3 stretch_of(const GroupStretches& s, size_t i) {
    return to_matrix({s.S[0][i], s.S[1][i], s.S[2][i], s.S[3][i], s.S[4][i], s.S[5][i]});
}

/// Groups collected until there are four of one size, so that they have as many members side by side.
class GroupsBySize {
public:
    /// Calls four(groups, n) whenever there are four (n = 4).
    template <class Four>
    void add(uint32_t group, uint32_t size, const Four& four) {
        take(group, waiting_[std::min<size_t>(size, waiting_.size() - 1)], four);
    }
    /// The rest, whatever their sizes; where there are n < 4, the others repeat the first.
    template <class Four>
    void finish(const Four& four) {
        Waiting rest;
        for (Waiting& w : waiting_) {
            for (uint32_t i = 0; i < w.n; ++i) take(w.group[i], rest, four);
            w.n = 0;
        }
        if (rest.n == 0) return;
        for (uint32_t i = rest.n; i < 4; ++i) rest.group[i] = rest.group[0];
        four(rest.group, rest.n);
    }

private:
    struct Waiting {
        uint32_t n = 0, group[4];
    };
    template <class Four>
    static void take(uint32_t group, Waiting& io_waiting, const Four& four) {
        io_waiting.group[io_waiting.n++] = group;
        if (io_waiting.n < 4) return;
        io_waiting.n = 0;
        four(io_waiting.group, 4u);
    }
    std::array<Waiting, 32> waiting_;  // by size; the last holds all larger ones
};

}  // namespace sunder
