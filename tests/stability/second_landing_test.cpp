// A ball splits on a floor, and its pieces land a second time: they go on along the cracks that they have, and do not
// crumble by what faded in the first hit or by the stiffness that their groups got back.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "fracture_tools/fragments/prefracture.h"
#include "solver/presets.h"
#include "solver/scene/scales.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

constexpr double kStiffness = 1e8, kDensity = 2000, kSpeed = 10;  // Pa, kg/m3, m/s
constexpr double kLoad = 8;                                       // v / (c tau); the ball breaks from 6.1 on
constexpr double kLarge = 0.02;                                   // of the ball's mass

struct Broken {
    std::vector<PieceId> piece;  // of particles
    std::vector<double> mass;    // of pieces, over that of the ball
    std::vector<size_t> count;   // of pieces, fragments

    Broken(const SimulationMesh& rest, const FrameState& state) : piece(connected_pieces(rest, state.edge_intact)) {
        const double all = std::accumulate(rest.mass.begin(), rest.mass.end(), 0.0);
        mass.resize(test::count_pieces(rest, state)), count.resize(mass.size());
        for (size_t i = 0; i < piece.size(); ++i) mass[piece[i]] += rest.mass[i] / all, ++count[piece[i]];
    }
};

class SplitBall {
public:
    explicit SplitBall(uint32_t seed) {
        PrefractureSettings cut;
        cut.pieces = 300, cut.seed = seed, cut.threads = 1;
        const auto fragments = prefracture(test::ball(0.5, 4), cut, "ball");
        EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
        SimulationMeshSettings mesh_settings;
        mesh_settings.density = kDensity;
        const SimulationMesh mesh = build_simulation_mesh(*fragments, mesh_settings).take();
        Scene scene;
        test::add_body(scene, mesh, {Vec3(0, 0, 0.52), Quat::Identity()}, Vec3(0, 0, -kSpeed));
        scene.colliders.push_back({"floor", {ShapeKind::plane}});
        material_.youngs_modulus = kStiffness, material_.poisson_ratio = 0.2;
        material_.toughness = kSpeed / (std::sqrt(kStiffness / kDensity) * kLoad);
        material_.damping_time = automatic_damping_time(mesh, kStiffness);
        material_.fracture_energy = kStiffness * material_.toughness * material_.toughness * 0.25 / 2;  // `auto`
        const Preset& preset = *find_preset("final");
        settings_.substeps = preset.substeps, settings_.iterations = preset.iterations;
        settings_.hit_substeps = preset.hit_substeps, settings_.sleeping = false;
        solver_ = test::make_solver(scene);
        state_ = solver_->initial_state({material_});
        advance(4, 9.81, state_);
    }
    const SimulationMesh& rest() const { return solver_->scene().rest; }
    const FrameState& state() const { return state_; }

