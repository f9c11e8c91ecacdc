// Shots with everything drawn at random: rabbits in needles, slabs, crumbs and pieces of like size fall on the floor,
// on one another and under weights, of any stiffness, toughness and size, at any step. Nothing may fail, and what moves
// may never have more energy than the shot began with. This is how fragments at 400 m/s were found: let go by a crack,
// they kept the push that had carried the whole body.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "fracture_tools/mesh_io.h"
#include "fracture_tools/prefracture.h"
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

enum Cut { pieces, crumbs, needles, coarse, slabs, kCuts };

const SimulationMesh& rabbit(Cut cut) {
    static std::map<Cut, SimulationMesh> known;
    if (const auto found = known.find(cut); found != known.end()) return found->second;
    PrefractureSettings settings;
    settings.pieces = cut == coarse ? 40 : 100, settings.seed = 5 + static_cast<uint32_t>(cut), settings.threads = 1;
    std::vector<Vec3>& sites = settings.sites.points;
    if (cut == needles)
        for (double x = -0.35; x < 0.4; x += 0.1)
            for (double y = -0.47; y < 0.5; y += 0.1) sites.push_back({x + 0.01 * y, y - 0.01 * x, 0.5});
    if (cut == slabs)
        for (double z = 0.01; z < 1; z += 0.04) sites.push_back({0.1 * z, 0.05 * z, z});
    settings.sites.kind = !sites.empty() ? SiteKind::points : cut == crumbs ? SiteKind::uniform : SiteKind::kmeans;
    settings.least_piece = cut == crumbs ? 0 : 0.05;
    const auto fragments = prefracture(*read_mesh(SUNDER_TEST_DATA "/bunny.obj"), settings, "bunny");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    return known[cut] = build_simulation_mesh(*fragments, {}).take();
}

// `density`: kg/m3, instead of 1000.
SimulationMesh scaled(SimulationMesh mesh, double size, double density) {
    const double area = size * size, volume = area * size;
    for (Vec3& x : mesh.rest_position) x *= size;
    for (Vec3& r : mesh.radii) r *= size;
    for (Vec3f& x : mesh.hull_point) x *= static_cast<float>(size);
    for (double& v : mesh.volume) v *= volume;
    for (double& m : mesh.mass) m *= volume * density / 1000;
    for (Edge& e : mesh.edges) e.area *= area;
    return mesh;
}

class Draw {
public:
    explicit Draw(uint64_t seed) : rng_(seed) {}
    double uniform(double low, double high) { return low + (high - low) * 0x1p-53 * static_cast<double>(rng_() >> 11); }
    double logarithmic(double low, double high) { return low * std::pow(high / low, uniform(0, 1)); }
    bool one_in(int n) { return rng_() % static_cast<uint64_t>(n) == 0; }
    template <class T>
    T of(std::initializer_list<T> some) {
        return some.begin()[rng_() % some.size()];
    }
    Vec3 vector(double most) {
        const double x = uniform(-most, most), y = uniform(-most, most);
        return {x, y, uniform(-most, most)};
    }
    Quat turn() { return Quat(Eigen::AngleAxisd(uniform(0, 3), vector(1).normalized())); }
    Cut cut() { return static_cast<Cut>(rng_() % kCuts); }

private:
    std::mt19937_64 rng_;
};

struct Shot {
    Scene scene;
    Material material;
    SolverSettings settings;
    double gravity = 9.81;  // m/s2

