// Scenes of one lattice body, as most solver tests use them.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"
#include "solver/solver.h"

namespace sunder::test {

struct LatticeBody {
    std::array<int, 3> cells = {4, 4, 20};
    double spacing = 0.05;  // m
    int neighbours = 6;
    double density = 1000;  // kg/m3
    Pose pose = {};         // of a lattice whose base centre is the origin
};

inline SimulationMesh lattice_mesh(const LatticeBody& body) {
    LatticeSettings lattice;
    lattice.cells = body.cells;
    for (int i = 0; i < 3; ++i) lattice.size(i) = body.cells[i] * body.spacing;
    lattice.center = Vec3(0, 0, 0.5 * lattice.size.z());
    lattice.neighbours = body.neighbours;
    const auto fragments = make_lattice(lattice, "lattice");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    SimulationMeshSettings settings;
    settings.density = body.density;
    auto mesh = build_simulation_mesh(*fragments, settings);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().text());
    return mesh.take();
}

/// Adds a body to the scene.
inline void add_body(Scene& io_scene, const SimulationMesh& mesh, const Pose& pose = {},
                     const Vec3& velocity = Vec3::Zero()) {
    Body body;
    body.name = "body" + std::to_string(io_scene.bodies.size());
    body.particle_begin = static_cast<uint32_t>(io_scene.rest.n_particles());
    body.edge_begin = static_cast<uint32_t>(io_scene.rest.n_edges());
    append_body(io_scene.rest, mesh, pose);
    body.particle_end = static_cast<uint32_t>(io_scene.rest.n_particles());
    body.edge_end = static_cast<uint32_t>(io_scene.rest.n_edges());
    body.velocity = velocity;
    io_scene.bodies.push_back(body);
}

inline Scene lattice_scene(const LatticeBody& body) {
    Scene scene;
    add_body(scene, lattice_mesh(body), body.pose);
    return scene;
}

/// Holds the particles whose rest position satisfies `region`.
inline void add_pin(Scene& io_scene, const std::function<bool(const Vec3&)>& region) {
    Pin pin;
    pin.name = "pin" + std::to_string(io_scene.pins.size());
    for (uint32_t i = 0; i < io_scene.rest.n_particles(); ++i)
        if (region(io_scene.rest.rest_position[i])) pin.particles.push_back(ParticleId(i));
    io_scene.pins.push_back(pin);
}

/// Input with everything at rest and no gravity; one material for all bodies.
inline FrameInput quiet_input(const Scene& scene, const Material& material, double duration = 1.0 / 24) {
    FrameInput input;
    input.duration = duration;
    input.gravity = Vec3::Zero();
    input.materials.assign(scene.bodies.size(), material);
    input.pins.resize(scene.pins.size());
    input.colliders.resize(scene.colliders.size());
    input.activations.resize(scene.activations.size());
    input.seams.assign(scene.seams.size(), 1.0);
    return input;
}

inline std::unique_ptr<Solver> make_solver(const Scene& scene, int threads = 1) {
    auto solver = Solver::create(scene, threads);
    EXPECT_TRUE(solver) << (solver ? "" : solver.error().text());
    return solver.take();
}

inline StepReport advance(Solver& solver, const FrameInput& input, const SolverSettings& settings,
                          FrameState& io_state) {
    const auto report = solver.advance(input, settings, io_state);
    EXPECT_TRUE(report) << (report ? "" : report.error().text());
    return report ? *report : StepReport();
}

inline size_t count_pieces(const SimulationMesh& rest, const FrameState& state) {
    size_t n = 0;
    for (uint32_t p : connected_pieces(rest, state.edge_intact)) n = std::max<size_t>(n, p + 1);
    return n;
}

inline size_t count_broken(const FrameState& state) {
    return static_cast<size_t>(std::count(state.edge_intact.begin(), state.edge_intact.end(), uint8_t{0}));
}

}  // namespace sunder::test
