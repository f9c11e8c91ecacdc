// A lattice at rest with loads chosen by the test.
#pragma once

#include "solver/material/fracture.h"
#include "tests/support/lattice_scene.h"

namespace sunder::test {

struct LoadedLattice {
    SimulationMesh rest;
    LiveTopology live;
    GroupShapes shapes;
    std::vector<MovingParticle> particles;
    std::vector<GroupStrain> strains;

    explicit LoadedLattice(const LatticeBody& body) : rest(lattice_mesh(body)) {
        live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
        shapes.reset(rest, live, std::vector<Mat3>(rest.n_particles(), Mat3::Identity()));
        for (const Vec3& x : rest.rest_position) particles.push_back({x, Quat::Identity(), x, Quat::Identity()});
        strains.resize(rest.n_particles());
    }
    std::vector<BrokenEdge> cut(double leading = 0) const {
        return edges_to_cut({rest, live, shapes, particles}, strains, leading, 0.5, WorkerPool(2));
    }
};

}  // namespace sunder::test
