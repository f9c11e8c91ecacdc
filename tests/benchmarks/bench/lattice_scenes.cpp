#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"
#include "solver/scene/motion.h"
#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {
namespace {

SimulationMesh lattice(std::array<int, 3> cells, double spacing) {
    LatticeSettings settings;
    settings.cells = cells;
    settings.size = spacing * Vec3(cells[0], cells[1], cells[2]);
    settings.center = Vec3(0, 0, 0.5 * settings.size.z());
    return simulation_mesh(must(make_lattice(settings, "lattice")));
}

}  // namespace

SimulationMesh simulation_mesh(const FragmentSet& fragments) {
    return must(build_simulation_mesh(fragments, SimulationMeshSettings()));
}

void add_body(BenchScene& io, const SimulationMesh& mesh, const Pose& pose, const Vec3& velocity,
              const Vec3& angular_velocity, const Material& material) {
    Scene& scene = io.scene;
    Body body;
    body.name = "body" + std::to_string(scene.bodies.size());
    body.particle_begin = static_cast<uint32_t>(scene.rest.n_particles());
    body.edge_begin = static_cast<uint32_t>(scene.rest.n_edges());
    append_body(scene.rest, mesh, pose);
    body.particle_end = static_cast<uint32_t>(scene.rest.n_particles());
    body.edge_end = static_cast<uint32_t>(scene.rest.n_edges());
    body.velocity = velocity, body.angular_velocity = angular_velocity;
    scene.bodies.push_back(body);
    io.input.materials.push_back(material);
}

void add_floor(BenchScene& io) {
    io.scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.6, 0.0});
    io.input.colliders.push_back({});
}

void add_weight(BenchScene& io, const Vec3& position, double mass, const Vec3& velocity) {
    RigidBody weight;
    weight.name = "weight" + std::to_string(io.scene.rigid_bodies.size());
    weight.shape.radius = 0.3;
    weight.mass = mass;
    weight.pose.position = position;
    weight.velocity = velocity;
    io.scene.rigid_bodies.push_back(weight);
}

// One end held, the other turned by 90 degrees a second and drawn along.
BenchScene twisted_bar(int across, int along) {
    BenchScene s;
    const double spacing = 1.0 / along;
    Material rubber;
    rubber.youngs_modulus = 2e5;
    add_body(s, lattice({across, across, along}, spacing), {}, Vec3::Zero(), Vec3::Zero(), rubber);
    for (const bool top : {false, true}) {
        Pin pin{top ? "head" : "foot", {}};
        for (uint32_t i = 0; i < s.scene.rest.n_particles(); ++i) {
            const double z = s.scene.rest.rest_position[i].z();
            if (top ? z > 1 - 1.5 * spacing : z < 1.5 * spacing) pin.particles.push_back(ParticleId(i));
        }
        s.scene.pins.push_back(pin);
        s.input.pins.push_back({});
    }
    s.input.gravity.setZero();
    s.drive = [](int frame, FrameInput& io_input) {
        const auto turned = [](int f) {
            return Pose{Vec3::Zero(), rotation_of(Vec3(0, 0, f / 24.0 * std::numbers::pi / 2))};
        };
        io_input.pins[1] = {turned(frame), turned(frame + 1)};
    };
    return s;
}

// A plate one particle thick between two held edges, hit by a weight: it dents and tears.
BenchScene hit_plate() {
    BenchScene s;
    Material lead;
    lead.youngs_modulus = 2e6, lead.yield = 0.02, lead.toughness = 0.1;
    add_body(s, lattice({20, 15, 1}, 0.05), {Vec3(0, 0, 1), Quat::Identity()}, Vec3::Zero(), Vec3::Zero(), lead);
    Pin rim{"rim", {}};
    for (uint32_t i = 0; i < s.scene.rest.n_particles(); ++i)
        if (std::abs(s.scene.rest.rest_position[i].x()) > 0.46) rim.particles.push_back(ParticleId(i));
    s.scene.pins.push_back(rim);
    s.input.pins.push_back({});
    add_floor(s);
    add_weight(s, Vec3(0.03, 0.02, 1.45), 60, Vec3(0, 0, -6));
    return s;
}

