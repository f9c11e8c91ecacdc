// The linear solve of a Newton step, in single or double precision.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/bending_kernels.h"
#include "solver/matching/sweep_store.h"

namespace sunder {

/// The residual of a unit, squared: residual . M residual / diagonal, kg m2.
struct UnitResidual {
    double now = 0;        // where the Newton step begins
    double reference = 0;  // at the start of the substep
    double size = 0;       // what a residual of 1 squared is in it: sum of traces of A_qq, kg m2
};

/// What works on a unit.
template <class Real>
struct UnitKernels {
    const SweepKernels& sweep;
    const NewtonKernels<Real>& newton;
    const BendingArrays<Real>* bending;  // of its thin groups, or null
};

/// What conjugate gradients need of one unit while they last.
template <class Real>
class CgStore {
public:
    /// From now on this unit, as it stands, from a solution of zero. What a store held of the same unit, and did not
    /// change, it keeps.
    void take_up(const SweepInput& input, const LaneLayout& layout, size_t unit, const SweepKernels& kernels,
                 const UnitBlocks& blocks);

    CgArrays<Real> arrays(const CgGroups<Real>* groups, CgParticles<Real>* particles,
                          const BendingArrays<Real>* bending);
    Real* momentum(size_t lane) { return momentum_[lane].numbers; }
    CgVectors<Real>* vectors() { return vectors_.data(); }  // by block
    std::span<const double> magnitude() const { return magnitude_; }
    std::span<const double> curvature() const { return curvature_; }
    /// Shift, m, and turn, rad, of a lane, times the unit's scale.
    Vec3 shift(size_t lane) const { return solution(lane, 0); }
    Vec3 turn(size_t lane) const { return solution(lane, 3); }

private:
    struct alignas(64) Pull {
        Real numbers[16];
    };
    struct alignas(8 * sizeof(Real)) Momentum {
        Real numbers[8];
    };
    Vec3 solution(size_t lane, int first) const {
        const auto& numbers = vectors_[lane / LaneLayout::kLanes].solution;
        const size_t l = lane % LaneLayout::kLanes;
        return Vec3(numbers[first][l], numbers[first + 1][l], numbers[first + 2][l]);
    }

    ShapeWatch watch_;
    std::vector<CgRow<Real>> rows_;
    std::vector<CgVectors<Real>> vectors_;
    std::vector<Momentum> momentum_;
    std::vector<Pull> pulls_;
    std::vector<double> magnitude_, curvature_;
};

/// Between finding the residuals of all units and solving for each, this much of each is kept.
template <class Real>
class ConjugateGradients {
public:
    static constexpr int kMaxIterations = 60;          // a bar of 2560 particles at 2 MPa takes 40
    static constexpr int kMaxBendingIterations = 200;  // a plate of 600: 69 at 10 MPa, 191 at 1 GPa
    static constexpr double kTolerance = 0.005;        // of the preconditioned residual at the start of the substep

    void fit(const LaneLayout& layout);

    // Of one unit, by block.
    CgGroups<Real>* groups(const LaneLayout::Unit& u) { return groups_.data() + u.begin_block; }  // match_for_newton's
    CgParticles<Real>* particles(const LaneLayout::Unit& u) { return particles_.data() + u.begin_block; }  // gather's

    /// Takes over what gather_residual found.
    void take_residual(const LaneLayout::Unit& unit, std::span<const NewtonParticles> newton,
                       const UnitResidual& residual, const UnitBlocks& blocks);

    /// `io_newton` holds a motion z as its residual (shift, turn), held particles' too: makes it M^-1 (M - H) z, the
    /// pull of the groups on what moves so, with its magnitude. Of a unit, after gather_residual.
    void pull_on_motion(const SweepInput& input, const LaneLayout& layout, size_t unit,
                        std::span<NewtonParticles> io_newton, const UnitKernels<Real>& kernels,
                        const UnitBlocks& blocks, CgStore<Real>& io_store);

    /// Solves a unit. `mean`: squared residual of the whole scene over its size. Returns what the solution is
    /// multiplied by, 1/(kg^1/2 m); 0: the unit is left alone.
    double solve(const SweepInput& input, const LaneLayout& layout, size_t unit, const UnitResidual& residual,
                 double mean, const UnitKernels<Real>& kernels, const UnitBlocks& blocks, CgStore<Real>& io_store);

private:
    std::vector<CgGroups<Real>> groups_;
    std::vector<CgParticles<Real>> particles_;
};

}  // namespace sunder