    explicit Shot(uint64_t seed) {
        Draw draw(seed);
        material.youngs_modulus = draw.logarithmic(1e4, 1e9);
        if (draw.one_in(2)) material.poisson_ratio = draw.uniform(0, 0.45);
        material.damping_time = draw.one_in(3) ? 0 : draw.logarithmic(1e-4, 0.1);
        if (draw.one_in(2)) material.yield = draw.logarithmic(0.003, 0.2);
        material.flow_rate = draw.logarithmic(1, 1000), material.hardening = draw.uniform(0, 5);
        material.toughness = draw.logarithmic(0.001, 0.5);
        if (draw.one_in(5)) material.compressive_toughness = draw.logarithmic(0.01, 0.5);
        material.friction = draw.one_in(5) ? 0 : draw.uniform(0, 1.5);
        if (draw.one_in(4)) material.restitution = draw.uniform(0, 0.8);
        settings.substeps = draw.of({2, 3, 4, 6, 8, 12, 16}), settings.iterations = draw.of({2, 2, 2, 1, 3, 5});
        if (draw.one_in(8)) settings.method = Method::jacobi;
        if (draw.one_in(8)) settings.error_budget = draw.logarithmic(0.005, 0.2);
        if (draw.one_in(4)) gravity = draw.logarithmic(0.5, 50);

        const double size = draw.one_in(3) ? draw.logarithmic(0.1, 10) : 1, density = draw.logarithmic(100, 10000);
        const double speed = std::sqrt(size);  // m/s, that of falling by a twentieth of it
        scene.colliders.resize(1);
        scene.colliders[0].shape.kind = ShapeKind::plane;
        scene.colliders[0].friction = material.friction;
        for (const double height : {1.3, 3.8}) {
            if (height > 2 && draw.one_in(2)) continue;
            const Vec3 place = size * Vec3(draw.uniform(0, 0.3), draw.uniform(0, 0.3), height);
            test::add_body(scene, scaled(rabbit(draw.cut()), size, density), {place, draw.turn()});
            scene.bodies.back().velocity = speed * (draw.vector(1) - draw.logarithmic(0.1, 20) * Vec3::UnitZ());
            scene.bodies.back().angular_velocity = draw.vector(draw.logarithmic(0.1, 5)) / speed;
        }
        if (draw.one_in(2)) return;
        RigidBody weight;
        weight.name = "weight";
        if (draw.one_in(2)) weight.shape.kind = ShapeKind::box, weight.shape.half_extents = size * Vec3(0.3, 0.2, 0.1);
        weight.shape.radius = 0.2 * size;
        for (const double m : scene.rest.mass) weight.mass += m;  // to 1 kg: small bodies meet heavy ones
        weight.mass *= draw.logarithmic(0.01, 20);
        weight.pose.position = size * Vec3(draw.uniform(0, 0.2), draw.uniform(0, 0.2), 5.6);
        weight.velocity = -speed * draw.logarithmic(1, 30) * Vec3::UnitZ();
        weight.friction = material.friction;
        scene.rigid_bodies.push_back(weight);
    }
};

// Most energy of motion and height, over what there was at the start; edges that broke; and an error, if there was one.
struct Outcome {
    double gained = 0;
    size_t broken = 0;
    std::string error;
};
Outcome shoot(uint64_t seed) {
    const Shot shot(seed);
    const auto solver = test::make_solver(shot.scene);
    const std::vector<Material> materials(shot.scene.bodies.size(), shot.material);
    FrameState state = solver->initial_state(materials);
    FrameInput in = test::quiet_input(shot.scene, shot.material);
    in.materials = materials, in.gravity = Vec3(0, 0, -shot.gravity);
    const auto energy = [&] { return test::energy(solver->scene(), shot.material, in.gravity, state); };
    const double start = energy().total();
    Outcome outcome;
    for (int frame = 0; frame < 36; ++frame) {
        const auto report = solver->advance(in, shot.settings, state);
        if (!report) {
            outcome.error = report.error().text();
            break;
        }
        const test::Energy now = energy();
        outcome.gained = std::max(outcome.gained, (now.kinetic() + now.height - start) / start);
    }
    outcome.broken = test::count_broken(state);
    return outcome;
}

TEST(random_shots, gain_nothing) {
    double most = 0;
    uint64_t worst = 0;
    size_t shots = 0, torn = 0;
    const auto check = [&](uint64_t seed) {
        const Outcome outcome = shoot(seed);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        // A contact's work is taken along the straight path of the substep; a hundredth covers its error.
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;
        ++shots, torn += outcome.broken > 0;
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    };
    for (uint64_t seed = 0; seed < 100; ++seed) check(seed);
    for (uint64_t seed : {202, 287, 502, 550, 998, 1693, 2410}) check(seed);  // once gained 0.03 to 5.4
    std::printf("%zu shots, %zu torn; most energy gained: %.4f of the start, shot %d\n", shots, torn, most,
                static_cast<int>(worst));
    EXPECT_GE(torn, shots / 2) << "else this tells little";
}

}  // namespace
}  // namespace sunder
