// Edges that fade: the tension on an interface, and what a body's fracture energy makes of it.
//
// Groups that break by their mean strain break into single fragments: a ring is too blunt to see a crack's tip, a cut
// takes half of a ring, and nothing in the rule has a length. Here each edge has its own tension e (stress over E). It
// starts to fade where e is the toughness tau and is parted at e_f = tau (1 + L / d0), L = 2 G_c / (E tau^2): from
// sound to parted it opens by tau L, which takes G_c of work by area beside what is elastic (Hillerborg's fictitious
// crack, Bazant's crack band).
#pragma once

#include <span>

#include "solver/data/frame_state.h"
#include "solver/data/math.h"
#include "solver/data/simulation_mesh.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Gives a state that was made without them what fades, sound, where a body has a fracture energy and anything has an
/// edge.
void add_fading(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state);

/// How the two groups of an edge are stretched, as far as a fragment's own axes tell: S - I of their optimal stretch,
/// or, of a sheet or rod, the strain in its middle, with what its faces have more and less.
struct GroupStretch {
    Mat3 mean = Mat3::Zero(), bent = Mat3::Zero();  // rest axes of the world, -
    /// Of a sheet or rod: axes of the fragment, and how thick it is along each, m. What is solid is as thick as can be.
    Mat3 axes = Mat3::Identity();
    Vec3 extent = Vec3::Constant(kNever);
};

/// An edge where its particles lie.
struct StretchedEdge {
    Vec3 rest = Vec3::Zero();                                           // from a to b as their groups have flowed, m
    Vec3 present = Vec3::Zero();                                        // likewise as they lie, m
    Quat rotation_a = Quat::Identity(), rotation_b = Quat::Identity();  // of the two groups

    /// Change of the edge as its groups are turned, over its length at rest.
    Vec3 displacement() const;
    bool is_pressed() const { return displacement().dot(rest) < 0; }
};

/// Tension on the interface over E, -: of the rings' mean strain, made to fit this edge, the stress of those principal
/// directions that pull, on the plane across the edge; 0 where all stress on it does not come to `least`. What moves
/// across a sheet shears a solid and bends a sheet: of it counts the strain at the faces of a clamped beam. Of two
/// faces the one that is pulled more.
double tension(const StretchedEdge& edge, const GroupStretch& a, const GroupStretch& b, double poisson_ratio,
               double least);

/// d, 0 .. 1, of an edge of length d0 (m) whose tension was that at most; 1: parted.
double damage(double tension, double toughness, double opening_length, double d0);

/// The tension from which on an edge of that damage, < 1, fades on or parts.
double fading_tension(double damage, double toughness, double opening_length, double d0);

}  // namespace sunder
