#include "solver/collision/piece_pairs.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/flights.h"

namespace sunder {
namespace {

TEST(piece_pairs, knowing_the_pieces_changes_no_contact) {
    const WorkerPool workers(3);
    for (const double spin : {0.0, 10.0, 60.0}) {
        Flight f;
        ContactScratch kept;
        std::vector<Contact> with, without;
        size_t total = 0;
        for (int step = 0; step < 12; ++step) {
            f.set_velocities(spin, 2);
            DetectionInput in = f.input();
            ContactScratch fresh;
            find_contacts(in, fresh, without);
            in.piece = f.piece, in.workers = &workers;
            find_contacts(in, kept, with);
            expect_same(with, without);
            total += with.size();
            f.move();
        }
        EXPECT_GT(total, 12 * 100u);
    }
}

TEST(piece_pairs, a_body_that_falls_and_spins_as_a_whole_finds_its_pairs_once) {
    Flight f;
    ContactScratch kept;
    std::vector<Contact> contacts;
    const uint32_t p = 0;
    for (int step = 0; step < 40; ++step) {
        const Quat turn = rotation_of(Vec3(0.02, 0.1, 0.05));
        const Vec3 center(0, 0, -0.25 * step);
        for (uint32_t i = 0; i < f.particles.size(); ++i) {
            if (f.piece[i] != p) continue;
            const Vec3 to = center + turn * (f.particles[i].center - center) + Vec3(0, 0, -0.25);
            f.velocity[i] = (to - f.particles[i].center) / f.h;
            f.angular_velocity[i] = Vec3::Zero();
        }
        DetectionInput in = f.input();
        in.piece = f.piece;
        find_contacts(in, kept, contacts);
        for (uint32_t i = 0; i < f.particles.size(); ++i)
            if (f.piece[i] == p) f.particles[i].center += f.h * f.velocity[i];
    }
    EXPECT_EQ(kept.within.n_rebuilds(), 1u * Flight::kPieces);
}

TEST(piece_pairs, few_that_leave_their_boxes_are_looked_for_alone) {
    Flight f;
    ContactScratch kept;
    std::vector<Contact> with, without;
    size_t total = 0;
    for (uint32_t step = 0; step < 30; ++step) {
        f.set_velocities(0, 0);
        for (uint32_t i = 0; i < f.particles.size(); ++i)
            if (i / Flight::kPieces % 10 == step % 10) f.velocity[i] += 4 * f.own[i];  // four of each piece
        DetectionInput in = f.input();
        ContactScratch fresh;
        find_contacts(in, fresh, without);
        in.piece = f.piece;
        find_contacts(in, kept, with);
        expect_same(with, without);
        total += with.size();
        f.move();
    }
    EXPECT_GT(total, 30 * 100u);
    EXPECT_EQ(kept.within.n_rebuilds(), 1u * Flight::kPieces);
}

// Particles of a block that breaks by so many edges a step, each on its way: contacts as a fresh search finds them.
void expect_parts_find_all(Crumbling f, size_t edges_a_step, int most_steps) {
    ContactScratch kept;
    size_t total = 0;
    for (int step = 0; step < most_steps && !f.edges.empty(); ++step) {
        for (Vec3& v : f.velocity) v += 0.3 * f.vector();
        f.expect_as_a_fresh_search(kept, total);
        f.move();
        f.break_some(edges_a_step);
        kept.edges_broke();
    }
    EXPECT_GT(total, 1000u);
}

TEST(piece_pairs, parts_of_a_piece_that_breaks_find_what_a_fresh_search_finds) {
    expect_parts_find_all(Crumbling(), 25, 1000);
}

// So large that all threads work on it together.
TEST(piece_pairs, parts_of_a_large_piece_find_what_a_fresh_search_finds) {
    expect_parts_find_all(Crumbling(9), 150, 12);
}

TEST(piece_pairs, threads_and_instruction_sets_find_the_same_pairs_in_the_same_order) {
    struct Search {
        int threads;
        const char* instructions;  // null: the best
        PiecePairs pairs;
    } searches[] = {{1, nullptr, {}}, {2, nullptr, {}}, {5, nullptr, {}}, {1, "avx2", {}}, {1, "portable", {}}};
    Crumbling f(9);
    PairFilter filter;
    filter.n_particles = static_cast<uint32_t>(f.particles.size());
    size_t total = 0;
    for (uint32_t step = 0; step < 12; ++step) {
        std::vector<Vec3> position, velocity(f.velocity);
        for (const Ellipsoid& e : f.particles) position.push_back(e.center);
        // All leave their boxes, few, none.
        for (uint32_t i = 0; i < velocity.size(); ++i)
            if (step % 6 == 5 || (step % 2 == 1 && i % 60 == step)) velocity[i] += 12 * f.own[i];
        const std::vector<double> radius(position.size(), 0.25);
        filter.rings = f.input().rings;
        std::vector<Pair> first;
        for (Search& s : searches) {
            if (s.instructions) setenv("SUNDER_INSTRUCTIONS", s.instructions, 1);
            const auto found =
                s.pairs.update({position, velocity, radius, f.h}, f.piece, filter, WorkerPool(s.threads));
            unsetenv("SUNDER_INSTRUCTIONS");
            if (&s == searches) first.assign(found.begin(), found.end());
            EXPECT_TRUE(std::ranges::equal(found, first)) << s.threads << " threads, step " << step;
        }
        total += first.size();
        f.move();
        f.break_some(20);
        for (Search& s : searches) s.pairs.edges_broke();
    }
    EXPECT_GT(total, 12 * 1000u);
    EXPECT_GT(searches[0].pairs.n_rebuilds(), 1u);
    EXPECT_LT(searches[0].pairs.n_rebuilds(), 6u);
}

TEST(piece_pairs, a_piece_that_breaks_leaves_its_pairs_to_its_parts) {
    Crumbling f;
    ContactScratch kept;
    size_t total = 0;
    for (int step = 0; step < 15; ++step) {
        f.expect_as_a_fresh_search(kept, total);
        f.move();
        f.break_some(30);
        kept.edges_broke();
    }
    EXPECT_GT(total, 1000u);
    EXPECT_EQ(kept.within.n_rebuilds(), 1u);
}

TEST(piece_pairs, pieces_keep_their_pairs_when_others_are_left_out_of_the_count) {
    Flight f;
    f.set_velocities(0, 0);
    ContactScratch kept;
    std::vector<Contact> contacts, fresh_contacts;
    DetectionInput in = f.input();
    in.piece = f.piece;
    find_contacts(in, kept, contacts);
    ASSERT_EQ(kept.within.n_rebuilds(), 1u * Flight::kPieces);

    // Piece 1 and every other single one leave.
    std::vector<ParticleId> former;
    Flight rest = f;
    rest.particles.clear(), rest.velocity.clear(), rest.angular_velocity.clear(), rest.piece.clear();
    for (ParticleId i(0); i < f.particles.size(); ++i) {
        const PieceId p = f.piece[i];
        if (p == 1 || (p >= Flight::kPieces && p % 2 == 0)) continue;
        former.push_back(i);
        rest.particles.push_back(f.particles[i]);
        rest.velocity.push_back(f.velocity[i]), rest.angular_velocity.push_back(f.angular_velocity[i]);
        rest.piece.push_back(PieceId(p == 0 ? 0 : p - 1));
    }
    rest.slot.resize(former.size()), rest.slot_begin.resize(former.size()), rest.slot_end.resize(former.size());
    kept.renumber(former);
    in = rest.input();
    ContactScratch fresh;
    find_contacts(in, fresh, fresh_contacts);
    in.piece = rest.piece;
    find_contacts(in, kept, contacts);
    expect_same(contacts, fresh_contacts);
    EXPECT_GT(contacts.size(), 100u);
    EXPECT_EQ(kept.within.n_rebuilds(), 1u * Flight::kPieces);
}

}  // namespace
}  // namespace sunder
