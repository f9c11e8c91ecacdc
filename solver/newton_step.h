// A Newton step of the implicit Euler equations: all particles of the scene move together, rotations included, so that
// stiff bodies have their true stiffness after one or two steps where sweeps would need hundreds.
#pragma once

#include <span>
#include <vector>

#include "solver/parallel.h"
#include "solver/shape_matching.h"

namespace sunder {

/// Motion of a particle: shift (m) and turn (rad, world). Also the residual and the like, in kg m and kg m2 rad.
struct Twist {
    Vec3 shift = Vec3::Zero();
    Vec3 turn = Vec3::Zero();
};

/// Solves H d = -gradient by conjugate gradients, matrix-free over the groups. A group with goal rotation R pulls its
/// members towards the rigid motion that fits theirs best (centre c and turn w about it):
///
///     H d at member j:   b m_j ( d_j - c - w x R q_j )      and   b H_j ( turn_j - w ),
///     c = sum m_j d_j / M,   w = K^-1 sum ( m_j R q_j x d_j + H_j turn_j ),   K = inertia of the group in its goal
///     shape
///
/// with masses and inertias weighted as in GroupShapes, plus m_j d_j and H_j turn_j for inertia, plus the pressure
/// term. K of the goal shape, not of the present one, keeps H positive definite in any deformation.
class NewtonStep {
public:
    static constexpr int kMaxIterations = 60;    // of conjugate gradients; a bar of 2560 particles at 2 MPa takes 40
    static constexpr double kTolerance = 0.005;  // of the preconditioned residual at the start of the substep

    struct Input {
        const SimulationMesh& rest;
        const LiveTopology& live;
        const GroupShapes& shapes;
        std::span<const GroupStiffness> stiffness;
        std::span<const GroupGoal> goals;  // of the present particles (match_groups)
        std::span<const Mat3> inertia;     // H_j of the particles' ellipsoids, world, kg m2
        std::span<const uint8_t> held;     // these stay
    };

    /// Moves the particles by the step. Later iterations of a substep do no more than contacts and turning left to do.
    void apply(bool first_iteration, const Input& input, const WorkerPool& workers,
               std::span<MovingParticle> io_particles);

private:
    struct Group {
        Mat3 R, K_inverse;        // goal rotation; 1/(kg m2)
        double b, inverse_mass;   // -, 1/kg
        double pressure;          // lambda/(2 mu) tr/3, kg m2
        Vec3 center_shift, turn;  // c, w of the present direction
        Mat3 pull;                // P: pulls member j by -c + P q_j
    };
    void prepare_groups(const Input& input, size_t begin, size_t end);
    void gather_residual(const Input& input, std::span<const MovingParticle> particles, size_t begin, size_t end);
    void fit_groups(const Input& input, size_t begin, size_t end);
    void gather_product(const Input& input, size_t begin, size_t end);
    void precondition(const Input& input, size_t begin, size_t end);
    void solve(bool first_iteration_iteration, const Input& input, const WorkerPool& workers);

    std::vector<Group> groups_;
    std::vector<Twist> solution_, residual_, direction_, product_, preconditioned_;
    double reference_ = 0;               // squared residual at the start of the substep
    std::vector<double> diagonal_;       // 1 + sum_g b_g
    std::vector<Mat3> inverse_inertia_;  // 1/(kg m2)
};

}  // namespace sunder
