// Shots with everything drawn at random: nothing may fail, and what moves may never have more energy than the shot
// began with. This is how fragments at 400 m/s were found: let go by a crack, they kept the push that had carried the
// whole body.
#include <gtest/gtest.h>

#include <functional>
#include <numeric>

#include "tests/stability/random_shot.h"
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Most energy of motion and height, over what there was at the start; edges that broke; and an error, if there was one.
struct Outcome {
    double gained = 0;
    size_t broken = 0;
    bool let_go = false;  // something that was kept
    std::string error;
};
Outcome shoot(const test::Shot& shot) {
    const auto solver = test::make_solver(shot.scene);
    FrameState state = solver->initial_state(shot.materials());
    const FrameInput in = shot.input();
    const auto energy = [&] { return test::energy(solver->scene(), shot.material, in.gravity, state); };
    Outcome outcome;
    if (anything_settles(shot.scene)) {
        const auto settled = solver->settle(in, shot.settings, state);
        if (!settled) return {.error = settled.error().text()};
    }
    const double start = energy().total();
    for (size_t frame = 0; frame < 36; ++frame) {
        const auto report = solver->advance(shot.input(frame), shot.settings, state);
        if (!report) {
            outcome.error = report.error().text();
            break;
        }
        const test::Energy now = energy();
        outcome.gained = std::max(outcome.gained, (now.kinetic() + now.height - start) / start);
    }
    outcome.broken = test::count_broken(state);
    const auto n_kept = [](const FrameState& s) {
        return std::ranges::count_if(s.inactive, [](const Inactivity& i) { return i.what != 0; });
    };
    outcome.let_go = n_kept(state) < n_kept(solver->initial_state(shot.materials()));
    return outcome;
}

// A fault that is known and not mended: what is squashed, soft and unbreakable, gains by fine steps what coarse ones
// take. This test fails when it is; then shot 94 comes back into those below.
constexpr uint64_t kSquashed = 94;

TEST(random_shots, known_fault_what_is_squashed_gains_by_fine_steps) {
    test::Shot shot(kSquashed);
    shot.material.toughness = shot.material.fracture_energy = kNever;
    shot.settings.error_budget = 0, shot.settings.hit_substeps = 1;
    shot.settings.substeps = 500;
    EXPECT_GT(shoot(shot).gained, 0.01);
}

TEST(random_shots, gain_nothing) {
    double most = 0;
    uint64_t worst = 0;
    size_t shots = 0, torn = 0;
    const auto check = [&](uint64_t seed) {
        const Outcome outcome = shoot(test::Shot(seed));
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        // A contact's work is taken along the straight path of the substep; a hundredth covers its error.
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;
        ++shots, torn += outcome.broken > 0;
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    };
    for (uint64_t seed = 0; seed < 100; ++seed)
        if (seed != kSquashed) check(seed);
    for (uint64_t seed : {202, 287, 502, 550, 653, 998, 1693, 2410}) check(seed);  // once gained 0.02 to 5.4
    std::printf("%zu shots, %zu torn; most energy gained: %.4f of the start, shot %d\n", shots, torn, most,
                static_cast<int>(worst));
    EXPECT_GE(torn, shots / 2) << "else this tells little";
}

TEST(random_shots, gain_nothing_with_a_parameter_from_anywhere_in_its_range) {
    double most = 0;
    std::string worst;
    for (uint64_t seed = 0; seed < 100; ++seed) {
        if (seed == kSquashed) continue;
        test::Shot shot(seed);
        const std::string what = "shot " + std::to_string(seed) + ", " + shot.go_far(seed + 1000);
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << what;
        EXPECT_LE(outcome.gained, 0.01) << what;  // as above
        if (outcome.gained > most) most = outcome.gained, worst = what;
    }
    std::printf("most energy gained: %.4f of the start, %s\n", most, worst.c_str());
}

