// Which edges break (Choi 2014, section 3.5): the maximum principal strain criterion, made independent of order.
#pragma once

#include <span>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/matching/shape_matching.h"
#include "solver/scene/live_topology.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// How near a group is to failing, and across which plane.
struct GroupStrain {
    double load = 0;              // strain over toughness, -; above 1 the group breaks
    double strain = 0;            // the principal elastic log strain meant by `load`, -
    Vec3 normal = Vec3::UnitZ();  // R e_i: unit normal of the fracture plane, world
};

/// Groups with what a plane through them cuts.
struct LiveGroups {
    const SimulationMesh& rest;
    const LiveTopology& live;
    const GroupShapes& shapes;
    std::span<const MovingParticle> particles;
    std::span<const double> bond = {};  // FrameState::edge_bond
};

/// Whether an edge from the centre of group g has a factor on its toughness, of the mesh or in this frame.
bool has_bond(const LiveTopology& live, std::span<const double> bond, ParticleIndex g);  // in this frame
inline bool is_uneven(const SimulationMesh& rest, const LiveTopology& live, std::span<const double> bond,
                      ParticleIndex g) {
    return rest.group_uneven[g] != 0 || (!bond.empty() && has_bond(live, bond, g));
}

enum class Strained : uint8_t { pulled, pressed };

/// The log strain that breaks group g: the one answer to whoever asks what breaks, when, or how near it is. `own` is
/// its material_of; interfaces may be weaker or tougher. Along a direction it is toughness times the mean factor of the
/// edges that the plane across it cuts, each counting with its weight in the group and with how squarely it meets the
/// plane: as in a cross-section that the pull has to part. Glued edges do not count; where a plane would cut nothing
/// else, the group does not break across it (kNever).
double breaking_strain(const LiveGroups& groups, const Material& own, ParticleIndex g, Strained how,
                       const Vec3& direction);

/// No strain below it breaks the group, whatever its direction: that of the weakest edge.
double breaking_strain(const SimulationMesh& rest, const LiveTopology& live, const Material& own, ParticleIndex g,
                       Strained how, std::span<const double> bond = {});
/// The same, pulled or pressed.
double breaking_strain(const SimulationMesh& rest, const LiveTopology& live, const Material& own, ParticleIndex g,
                       std::span<const double> bond = {});

/// Compares a group's elastic strains with the material's toughness: tension by default, compression where asked for.
GroupStrain group_strain(const Vec3& elastic_log_strain, const Mat3& directions, const Quat& rotation,
                         const Material& material);

/// The same for a group whose edges are not equally tough: along each principal direction, with `breaking_strain`.
GroupStrain uneven_group_strain(const Vec3& elastic_log_strain, const Mat3& directions, const Quat& rotation,
                                const Material& material, const LiveGroups& groups, ParticleIndex g);

/// Edges to cut, ascending. Two phases: every group's strain is known before anything is cut. A group cuts only if it
/// is the most loaded of its one-ring (ties, to a millionth: the lower index), so that one crack forms and not one a
/// layer; and only if its load is above the toughness by `leading` (0 .. 1) of the most in its piece: a long substep
/// takes much of a piece past its toughness at once, where what got there first would have relieved the rest. It cuts
/// the edges from its centre that cross the plane through its centre of mass. If the centre particle lies on the plane
/// (closer than 1e-6 of the group's size) it joins the heavier side, and the side of the normal where both weigh the
/// same; a neighbour on the plane stays with the centre. In groups that are not equally tough only edges whose own
/// factor the strain exceeds are cut, and the plane moves just past the centre where what lies on that side is weaker.
std::vector<BrokenEdge> edges_to_cut(const LiveGroups& groups, std::span<const GroupStrain> strains, double leading,
                                     double time, const WorkerPool& workers);

}  // namespace sunder
