// A state between two kept ones: what is shown where time is scaled. Output only: nothing is simulated from it.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/skin/visual_mesh.h"
#include "nodes/types/carried.h"
#include "solver/data/frame_state.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

/// s; at a share of the way between two times.
inline double time_between(double a, double b, double share) { return a + share * (b - a); }

/// At `share` in (0, 1) of the way from `a` to `b`, the states of one frame and the next.
///
/// What hangs together at the end moves as a whole: its centre along a parabola where both velocities fit one
/// acceleration and straight where they do not, its turn steadily, as many times round as its spin tells; so it keeps
/// its shape. What it deforms besides is blended in the frame that moves with it. Velocities are those of this motion,
/// of simulated time. Plastic strain, strain and stiffness are blended, edges break at their own time, what is let go
/// on the way tells when, and all else is as in `a`. What is the same in both keeps its bits, and what is carried goes
/// where it is carried: what hangs together with these goes along, moved by as much as they are beside its own motion.
FrameState state_between(const SimulationMesh& rest, const FrameState& a, const FrameState& b, double share,
                         std::span<const Carried> carried = {});

/// Of each particle, how the piece that it belongs to turns and accelerates on the way from `a` to `b`, about where
/// `shown`, `a` or a state between the two, has its centre. What rests does neither. (n_particles)
std::vector<PieceMotion> piece_motions(const SimulationMesh& rest, const FrameState& a, const FrameState& b,
                                       const FrameState& shown, std::span<const Carried> carried = {});

}  // namespace sunder
