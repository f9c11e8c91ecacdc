// The linear solve of a Newton step, in single or double precision.
#pragma once

#include <span>
#include <vector>

#include "solver/sweep_store.h"

namespace sunder {

template <class Real>
class ConjugateGradients {
public:
    static constexpr int kMaxIterations = 60;    // a bar of 2560 particles at 2 MPa takes 40
    static constexpr double kTolerance = 0.005;  // of the preconditioned residual at the start of the substep

    /// Rest shapes that changed since they were last taken up; `layout` is up to date.
    void take_up(const SweepInput& input, const LaneLayout& layout, const WorkerPool& workers);

    CgGroups<Real>* groups() { return groups_.data(); }           // match_for_newton writes them
    CgParticles<Real>* particles() { return particles_.data(); }  // gather_residual writes them

    /// Every unit of the layout by itself. `io_reference`: the squared residual of each at the start of the substep, kg
    /// m2; written in the first iteration.
    void solve(bool first_iteration, const LaneLayout& layout, std::span<const NewtonParticles> newton,
               const NewtonKernels<Real>& kernels, const WorkerPool& workers, std::span<double> io_reference);

    /// `io_newton` holds a motion z as its residual (shift, turn), held particles' too: makes it M^-1 (M - H) z, the
    /// pull of the groups on what moves so, with its magnitude.
    void pull_on_motion(const LaneLayout& layout, std::span<NewtonParticles> io_newton,
                        const NewtonKernels<Real>& kernels, const WorkerPool& workers);

    bool is_moved(size_t lane) const {
        return scale_[lane / LaneLayout::kLanes] != 0 &&
               particles_[lane / LaneLayout::kLanes].inverse_diagonal[lane % LaneLayout::kLanes] != 0;
    }
    /// Shift, m, and turn, rad, of a lane that is moved.
    Vec3 shift(size_t lane) const { return solution(lane, 0); }
    Vec3 turn(size_t lane) const { return solution(lane, 3); }

private:
    struct alignas(64) Pull {
        Real numbers[16];
    };
    struct alignas(8 * sizeof(Real)) Momentum {
        Real numbers[8];
    };

    CgArrays<Real> arrays(const LaneLayout& layout);
    void take_up_group(const SweepInput& input, const LaneLayout& layout, uint32_t g);
    template <class ForBlocks>
    void solve_unit(bool first_iteration, const LaneLayout& layout, std::span<const NewtonParticles> newton,
                    const NewtonKernels<Real>& kernels, size_t unit, double mean, double& io_reference,
                    const ForBlocks& for_blocks);
    Vec3 solution(size_t lane, int first) const {
        const auto& numbers = particles_[lane / LaneLayout::kLanes].solution;
        const size_t l = lane % LaneLayout::kLanes;
        return Vec3(numbers[first][l], numbers[first + 1][l], numbers[first + 2][l]) /
               scale_[lane / LaneLayout::kLanes];
    }

    uint64_t version_ = 0;            // of the topology
    std::vector<uint64_t> revision_;  // of each group's shape as taken up (n_particles)
    std::vector<CgRow<Real>> rows_;
    std::vector<CgGroups<Real>> groups_;
    std::vector<CgParticles<Real>> particles_;
    std::vector<Momentum> momentum_;
    std::vector<Pull> pulls_;
    std::vector<double> magnitude_, curvature_;
    std::vector<double> scale_;  // of each block's numbers: residual and solution are multiplied by it; 0: left alone
};

}  // namespace sunder
