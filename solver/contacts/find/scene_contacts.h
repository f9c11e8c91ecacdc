// The contacts of a scene at the start of a substep: detection, and what the materials say about each.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/detection.h"
#include "solver/collision/hull_support.h"
#include "solver/contacts/find/contact_reach.h"
#include "solver/contacts/solve/contact_response.h"
#include "solver/scene/live_topology.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Where the movable things are at the start of a substep, and where they would go alone.
struct MovableMotion {
    std::span<const Vec3> position;                    // (n_movables), m
    std::span<const Quat> rotation;                    // since rest (n_movables)
    std::span<const Vec3> velocity, angular_velocity;  // forces included (n_movables), m/s, rad/s
    std::span<const Mat3> plastic_deformation;         // F_P (n_particles)
};

/// A substep within its frame.
struct Interval {
    double h = 0;               // s
    double begin = 0, end = 1;  // share of the frame
};

/// What lets a search end early (DetectionInput).
struct SearchEnd {
    std::span<const uint8_t> fixed;
    std::function<bool(std::span<const Contact>)> ends;
};

/// How far beyond touching contacts reach, m: a small share of a typical particle.
double contact_margin(const Scene& scene);

/// Finds contacts, and describes those that may push; keeps scratch and the broad phase's memory between substeps
/// (neither changes the result).
class SceneContacts {
public:
    /// False, and `out` empty, where the search ended early.
    bool find(const StepContext& context, const LiveTopology& live, std::span<const Role> role,
              const MovableMotion& motion, const Interval& interval, const SearchEnd& search_end,
              std::vector<ActiveContact>& out);

    /// Call when a state was set from outside.
    void reset() { scratch_.reset(), hulls_.reset(); }
    /// Call when particles were numbered anew; `former` (n_particles): as who they were known before, with the same
    /// ring, or kNone; ascending.
    void renumber(std::span<const ParticleId> former) { scratch_.renumber(former), hulls_.renumber(former); }
    /// Call when edges broke.
    void edges_broke() { scratch_.edges_broke(); }

private:
    struct Neighbours {
        uint64_t a, b;  // body and fragment, which no wake or sleep numbers anew
        double gap;     // at rest, m
    };
    void list_neighbours(const SimulationMesh& rest, const WorkerPool& workers);
    Vec3 collider_motion(const Contact& contact) const;
    void measure_reach(const SimulationMesh& rest, const MovableMotion& motion, double h, const WorkerPool& workers);

    ContactScratch scratch_;
    HullReach hulls_;
    std::vector<Neighbours> neighbours_, former_;  // pairs of one body in contact, now and before; ascending
    std::vector<uint32_t> neighbours_of_;          // place in neighbours_, or kNone (as contacts_)
    std::vector<uint32_t> unknown_;                // those whose gap is still to be measured
    std::vector<Pair> pair_of_unknown_;
    std::vector<double> gap_of_unknown_;
    std::vector<PlacedShape> rigid_bodies_;
    std::vector<MovingShape> colliders_;
    std::vector<Contact> contacts_;
    std::vector<ContactReach> reach_;  // (as contacts_)
};

}  // namespace sunder