    /// Pieces far apart, close above the floor; what rings dies away.
    void take_apart() {
        const Broken broken(rest(), state_);
        const size_t n = broken.mass.size(), side = static_cast<size_t>(std::ceil(std::sqrt(double(n))));
        std::vector<Vec3> low(n, Vec3::Constant(kNever)), high(n, Vec3::Constant(-kNever));
        for (size_t i = 0; i < state_.n_particles(); ++i) {
            const Vec3 radius = Vec3::Constant(rest().radii[i].maxCoeff());
            low[broken.piece[i]] = low[broken.piece[i]].cwiseMin(state_.position[i] - radius);
            high[broken.piece[i]] = high[broken.piece[i]].cwiseMax(state_.position[i] + radius);
        }
        for (size_t i = 0; i < state_.n_particles(); ++i) {
            const size_t p = broken.piece[i];
            const Vec3 middle = 0.5 * (low[p] + high[p]);
            state_.position[i] +=
                Vec3(3.0 * double(p % side) - middle.x(), 3.0 * double(p / side) - middle.y(), 0.01 - low[p].z());
        }
        state_.contacts.clear();
        drop(0, state_);
        advance(3, 0, state_);
    }
    FrameState landed_again(FrameState state, double speed) {
        drop(speed, state);
        advance(6, 9.81, state);
        return state;
    }
    /// As if what was not parted had never been loaded.
    FrameState rested() const {
        FrameState state = state_;
        for (size_t e = 0; e < state.edge_damage.size(); ++e)
            if (state.edge_intact[e]) state.edge_damage[e] = 0, state.edge_hold[e] = 1;
        std::ranges::fill(state.stiffness_factor, 1.0);
        return state;
    }

private:
    static void drop(double speed, FrameState& io_state) {
        std::ranges::fill(io_state.velocity, Vec3(0, 0, -speed));
        std::ranges::fill(io_state.angular_velocity, Vec3::Zero());
    }
    void advance(int frames, double g, FrameState& io_state) {
        FrameInput in = test::quiet_input(solver_->scene(), material_);
        in.gravity = Vec3(0, 0, -g);
        for (int frame = 0; frame < frames; ++frame) test::advance(*solver_, in, settings_, io_state);
    }

    Material material_;
    SolverSettings settings_;
    std::unique_ptr<Solver> solver_;
    FrameState state_;
};

// Of the mass that was in large pieces.
struct Left {
    double loose = 0, large = 0;  // in single fragments, in large pieces still
    size_t pieces = 0;            // of all
};
Left left(const SimulationMesh& rest, const Broken& before, const FrameState& after) {
    const Broken now(rest, after);
    Left left{.pieces = now.mass.size()};
    double all = 0;
    for (size_t i = 0; i < now.piece.size(); ++i) {
        if (before.mass[before.piece[i]] < kLarge) continue;
        all += rest.mass[i];
        if (now.count[now.piece[i]] == 1) left.loose += rest.mass[i];
        if (now.mass[now.piece[i]] >= kLarge) left.large += rest.mass[i];
    }
    left.loose /= all, left.large /= all;
    return left;
}

// 3 m/s is 2.4 toughnesses, where a sound ball does not break. Of fifty fragments one at most comes loose, in the mean
// of shots, and a tenth of the mass at most leaves large pieces.
TEST(second_landing, splits_large_pieces_and_does_not_crumble_them) {
    constexpr uint32_t kShots = 3;
    constexpr std::array kSpeeds = {2.0, 3.0};
    std::array<Left, kSpeeds.size()> mean, mean_if_rested;
    for (uint32_t seed = 0; seed < kShots; ++seed) {
        SplitBall ball(seed);
        const Broken first(ball.rest(), ball.state());
        ball.take_apart();
        EXPECT_LE(test::count_pieces(ball.rest(), ball.state()), first.mass.size() + 3) << "nothing touches it";
        for (size_t i = 0; i < kSpeeds.size(); ++i) {
            const Left again = left(ball.rest(), first, ball.landed_again(ball.state(), kSpeeds[i]));
            const Left rested = left(ball.rest(), first, ball.landed_again(ball.rested(), kSpeeds[i]));
            mean[i].loose += again.loose / kShots, mean[i].large += again.large / kShots;
            mean_if_rested[i].loose += rested.loose / kShots;
            std::printf("cut %u, %.0f m/s: %zu pieces, then %zu; of large ones %.3f loose, %.2f large still\n", seed,
                        kSpeeds[i], first.mass.size(), again.pieces, again.loose, again.large);
        }
    }
    for (size_t i = 0; i < kSpeeds.size(); ++i) {
        EXPECT_LT(mean[i].loose, 0.02) << kSpeeds[i];
        EXPECT_GT(mean[i].large, 0.9) << kSpeeds[i];
        EXPECT_NEAR(mean[i].loose, mean_if_rested[i].loose, 0.01) << kSpeeds[i];
    }
}

}  // namespace
}  // namespace sunder
