// Plastic flow of thin groups, and the strain at their faces.
#pragma once

#include <array>

#include "solver/data/frame_state.h"
#include "solver/matching/section_flow.h"
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

/// Of such a strain, in no order; columns of `directions` are in the rest axes of the world.
struct FacePrincipal {
    Vec3 strain;
    Mat3 directions;
};
FacePrincipal principal_of(const BendingShape& shape, const Mat3& strain);

/// What a thin group's flow did.
struct BentFlow : Yielding {
    FaceStrains faces;     // after it
    bool is_taken = true;  // all of it: F_P may change no more than so far (kMaxPlasticRatio)
};

/// Of the excess above the yield surface what flows in h seconds.
double flowing_share(const Material& material, double h);

/// Lets a section flow for `h` seconds, as `flow` of plasticity.h does (flow_section). F_P takes the mean of its
/// layers, K_P their moment over t^2 / 12, each layer keeps the rest.
BentFlow flow_bending(const BendingShape& shape, const BentShape& group, const Unexplained& rest,
                      const Material& material, double h, BendingPlasticity& io_plastic);

}  // namespace sunder