// Pins that stand still do no work. Of the last nine shots six gained 0.08 to 56,000 times their energy when held
// pieces answered pushes as free ones do, two 0.06 and 0.08 when particles' own turns brought contacts together, one
// 0.09 when short substeps worked off as much overlap as long ones.
TEST(random_shots, gain_nothing_where_pins_hold) {
    double most = 0;
    uint64_t worst = 0;
    std::vector<uint64_t> seeds(50);
    std::iota(seeds.begin(), seeds.end(), 0);
    seeds.insert(seeds.end(), {104, 116, 131, 266, 292, 365, 547, 626, 1255});
    for (uint64_t seed : seeds) {
        test::Shot shot(seed);
        shot.hold(seed + 2000);
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    }
    std::printf("most energy gained: %.4f of the start, shot %d\n", most, static_cast<int>(worst));
}

// What was let go of a motion has what that gave it, and no more.
TEST(random_shots, gain_nothing_once_a_source_lets_go) {
    double most = 0;
    uint64_t worst = 0;
    for (uint64_t seed = 0; seed < 30; ++seed) {
        test::Shot shot(seed);
        shot.follow(seed + 4000);
        const auto solver = test::make_solver(shot.scene);
        FrameState state = solver->initial_state(shot.materials());
        double start = 0, gained = 0;
        for (size_t frame = 0; frame < 30; ++frame) {
            const auto report = solver->advance(shot.input(frame), shot.settings, state);
            ASSERT_TRUE(report) << "shot " << seed << ": " << report.error().text();
            const test::Energy now = test::energy(solver->scene(), shot.material, shot.input().gravity, state);
            if (frame == test::Shot::kLetGo) start = now.total();
            if (frame > test::Shot::kLetGo) gained = std::max(gained, (now.kinetic() + now.height - start) / start);
        }
        for (ParticleId i(0); i < shot.scene.bodies[0].particle_end; ++i)
            EXPECT_NE(state.inactive[i].followed, HUGE_VAL) << "shot " << seed;
        EXPECT_LE(gained, 0.01) << "shot " << seed;  // as above
        if (gained > most) most = gained, worst = seed;
    }
    std::printf("most energy gained: %.4f of the moment it was let go, shot %d\n", most, static_cast<int>(worst));
}

// Nor do hinges that stand still. Every other body is a panel.
TEST(random_shots, gain_nothing_on_hinges) {
    double most = 0;
    uint64_t worst = 0;
    for (uint64_t seed = 0; seed < 30; ++seed) {
        test::Shot shot(seed);
        if (seed % 2 == 1) shot.beat_flat(seed + 3000);
        shot.hold(seed + 2000);
        shot.scene.pins[0].turns_freely = true;
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;  // as above
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    }
    std::printf("most energy gained: %.4f of the start, shot %d\n", most, static_cast<int>(worst));
}

// What settled lies or hangs under its weight; shots begin with what that stored.
TEST(random_shots, what_settled_gains_nothing) {
    double most = 0;
    uint64_t worst = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        test::Shot shot(seed);
        if (seed % 3 == 2) shot.beat_flat(seed + 3000);
        if (seed % 3 != 1) shot.hold(seed + 2000);  // others fall to the floor first
        shot.scene.bodies[0].settles = true;
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;  // as above
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    }
    std::printf("most energy gained: %.4f of the start, shot %d\n", most, static_cast<int>(worst));
}

// What is held does no work, nor does letting it go; what is glued breaks later.
TEST(random_shots, what_is_kept_until_something_lets_it_go_gains_nothing) {
    double most = 0;
    uint64_t worst = 0;
    size_t let_go = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        test::Shot shot(seed);
        if (seed % 4 == 3) shot.beat_flat(seed + 3000);
        shot.keep(seed + 4000);
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;  // as above
        if (outcome.gained > most) most = outcome.gained, worst = seed;
        let_go += outcome.let_go;
    }
    std::printf("%zu let go; most energy gained: %.4f of the start, shot %d\n", let_go, most, static_cast<int>(worst));
    EXPECT_GT(let_go, 12u) << "else this tells little";
}

