#include "solver/collision/pairs_between_pieces.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/flights.h"

namespace sunder {
namespace {

// A heap that hardly moves, as seen by who falls with it.
struct Heap : Crumbling {
    void jostle(double speed) {
        for (Vec3& v : velocity) v = Vec3(0, 0, -3) + speed * vector();
    }
};

TEST(pairs_between_pieces, what_hardly_moves_is_looked_for_once) {
    Heap f;
    f.break_some(450);
    ContactScratch kept;
    size_t total = 0;
    for (int step = 0; step < 40; ++step) {
        f.jostle(0.3);
        f.expect_as_a_fresh_search(kept, total);
        f.move();
        f.break_some(2);
        kept.edges_broke();
    }
    EXPECT_GT(total, 40 * 300u);
    EXPECT_EQ(kept.between.n_rebuilds(), 1u);
}

TEST(pairs_between_pieces, what_leaves_at_once_is_looked_for_at_once) {
    Heap f;
    f.break_some(450);
    ContactScratch kept;
    size_t total = 0;
    for (int step = 0; step < 20; ++step) {
        f.jostle(step % 7 < 3 ? 8 : 0.3);
        f.expect_as_a_fresh_search(kept, total);
        f.move();
    }
    EXPECT_GT(total, 500u);
    EXPECT_GT(kept.between.n_rebuilds(), 3u);
}

TEST(pairs_between_pieces, who_was_numbered_anew_keeps_its_pairs) {
    Heap whole;
    whole.edges.clear();
    whole.join();
    ContactScratch kept;
    std::vector<uint32_t> here;
    size_t total = 0;
    for (uint32_t step = 0; step < 24; ++step) {
        // Some leave for three steps, and others come back.
        std::vector<ParticleId> former;
        std::vector<uint32_t> now;
        for (uint32_t i = 0; i < whole.particles.size(); ++i)
            if (step < 3 || i % 16 != (step / 3) % 16) now.push_back(i);
        for (const uint32_t i : now) {
            const auto was = std::ranges::lower_bound(here, i);
            const bool was_here = was != here.end() && *was == i;
            former.push_back(was_here ? ParticleId(was - here.begin()) : ParticleId::none());
        }
        whole.jostle(0.3);
        Heap f = whole;
        f.particles.clear(), f.velocity.clear();
        for (const uint32_t i : now) f.particles.push_back(whole.particles[i]), f.velocity.push_back(whole.velocity[i]);
        f.angular_velocity.resize(now.size());
        f.join();
        if (step > 0 && here != now) kept.renumber(former);
        here = now;
        f.expect_as_a_fresh_search(kept, total);
        whole.move();
    }
    EXPECT_GT(total, 24 * 300u);
    EXPECT_EQ(kept.between.n_rebuilds(), 1u);
}

}  // namespace
}  // namespace sunder
