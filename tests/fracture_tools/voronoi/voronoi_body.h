// A mesh cut along Voronoi cells, as tests of the deformer see it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/skin/visual_mesh.h"

namespace sunder::testing {

/// At rest, all edges intact to begin with.
struct VoronoiBody {
    std::shared_ptr<const FragmentSet> set;
    SimulationMesh rest;
    std::vector<Vec3> position;
    std::vector<Quat> orientation;
    std::vector<Mat3> plastic;
    std::vector<uint8_t> intact;

    VoronoiBody(const TriMesh& mesh, int pieces, PrefractureSettings settings = {}) {
        settings.pieces = pieces;
        Result<FragmentSet> cut = prefracture(mesh, settings, "mesh");
        EXPECT_TRUE(cut) << (cut ? "" : cut.error().text());
        set = std::make_shared<const FragmentSet>(cut ? cut.take() : FragmentSet());
        Result<SimulationMesh> built = build_simulation_mesh(*set, {});
        EXPECT_TRUE(built);
        if (built) rest = built.take();
        position = rest.rest_position, orientation = rest.rest_orientation;
        plastic.assign(rest.n_particles(), Mat3::Identity());
        intact.assign(rest.n_edges(), 1);
    }

    void break_share(double share, uint32_t seed) {
        std::mt19937 random(seed);
        for (uint8_t& e : intact) e = random() / 4294967296.0 >= share;
    }

    VisualMesh frame(VisualTopology topology = VisualTopology::compact) const {
        VisualMeshBuilder builder(set, rest, {}, topology);
        Result<VisualMesh> mesh = builder.build({position, orientation, plastic, intact});
        EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().text());
        return mesh ? mesh.take() : VisualMesh();
    }
};

}  // namespace sunder::testing
