// Plastic flow of a group (Choi 2014, section 3.4, with the departures of docs/theory.md, "Plastic flow").
#pragma once

#include <array>
#include <span>

#include "solver/data/math.h"
#include "solver/matching/optimal_stretch.h"
#include "solver/material/stretch_kernels.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Largest ratio of principal stretches that F_P may store; drawn further, a group stays elastic.
constexpr double kMaxPlasticRatio = 8.0;

/// Yield grows towards this share of the toughness at most, so that a ductile material never hardens into a brittle
/// one.
constexpr double kHardeningCap = 0.9;

/// Where the yield of a particle's group begins; from there on it is in the state, as it hardens.
double yield_strain(const SimulationMesh& rest, size_t particle, const Material& body);

struct PlasticState {
    Mat3 F_P = Mat3::Identity();  // symmetric, det 1
    double yield = kNever;        // -
};

/// What flows, or may.
struct FlowingGroup {
    PrincipalStretch stretch;
    Material material;
    PlasticState plastic;
};

struct FlowResult {
    Vec3 elastic_log_strain;       // what remains, along PrincipalStretch::directions (Eq. 9)
    Quat spin = Quat::Identity();  // turns the group's rotation: R <- R spin leaves every goal where it was
    bool flowed = false;
};

/// Lets the deviatoric elastic strain above the yield surface flow for `h` seconds:
/// gamma = (1 - exp(-flow_rate h)) (|e| - e_Y) / |e|, |e| = max |dev log lambda|, the same per second at any step size.
/// F_P takes V (dev Lambda)^gamma V^T and keeps its symmetric right factor; yield grows with the plastic strain.
/// One to four groups at a time; what comes of one does not depend on the others.
void flow(std::span<FlowingGroup> groups, double h, const StretchKernels& kernels,
          std::array<FlowResult, 4>& o_results);

}  // namespace sunder
