// What of a thin group's section flows in a step: return mapping of its layers (docs/theory.md, "Sheets and rods").
#pragma once

#include <span>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/matching/bending_shape.h"

namespace sunder {

/// The elastic strain of a group's section, logarithmic: in its plane, along it, or, where it spans all directions,
/// all.
SectionStrain section_strain(const BendingShape& shape, const BentShape& group, const Mat3& K_P);

/// False where nothing of it flows: cheaper than its strain.
bool may_flow(const BendingShape& shape, const BentShape& group, const Mat3& K_P, const LayerStrain& remainder,
              const Unexplained& rest, double yield);

/// What flows of it: `flowed` is the mean of the layers, and their moment over t^2 / 12.
struct SectionFlow : Yielding {
    LayerStrain layers = {};  // what each layer flows
};

/// The elastic logarithmic strains where a thin or slender group is strained most, in the fragment's axes.
struct FaceStrains {
    size_t n = 0;  // 2: at the faces of a sheet; 4: at the edges of a rod; 6: at the faces of a box
    std::array<Mat3, 6> strain;
};

/// Five layers of equal weight through a sheet, z = t/2 (2i - 4) / sqrt(24), so that sum w z^2 = t^2 / 12 exactly; five
/// by five through a rod. Behind them those without weight, at the faces or the edges. Where a fragment is one of
/// several through a thickness, four places in it, at every other corner of a box of t / sqrt(3): what faces bear is
/// that of the section there, whose deviator is the yield or that of the four at most.
void find_face_strains(const BendingShape& shape, const SectionStrain& strain, const LayerStrain& remainder,
                       double yield, FaceStrains& o_faces);
/// What the mean and the moment of a flow leave of that of each layer.
LayerStrain remainder_of(const BendingShape& shape, const SectionFlow& flow);

/// Of the excess of each layer above the yield surface `share` flows, along its deviator. What no bent
/// shape explains counts in each layer as a uniaxial strain at right angles to the layer's own, and flows by the same
/// share: one material. What it has of bending grows with the distance from the middle as the layers' own does.
SectionFlow flow_section(const BendingShape& shape, const SectionStrain& strain, const LayerStrain& remainder,
                         const Unexplained& rest, double yield, double share);

/// What flows of thin groups by the end of a step: no more than lasts of what flowed in the last one.
struct FlowWithin {
    std::span<const double> yield;        // (n_particles)
    std::span<const LayerStrain> layers;  // what each has kept (n_particles)
    std::span<const double> rate;         // FrameState::yielding_rate (n_particles), 1/s
    double seconds = 0;                   // of the step
    std::vector<double> share;            // of the excess above the yield surface, in the step (by material)
};

}  // namespace sunder
