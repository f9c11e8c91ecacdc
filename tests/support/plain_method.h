// The paper's method as it is printed, without Sunder's departures (docs/theory.md): what they are measured against.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/optimal_stretch.h"
#include "solver/scene/live_topology.h"
#include "solver/scene/scene.h"

namespace sunder::test {

struct PlainSettings {
    int substeps = 1;              // steps of a frame
    int iterations = 4;            // Gauss-Seidel sweeps a step
    double flow_per_step = 0.2;    // nu of section 3.4, -
    bool correct_momentum = true;  // section 3.3
    double damping = 0;            // 1/s
    bool backward = false;         // sweep the groups from last to first
    double max_speed = 1e12;       // m/s; beyond it a run counts as lost
};

/// Choi 2014, sections 3.1 to 3.5: prediction, shape matching by Gauss-Seidel in the order of the particles with
/// stiffness k, velocities read back with the local correction of angular momentum, plastic flow a step, and fracture
/// group by group. Nothing is clamped. Of a material it takes `stiffness` (k), `hardening` (kappa) and `toughness`
/// (tau); yield is the state's. Pins hold their particles against groups; contacts and forces are left out. A group
/// with a held particle exchanges momentum with the pin, so that its own is not corrected.
class PlainMethod {
public:
    explicit PlainMethod(Scene scene);

    /// One frame. False when numbers are no longer finite, or run away; the state is then what that step left.
    bool advance(const FrameInput& input, const PlainSettings& settings, FrameState& io_state);

private:
    struct Group {  // what rests
        double mass = 0;
        Vec3 rest_center = Vec3::Zero();
        Mat3 A_qq = Mat3::Zero();  // without F_P, kg m2
        StretchBasis stretch;      // of F_P A_qq F_P^T
        Quat rotation = Quat::Identity();
    };
    struct Particle {  // during a step
        Vec3 x0, x;    // before the step and now, m
        Quat q0, q;
        Mat3 R;  // of q
        bool held = false;
        Vec3 dv, dw;  // corrections that wait for the velocity update, m/s, rad/s
    };
    struct Strain {
        Vec3 elastic_log;  // along `directions`
        Mat3 directions;
    };

    void synchronise(const FrameState& state);
    void rebuild_group(const Mat3& F_P, uint32_t g);
    void predict(const FrameInput& input, double h, double end, const FrameState& state);
    void match_group(const PlainSettings& settings, double k, double h, const Mat3& F_P, uint32_t g);
    Mat3 covariance(uint32_t g, Vec3& center) const;
    Vec3 angular_momentum(uint32_t g, const Vec3& center, double h) const;
    void update_velocities(const PlainSettings& settings, double h, FrameState& io_state) const;
    Strain flow(const PlainSettings& settings, const Material& material, double h, uint32_t g, FrameState& io_state);
    void fracture(const Strain& strain, double toughness, uint32_t g, FrameState& io_state);
    Mat3 inertia(uint32_t j) const;

    Scene scene_;
    LiveTopology live_;
    std::vector<Group> groups_;
    std::vector<Particle> particles_;
    std::vector<Vec3> moment_;         // diagonal of A_j, kg m2
    std::vector<Mat3> rest_rotation_;  // Rbar_j
    std::vector<Mat3> moment_rest_;    // A_j Rbar_j^T
    std::vector<uint8_t> synced_edges_;
    std::vector<Mat3> synced_plastic_;
};

}  // namespace sunder::test
