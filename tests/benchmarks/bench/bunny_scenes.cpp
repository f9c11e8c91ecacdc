#include <random>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "solver/scene/motion.h"
#include "tests/benchmarks/bench/scene_parts.h"
#include "tests/support/finer_mesh.h"

namespace sunder::bench {
namespace {

std::shared_ptr<const FragmentSet> bunny_pieces(int refinements, int pieces, uint32_t seed) {
    PrefractureSettings settings;
    settings.pieces = pieces, settings.seed = seed;
    return std::make_shared<FragmentSet>(
        must(prefracture(finer_mesh(must(read_mesh(SUNDER_TEST_DATA "/bunny.obj")), refinements), settings, "bunny")));
}

}  // namespace

BenchScene two_bunnies() {
    BenchScene s;
    const auto pieces = bunny_pieces(0, 300, 7);
    Material brittle, ductile;
    brittle.youngs_modulus = ductile.youngs_modulus = 5e5;
    brittle.toughness = 0.07;
    ductile.poisson_ratio = 0.3, ductile.yield = 0.01, ductile.flow_rate = 300, ductile.toughness = 0.16;
    for (const bool left : {true, false}) {
        const double x = left ? -1 : 1;
        s.skins.push_back({pieces, {Vec3(x, 0, 0), Quat::Identity()}});
        add_body(s, simulation_mesh(*pieces), s.skins.back().pose, Vec3::Zero(), Vec3::Zero(),
                 left ? brittle : ductile);
        add_weight(s, Vec3(x + 0.05, 0.12, 1.7), 800, Vec3(0, 0, -8));
    }
    add_floor(s);
    return s;
}

// As large as the largest scene of the paper: 12 bodies, 2.7K particles, two substeps, about 850 pieces at the end.
BenchScene paper_scene() {
    BenchScene s;
    Material clay;
    clay.youngs_modulus = 2e5, clay.yield = 0.03, clay.toughness = 0.0316;
    std::mt19937_64 rng(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<std::shared_ptr<const FragmentSet>> cuts;
    for (uint32_t k = 0; k < 4; ++k) cuts.push_back(bunny_pieces(1, 223, k));
    for (int k = 0; k < 12; ++k) {
        const Vec3 place(1.3 * (k % 4 - 1.5), 1.3 * (k / 4 - 1), 0.2 + 0.3 * (k % 3));
        const Vec3 turn(uniform(rng), uniform(rng), uniform(rng));
        s.skins.push_back({cuts[k % 4], {place + Vec3(0, 0, 0.7), rotation_of(2 * turn)}});
        add_body(s, simulation_mesh(*cuts[k % 4]), s.skins.back().pose, Vec3(0, 0, -9 - (k % 3)), turn, clay);
    }
    add_floor(s);
    s.settings.substeps = 2;
    s.settings.crack_passes = s.settings.hit_substeps = 1;  // as the paper: steps are equal, and break once
    s.frames = 96;
    return s;
}

// What `paper` ends as: the fragments of four bunnies, a third of their size apart, fall and come to lie.
BenchScene rubble() {
    BenchScene s;
    for (uint32_t k = 0; k < 4; ++k) {
        SimulationMesh loose = simulation_mesh(*bunny_pieces(0, 223, k));
        loose.edges.clear();
        for (Vec3& x : loose.rest_position) x *= 1.3;
        const Vec3 place(1.3 * (k % 2 - 0.5), 1.3 * (k / 2 - 0.5), 0.3);
        add_body(s, loose, {place, Quat::Identity()}, Vec3(0, 0, -2), Vec3::Zero(), Material());
    }
    add_floor(s);
    s.settings.substeps = 2, s.settings.sleeping = false;
    s.frames = 96;
    return s;
}

}  // namespace sunder::bench