// A sheet of 600 fragments, 1.5 x 1 x 0.005 m and askew, falls from one edge that is held. `curvature`: or it is
// blocks.
BenchScene hanging_sheet(bool curvature, double yield) {
    BenchScene s;
    Material rubber;
    rubber.youngs_modulus = 1e7, rubber.poisson_ratio = 0.3, rubber.yield = yield, rubber.curvature = curvature;
    LatticeSettings cells;
    cells.cells = {30, 20, 1}, cells.size = Vec3(1.5, 1, 0.005);
    const Pose askew{Vec3::Zero(), rotation_of(Vec3(0.3, -0.8, 0.4))};
    add_body(s, simulation_mesh(must(make_lattice(cells, "sheet"))), askew, Vec3::Zero(), Vec3::Zero(), rubber);
    Pin edge{"edge", {}};
    for (uint32_t i = 0; i < s.scene.rest.n_particles(); ++i)
        if (askew.inverse_apply(s.scene.rest.rest_position[i]).x() < -0.7) edge.particles.push_back(ParticleId(i));
    s.scene.pins.push_back(edge);
    s.input.pins.push_back({});
    s.input.gravity = askew.orientation * s.input.gravity;
    return s;
}

// A thousand loose fragments after they fell on a heap.
BenchScene pile() {
    BenchScene s;
    const SimulationMesh cell = lattice({1, 1, 1}, 0.06);
    std::mt19937_64 rng(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int k = 0; k < 1000; ++k) {
        const Vec3 place(0.08 * (k % 8 - 3.5), 0.08 * (k / 8 % 8 - 3.5), 0.08 * (k / 64) + 0.02);
        const Vec3 turn(uniform(rng), uniform(rng), uniform(rng));
        SimulationMesh one = cell;
        one.radii[0] = one.radii[0].cwiseProduct(Vec3::Constant(0.8) + 0.2 * turn);
        add_body(s, one, {place, rotation_of(turn)}, Vec3::Zero(), Vec3::Zero(), Material());
    }
    add_floor(s);
    s.warm_up = 72;
    return s;
}

// 95 of a hundred bodies have come to rest on the floor, every other of them in loose pieces; five are turned by pins.
BenchScene resting(bool sleeping) {
    BenchScene s;
    s.settings.sleeping = sleeping;
    Material clay;
    clay.youngs_modulus = 2e5;
    const SimulationMesh whole = lattice({3, 3, 3}, 0.1);
    SimulationMesh loose = whole;
    loose.edges.clear();
    for (int k = 0; k < 100; ++k) {
        const bool turned = k % 20 == 0;
        const Vec3 place(0.6 * (k % 10 - 4.5), 0.6 * (k / 10 - 4.5), turned ? 0.5 : 0);
        const uint32_t first = static_cast<uint32_t>(s.scene.rest.n_particles());
        add_body(s, k % 2 ? loose : whole, {place, Quat::Identity()}, Vec3::Zero(), Vec3::Zero(), clay);
        if (!turned) continue;
        s.scene.pins.push_back({"pin" + std::to_string(k), {ParticleId(first + 13)}});
        s.input.pins.push_back({});
        s.input.pins.back().pivot = s.scene.rest.rest_position[first + 13];
    }
    add_floor(s);
    s.drive = [](int frame, FrameInput& io_input) {
        for (DrivenPose& pin : io_input.pins) {
            const auto turned = [&](int f) {
                const Quat turn = rotation_of(Vec3(0, 0, f / 24.0 * std::numbers::pi / 2));
                return Pose{pin.pivot - turn * pin.pivot, turn};
            };
            pin.begin = turned(frame), pin.end = turned(frame + 1);
        }
    };
    s.warm_up = 48, s.frames = 24;
    return s;
}

// Spinning cubes of a thousand particles, far from one another: cost a particle must not grow with their number.
BenchScene cubes(int count) {
    BenchScene s;
    const SimulationMesh cube = lattice({10, 10, 10}, 0.1);
    std::mt19937_64 rng(6);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int across = static_cast<int>(std::ceil(std::cbrt(count)));
    for (int k = 0; k < count; ++k)
        add_body(s, cube, {2.5 * Vec3(k % across, k / across % across, k / across / across), Quat::Identity()},
                 Vec3::Zero(), 3 * Vec3(uniform(rng), uniform(rng), uniform(rng)), Material());
    s.settings.substeps = 2;
    s.warm_up = 1, s.frames = 5;
    return s;
}

}  // namespace sunder::bench
