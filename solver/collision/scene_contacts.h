// The contacts of a scene at the start of a substep: detection, and what the materials say about each.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact_response.h"
#include "solver/collision/detection.h"
#include "solver/live_topology.h"
#include "solver/scene.h"

namespace sunder {

/// Finds and describes contacts; keeps scratch and the broad phase's memory between substeps (neither changes the result).
class SceneContacts {
public:
    /// `begin` and `end` place the substep in the frame, for driven colliders. Velocities hold what the particles would
    /// do alone (forces included).
    void find(const Scene& scene, const FrameInput& input, bool self_collision, const LiveTopology& live, std::span<const uint8_t> held,
              std::span<const Vec3> position, std::span<const Quat> rotation, std::span<const Vec3> velocity, double h, double begin, double end,
              std::vector<ActiveContact>& out);

    void topology_changed() { topology_changed_ = true; }

private:
    ContactScratch scratch_;
    std::vector<Ellipsoid> ellipsoids_;
    std::vector<Contact> contacts_;
    bool topology_changed_ = true;
};

}  // namespace sunder
