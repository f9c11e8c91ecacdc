// What the solver knows of bodies at rest. Never changes after it is built.
#pragma once

#include <span>
#include <vector>

#include "solver/data/ids.h"
#include "solver/data/math.h"

namespace sunder {

/// An edge joins two particles whose fragments share an interface; fracture removes it.
struct Edge {
    ParticleId a, b;  // a < b
    double area = 0;  // of the interface, m2
    /// Of the toughness of the groups that would cut it, > 0; below 1: weak, infinite: glued, it never breaks.
    double toughness_factor = 1;
};

/// One oriented particle a fragment, one edge an interface, and the one-rings in both directions.
///
/// Group g is centred at particle g: the particle itself and those joined to it by an edge. Since edges are
/// symmetric, the groups that particle j belongs to are the members of group j; `member_twin` tells the slot there:
///
///     group i: ... j ...          slot s:  group_member[s] == j, s in ring of i
///     group j: ... i ...          slot t:  group_member[t] == i, t in ring of j;  member_twin[s] == t
struct SimulationMesh {
    std::vector<Vec3> rest_position;     // undeformed centre              (n_particles x 3), m
    std::vector<Quat> rest_orientation;  // principal frame at rest        (n_particles x 4)
    std::vector<Vec3> radii;             // of the ellipsoid, its axes     (n_particles x 3), m
    std::vector<double> volume;          // of the fragment                (n_particles), m3
    std::vector<double> mass;            // density * volume               (n_particles), kg
    std::vector<uint32_t> body;          // which body                     (n_particles)
    std::vector<uint32_t> fragment;      // which fragment of that body    (n_particles)
    std::vector<Edge> edges;             // ascending by (a, b)            (n_edges)

    /// What of a fragment's surface no interface covers, in sum of its normals, over a face of a cube of its volume;
    /// empty: all 1 (n_particles), -.
    std::vector<double> bareness;

    // Factors on the body's material, > 0; empty: all 1.
    std::vector<double> yield_factor;      // on the yield strain at the start (n_particles), -
    std::vector<double> toughness_factor;  // on both toughnesses of its group (n_particles), -
    std::vector<uint32_t> material;  // which material, those of bodies first (n_particles); empty: that of its body

    std::vector<uint32_t> group_offset;    // CSR                                          (n_particles + 1)
    std::vector<ParticleId> group_member;  // ascending in a ring                          (group_offset.back())
    std::vector<EdgeId> member_edge;       // to the centre, none for the centre itself    (as group_member)
    std::vector<uint32_t> member_twin;     // slot of the centre in the member's own ring  (as group_member)
    std::vector<uint8_t> group_uneven;  // 1 where an edge of the ring has a toughness factor other than 1 (n_particles)

    // Outermost points of the fragments, from the particle where it is not turned: for contacts; empty: not known.
    std::vector<uint32_t> hull_offset;  // CSR                               (n_particles + 1)
    std::vector<Vec3f> hull_point;      // m                                 (hull_offset.back() x 3)

    std::vector<double> group_trace;  // of the whole rest one-ring (rest_traces), kg m2 (n_particles); or empty
    std::vector<uint8_t> flat;        // 1: its ring lies flat (solver/data/thin_fragments.h) (n_particles); or empty
    std::vector<uint8_t> thin;        // how fragments lie: kThin, kSlender, kThick or 0 (thin_fragments.h)

    size_t n_particles() const { return rest_position.size(); }
    size_t n_edges() const { return edges.size(); }
    uint32_t material_of(size_t particle) const { return material.empty() ? body[particle] : material[particle]; }
    std::span<const Vec3f> hull(ParticleIndex particle) const {
        if (hull_offset.empty()) return {};
        return std::span(hull_point).subspan(hull_offset[particle], hull_offset[particle + 1] - hull_offset[particle]);
    }
};

/// Fills the one-rings from `edges`. Call once after particles and edges are set.
void build_one_rings(SimulationMesh& io_mesh);

/// Gives back memory that the arrays have beyond their sizes, as they do after bodies were appended.
void trim(SimulationMesh& io_mesh);

/// Appends `body` placed by `pose`; its particles get the next body index. The one-rings are not built: do so after the
/// last body.
void append_body(SimulationMesh& io_scene, const SimulationMesh& body, const Pose& pose);

}  // namespace sunder
