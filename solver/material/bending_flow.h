// Plastic flow of thin groups, and the strain at their faces.
#pragma once

#include <array>

#include "solver/data/frame_state.h"
#include "solver/matching/bending_shape.h"
#include "solver/material/fracture.h"
#include "solver/scene/scene.h"

namespace sunder {

/// What of a thin group is changed for good.
struct BendingPlasticity {
    Mat3 F_P = Mat3::Identity();  // of the mean of its section, rest axes of the world, det 1
    Mat3 K_P = Mat3::Zero();      // in the fragment's axes, rad/m
    LayerStrain remainder = {};   // of the layers, what F_P and K_P leave of their flow
    double yield = kNever;        // -
};

/// The elastic logarithmic strains where a thin group is strained most, in the fragment's axes.
struct FaceStrains {
    size_t n = 0;  // 2: at the faces of a sheet; 4: at the edges of a rod
    std::array<Mat3, 4> strain;
};

/// What a thin group's flow did.
struct BentFlow {
    FaceStrains faces;   // after it
    bool flows = false;  // something did
    // Of what no bent shape explains, what became so for good, -:
    double stretch_share = 0, bend_share = 0;
};

/// Lets a section's layers flow for `h` seconds, each above the yield surface as `flow` of plasticity.h does: five of
/// equal weight through a sheet, z = t/2 (2i - 4) / sqrt(24), so that sum w z^2 = t^2 / 12 exactly; five by five
/// through a rod. F_P takes their mean, K_P their moment over t^2 / 12, each layer keeps the rest. Layers without
/// weight lie at the faces. What no bent shape explains counts in each layer as a uniaxial strain at right angles to
/// the layer's own, and flows by the same share: one material. What it has of bending grows with the distance from the
/// middle as the layers' own does.
BentFlow flow_bending(const BendingShape& shape, const BentGroup& group, const Unexplained& rest,
                      const Material& material, double h, BendingPlasticity& io_plastic);

}  // namespace sunder