// 24 shots, each changed so.
void expect_no_gain(const std::function<void(test::Shot&, uint64_t seed)>& change) {
    double most = 0;
    uint64_t worst = 0;
    size_t torn = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        test::Shot shot(seed);
        change(shot, seed);
        const Outcome outcome = shoot(shot);
        EXPECT_EQ(outcome.error, "") << "shot " << seed;
        EXPECT_LE(outcome.gained, 0.01) << "shot " << seed;  // as above
        torn += outcome.broken > 0;
        if (outcome.gained > most) most = outcome.gained, worst = seed;
    }
    std::printf("%zu torn; most energy gained: %.4f of the start, shot %d\n", torn, most, static_cast<int>(worst));
    EXPECT_GE(torn, 6u) << "else this tells little";
}

TEST(random_shots, panels_gain_nothing) {
    expect_no_gain([](test::Shot& shot, uint64_t seed) { shot.beat_flat(seed + 3000); });
}

TEST(random_shots, bodies_that_bend_by_their_curvature_gain_nothing) {
    expect_no_gain([](test::Shot& shot, uint64_t) { shot.material.slender = 2; });
}

// Forces of any kind and strength anywhere: energy comes from them, and nothing else goes wrong.
TEST(random_shots, nothing_fails_in_forces_that_differ_from_place_to_place) {
    size_t driven = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        test::Shot shot(seed);
        shot.blow(seed + 4000);
        driven += !shot.blasts.empty() || !shot.forces.empty();
        EXPECT_EQ(shoot(shot).error, "") << "shot " << seed;
    }
    EXPECT_GE(driven, 20u) << "else this tells little";
}

// What deforms drives without a bound until it stands; from there it does no work.
TEST(random_shots, nothing_fails_where_colliders_and_pins_deform_nor_gains_once_they_stand) {
    double most = 0;
    uint64_t worst = 0;
    size_t torn = 0;
    for (uint64_t seed = 0; seed < 30; ++seed) {
        test::Shot shot(seed);
        if (seed % 4 == 3) shot.beat_flat(seed + 3000);
        shot.deform(seed + 4000);
        const auto solver = test::make_solver(shot.scene);
        FrameState state = solver->initial_state(shot.materials());
        double start = 0, gained = 0;
        for (size_t frame = 0; frame < 30; ++frame) {
            const auto report = solver->advance(shot.input(frame), shot.settings, state);
            ASSERT_TRUE(report) << "shot " << seed << ": " << report.error().text();
            const test::Energy now = test::energy(solver->scene(), shot.material, shot.input().gravity, state);
            if (frame == test::Shot::kLetGo) start = now.total();
            if (frame > test::Shot::kLetGo) gained = std::max(gained, (now.kinetic() + now.height - start) / start);
        }
        torn += test::count_broken(state) > 0;
        EXPECT_LE(gained, 0.01) << "shot " << seed;  // as above
        if (gained > most) most = gained, worst = seed;
    }
    std::printf("%zu torn; most energy gained: %.4f of the moment they stood, shot %d\n", torn, most,
                static_cast<int>(worst));
    EXPECT_GE(torn, 8u) << "else this tells little";
}

// A stiff rabbit in needles lands on the floor and vibrates. Bounces by what the needles turned by, and a fifth of
// their overlap worked off in each of many short substeps, drove it to 0.08 and 0.15 more than it had.
TEST(random_shots, what_vibrates_on_the_floor_gains_nothing_by_short_substeps) {
    for (const int substeps : {64, 256, 512}) {
        test::Shot shot(653);
        shot.settings.substeps = substeps, shot.settings.hit_substeps = 1;
        EXPECT_LE(shoot(shot).gained, 1e-3) << substeps << " substeps";
    }
}

// A soft body hangs on pins and folds over itself. What its particles turned by closed their contacts, which push
// centres and turn nothing: they drove it like cams, to half as much energy again.
TEST(random_shots, what_hangs_and_touches_itself_gains_nothing) {
    for (const int substeps : {6, 16, 64}) {
        test::Shot shot(1255);
        shot.hold(3255);
        shot.material.toughness = 10, shot.material.restitution = 0, shot.settings.substeps = substeps;
        EXPECT_LE(shoot(shot).gained, 1e-3) << substeps << " substeps";
    }
}

}  // namespace
}  // namespace sunder
