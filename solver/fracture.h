// Which edges break (Choi 2014, section 3.5): the maximum principal strain criterion, made independent of order.
#pragma once

#include <span>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/live_topology.h"
#include "solver/shape_matching.h"

namespace sunder {

/// How near a group is to failing, and across which plane.
struct GroupStrain {
    double load = 0;              // strain over toughness, -; above 1 the group breaks
    double strain = 0;            // the principal elastic log strain meant by `load`, -
    Vec3 normal = Vec3::UnitZ();  // R e_i: unit normal of the fracture plane, world
};

/// Compares a group's elastic strains with the material's toughness: tension by default, compression where asked for.
GroupStrain group_strain(const Vec3& elastic_log_strain, const Mat3& directions, const Quat& rotation,
                         const Material& material);

/// Edges to cut, ascending. Two phases: every group's strain is known before anything is cut. A group cuts only if it
/// is the most loaded of its one-ring (ties, to a millionth: the lower index), so that one crack forms and not one a
/// layer; and only if its load is above the toughness by `leading` (0 .. 1) of the most in its piece: a long substep
/// takes much of a piece past its toughness at once, where what got there first would have relieved the rest. It cuts
/// the edges from its centre that cross the plane through its centre of mass. If the centre particle
/// lies on the plane (closer than 1e-6 of the group's size) it joins the heavier side, and the side of the normal where
/// both weigh the same; a neighbour on the plane stays with the centre.
std::vector<BrokenEdge> edges_to_cut(const LiveTopology& live, const GroupShapes& shapes,
                                     std::span<const MovingParticle> particles, std::span<const GroupStrain> strains,
                                     double leading, double time);

}  // namespace sunder
