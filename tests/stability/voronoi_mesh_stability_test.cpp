// Meshes as artists cut them: Voronoi cells of a rabbit in slabs, columns, crumbs and pieces of like size, pulled and
// twisted.
#include <gtest/gtest.h>

#include <array>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

enum class Cut { even, uneven, needles, pancakes };

// Sites of a cut: a grid of columns along z, or slabs across it; for the others what the cutter chooses.
std::vector<Vec3> sites_of(Cut cut) {
    std::vector<Vec3> sites;
    if (cut == Cut::needles)
        for (double x = -0.35; x < 0.4; x += 0.07)
            for (double y = -0.47; y < 0.5; y += 0.07) sites.push_back({x + 0.01 * y, y - 0.01 * x, 0.5});
    if (cut == Cut::pancakes)
        for (double z = 0.01; z < 1; z += 0.025) sites.push_back({0.1 * z, 0.05 * z, z});
    return sites;
}

SimulationMesh cut_bunny(Cut cut) {
    const auto bunny = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    EXPECT_TRUE(bunny);
    PrefractureSettings settings;
    settings.pieces = 200, settings.seed = 5, settings.threads = 1;
    settings.sites.points = sites_of(cut);
    settings.sites.kind = cut == Cut::even     ? SiteKind::kmeans
                          : cut == Cut::uneven ? SiteKind::uniform
                                               : SiteKind::points;
    settings.least_piece = cut == Cut::uneven ? 0 : 0.05;  // crumbs stay
    const auto fragments = prefracture(*bunny, settings, "bunny");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    auto mesh = build_simulation_mesh(*fragments, {});
    EXPECT_TRUE(mesh);
    return mesh.take();
}

double largest_strain(const FrameState& s) { return *std::ranges::max_element(s.strain); }

class VoronoiBunny : public testing::TestWithParam<Cut> {
protected:
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState state;
    SolverSettings settings;

    VoronoiBunny() {
        test::add_body(scene, cut_bunny(GetParam()));
        const double low = lowest() + 0.15, high = highest() - 0.15;
        test::add_pin(scene, [&](const Vec3& x) { return x.z() < low; });
        test::add_pin(scene, [&](const Vec3& x) { return x.z() > high; });
        material.youngs_modulus = 1e6;
        settings.damping = 2;
        settings.self_collision = false;  // what the elastic body does by itself
        solver = test::make_solver(scene);
        state = solver->initial_state({material});
    }
    double lowest() const {
        double z = 1e9;
        for (const Vec3& x : scene.rest.rest_position) z = std::min(z, x.z());
        return z;
    }
    double highest() const {
        double z = -1e9;
        for (const Vec3& x : scene.rest.rest_position) z = std::max(z, x.z());
        return z;
    }
    void describe() const {
        const SimulationMesh& rest = solver->scene().rest;
        uint32_t least = ~0u, most = 0;
        double smallest = 1e9, mean = 0, slimmest = 1;
        for (size_t i = 0; i < rest.n_particles(); ++i) {
            const uint32_t ring = rest.group_offset[i + 1] - rest.group_offset[i] - 1;
            least = std::min(least, ring), most = std::max(most, ring);
            smallest = std::min(smallest, rest.volume[i]), mean += rest.volume[i] / double(rest.n_particles());
            slimmest = std::min(slimmest, rest.radii[i].minCoeff() / rest.radii[i].maxCoeff());
        }
        std::printf("%zu pieces, rings of %u to %u, smallest %.1e of the mean volume, slimmest 1:%.0f\n",
                    rest.n_particles(), least, most, smallest / mean, 1 / slimmest);
    }
    static Pose pose(double share) {
        return {Vec3(0, 0, 0.05 * share), Quat(Eigen::AngleAxisd(0.5 * share, Vec3::UnitZ()))};
    }
    void frame(double from, double to, bool held) {
        FrameInput in = test::quiet_input(scene, material);
        in.pins[1] = {pose(from), pose(to), held};
        test::advance(*solver, in, settings, state);
    }
    double energy() const {
        const test::Energy e = test::energy(solver->scene(), material, Vec3::Zero(), state);
        return e.kinetic() + e.elastic;
    }
};

TEST_P(VoronoiBunny, left_alone_it_stays_as_it_was_cut) {
    for (int f = 0; f < 12; ++f) frame(0, 0, false);
    for (size_t i = 0; i < state.n_particles(); ++i)
        EXPECT_LE((state.position[i] - scene.rest.rest_position[i]).norm(), 1e-10);
    EXPECT_LE(largest_strain(state), 1e-9);
}

TEST_P(VoronoiBunny, pulled_and_twisted_it_springs_back_and_gains_nothing) {
    describe();
    for (int f = 0; f < 24; ++f) frame(f / 24.0, (f + 1) / 24.0, true);
    for (int f = 0; f < 24; ++f) frame(1, 1, true);
    const double strained = largest_strain(state), stored = energy();
    EXPECT_GT(stored, 0);
    EXPECT_LT(strained, 1);
    settings.damping = 5;
    double highest = 0;
    for (int f = 0; f < 96; ++f) {
        frame(0, 0, false);
        highest = std::max(highest, energy());
    }
    double apart = 0;
    for (size_t i = 0; i < state.n_particles(); ++i)
        apart = std::max(apart, (state.position[i] - scene.rest.rest_position[i]).norm());
    std::printf("strain %.3f when held, %.1e at the end; energy at most %.4f of what was stored; %.1e m off\n",
                strained, largest_strain(state), highest / stored, apart);
    EXPECT_LE(highest, stored * (1 + 1e-6));
    EXPECT_LE(largest_strain(state), 1e-3);
    EXPECT_LE(apart, 1e-3);  // the rabbit is a metre tall
}

std::string name_of(const testing::TestParamInfo<Cut>& info) {
    constexpr std::array<const char*, 4> names = {"even", "uneven", "needles", "pancakes"};
    return names[static_cast<size_t>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(cuts, VoronoiBunny, testing::Values(Cut::even, Cut::uneven, Cut::needles, Cut::pancakes),
                         name_of);

}  // namespace
}  // namespace sunder
