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

TEST(piece_pairs, parts_of_a_piece_that_breaks_find_what_a_fresh_search_finds) {
    Crumbling f;
    ContactScratch kept;
    size_t total = 0;
    while (!f.edges.empty()) {
        for (size_t i = 0; i < f.velocity.size(); ++i) f.velocity[i] += 0.3 * f.vector();
        f.expect_as_a_fresh_search(kept, total);
        f.move();
        f.break_some(25);
        kept.edges_broke();
    }
    EXPECT_GT(total, 1000u);
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
    std::vector<uint32_t> former;
    Flight rest = f;
    rest.particles.clear(), rest.velocity.clear(), rest.angular_velocity.clear(), rest.piece.clear();
    for (uint32_t i = 0; i < f.particles.size(); ++i) {
        const uint32_t p = f.piece[i];
        if (p == 1 || (p >= Flight::kPieces && p % 2 == 0)) continue;
        former.push_back(i);
        rest.particles.push_back(f.particles[i]);
        rest.velocity.push_back(f.velocity[i]), rest.angular_velocity.push_back(f.angular_velocity[i]);
        rest.piece.push_back(p == 0 ? 0 : p - 1);
    }
    rest.slot.resize(former.size()), rest.slot_end.resize(former.size());
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
