// A bar of irregular Voronoi cells has the stiffness and the contraction of its material, as a lattice has; and as many
// cells as are suggested for an error keep to it.
#include <array>
#include <cmath>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/suggest_pieces.h"
#include "tests/accuracy/bar_cases.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using namespace test;

constexpr double kStretch = 1;  // percent

TriMesh bar_surface() {
    TriMesh box = sunder::testing::make_box(Vec3(0.2, 0.2, 1));
    for (Vec3& x : box.positions) x -= Vec3(0.1, 0.1, 0);
    return box;
}

struct VoronoiBar {
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState state;
    SolverSettings settings = slow_load_settings();

    VoronoiBar(int pieces, SiteKind sites, uint32_t seed, double poisson_ratio) {
        PrefractureSettings cut;
        cut.pieces = pieces, cut.seed = seed, cut.threads = 1, cut.sites.kind = sites;
        const auto fragments = prefracture(bar_surface(), cut, "bar");
        EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
        auto mesh = build_simulation_mesh(*fragments, {});
        EXPECT_TRUE(mesh);
        add_body(scene, mesh.take());
        add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
        add_pin(scene, [](const Vec3& x) { return x.z() > 0.9; });
        material.youngs_modulus = 2 * kShearModulus * (1 + poisson_ratio), material.poisson_ratio = poisson_ratio;
        settings.self_collision = false;
        solver = make_solver(scene);
        state = solver->initial_state({material});
    }
    void frame(Load load, double from, double to) {
        FrameInput in = quiet_input(scene, material);
        in.pins[1] = {head_pose(load, from), head_pose(load, to)};
        advance(*solver, in, settings, state);
    }
    /// In half a second to `amount`, where it is held.
    void load(Load load, double amount, double held_s) {
        for (int f = 0; f < 12; ++f) frame(load, amount * f / 12, amount * (f + 1) / 12);
        for (int f = 0; f < std::lround(24 * held_s); ++f) frame(load, amount, amount);
    }
    /// Momentum along the bar that the head gains when it is let go for a microsecond, over that time, N.
    double force() const {
        constexpr double h = 1e-6;
        FrameState after = state;
        for (Vec3& v : after.velocity) v.setZero();
        for (Vec3& w : after.angular_velocity) w.setZero();
        Material elastic = material;
        elastic.damping_time = 0;
        FrameInput in = quiet_input(scene, elastic, h);
        in.pins[1].active = false;
        SolverSettings once = settings;
        once.substeps = 1, once.damping = 0;
        advance(*solver, in, once, after);
        double force = 0;
        for (uint32_t i : scene.pins[1].particles) force -= scene.rest.mass[i] * after.velocity[i].z() / h;
        return force;
    }
    /// Slope of the displacements over the middle half of the bar, by volume: along it, and across it.
    std::pair<double, double> strain() const {
        double volume = 0, Z = 0, u = 0, ZZ = 0, Zu = 0, XX = 0, Xu = 0;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const Vec3 X = scene.rest.rest_position[i] - Vec3(0, 0, 0.5), moved = state.position[i] - X;
            if (std::abs(X.z()) > 0.25) continue;
            const double V = scene.rest.volume[i];
            volume += V, Z += V * X.z(), u += V * moved.z(), ZZ += V * X.z() * X.z(), Zu += V * X.z() * moved.z();
            XX += V * X.head<2>().squaredNorm(), Xu += V * X.head<2>().dot(moved.head<2>());
        }
        return {(Zu - Z * u / volume) / (ZZ - Z * Z / volume), Xu / XX};
    }
};

struct Case {
    SiteKind sites;
    uint32_t seed;
    double poisson_ratio, tolerance;
};

// Uneven cells do not share a homogeneous stretch quite evenly: what gives way first makes the bar a little softer.
TEST(voronoi_bar, takes_the_force_of_youngs_modulus_and_contracts_by_poissons_ratio) {
    for (const Case& c : {Case{SiteKind::kmeans, 1, 0, 0.02}, Case{SiteKind::kmeans, 2, 0.3, 0.02},
                          Case{SiteKind::poisson, 1, 0, 0.02}, Case{SiteKind::uniform, 1, 0, 0.05}}) {
        VoronoiBar bar(320, c.sites, c.seed, c.poisson_ratio);
        bar.load(Load::stretch, kStretch, 3);
        const auto [along, across] = bar.strain();
        const double ratio = bar.force() / (bar.material.youngs_modulus * 0.04 * along);
        std::printf("%zu cells, nu %.1f: force %.4f of Hooke's, contracts by %.4f of its stretch\n",
                    bar.state.n_particles(), c.poisson_ratio, ratio, -across / along);
        EXPECT_NEAR(ratio, 1, c.tolerance);
        EXPECT_NEAR(-across / along, c.poisson_ratio, 0.02);
    }
}

// Where the reference has what rested at X: trilinear between the centres of its 8 x 8 x 32 free cells.
Vec3 at(const Reference& reference, const Vec3& X) {
    constexpr int n = 8;
    const Vec3 grid = (X + Vec3(0.1, 0.1, -0.1)) / (0.2 / n) - Vec3::Constant(0.5);
    const std::array<int, 3> count = {n, n, 4 * n};
    Vec3 x = Vec3::Zero();
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<int, 3> cell;
        for (int i = 0; i < 3; ++i) {
            const int low = std::clamp(static_cast<int>(std::floor(grid(i))), 0, count[i] - 2), up = corner >> i & 1;
            cell[i] = low + up;
            weight *= up ? grid(i) - low : 1 - (grid(i) - low);
        }
        x += weight * reference.position[static_cast<size_t>((cell[2] * n + cell[1]) * n + cell[0])];
    }
    return x;
}

double error(const VoronoiBar& bar, const Reference& reference) {
    double difference = 0, displacement = 0;
    for (size_t i = 0; i < bar.state.n_particles(); ++i) {
        const Vec3& X = bar.scene.rest.rest_position[i];
        if (X.z() < 0.1 || X.z() > 0.9) continue;
        const Vec3 x = at(reference, X);
        difference += bar.scene.rest.volume[i] * (bar.state.position[i] - x).squaredNorm();
        displacement += bar.scene.rest.volume[i] * (x - X).squaredNorm();
    }
    return std::sqrt(difference / displacement);
}

// Its constants are from lattices, and from a stretched bar of Voronoi cells.
TEST(suggested_pieces, keep_a_twist_and_a_bend_within_the_error) {
    constexpr double kAllowed = 0.05;
    const int pieces = suggest_pieces(bar_surface(), kAllowed);
    for (const auto& [load, poisson_ratio] : {std::pair{Load::twist, 0.3}, std::pair{Load::bend, 0.45}}) {
        VoronoiBar bar(pieces, SiteKind::kmeans, 3, poisson_ratio);
        bar.load(load, reference_amount(load), 3);
        const double found = error(bar, read_reference(load, poisson_ratio, 8));
        std::printf("%s: %d pieces for %.0f %%, error %.1f %%\n", reference_name(load, poisson_ratio).c_str(), pieces,
                    100 * kAllowed, 100 * found);
        EXPECT_LE(found, kAllowed);
        EXPECT_GE(found, kAllowed / 3);  // nor are far too many suggested
    }
}

}  // namespace
}  // namespace sunder
