#include "solver/contacts/solve/contact_batches.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "solver/data/ids.h"

namespace sunder {
namespace {

// Two islands: every contact touches two of the island's things, some of them the first, as rubble does a large piece.
struct Islands {
    static constexpr uint32_t kThings = 40;  // an island
    std::vector<BatchMember> members;
    std::vector<uint32_t> offset = {0};

    explicit Islands(std::vector<size_t> sizes) {
        std::mt19937_64 rng(3);
        for (uint32_t n = 0; n < sizes.size(); ++n) {
            const auto thing = [&] { return n * kThings + static_cast<uint32_t>(rng() % kThings); };
            for (size_t k = 0; k < sizes[n]; ++k) {
                BatchMember m;
                m.kind = k % 7 == 0   ? BatchMember::Kind::left_out
                         : k % 3 == 0 ? BatchMember::Kind::idle
                                      : BatchMember::Kind::pushes;
                m.touches = {thing(), k % 5 == 0 ? n * kThings : kNone, thing(), kNone};
                members.push_back(m);
            }
            offset.push_back(static_cast<uint32_t>(members.size()));
        }
    }
    // The islands one after the other, from the last to the first or from the first to the last.
    ContactBatches batches(bool backwards = false) const {
        const auto n = static_cast<uint32_t>(offset.size() - 1);
        ContactBatches batches;
        batches.open(members.size(), n, kThings * n);
        const auto for_islands = [&](const auto& body) {
            for (uint32_t k = 0; k < n; ++k) body(backwards ? n - 1 - k : k);
        };
        for_islands([&](uint32_t k) {
            batches.form(IslandId(k), std::span(members).subspan(offset[k], offset[k + 1] - offset[k]), offset[k]);
        });
        batches.lay_out();
        for_islands([&](uint32_t k) { batches.place(IslandId(k), offset[k], offset[k + 1]); });
        return batches;
    }
};

TEST(contact_batches, hold_every_contact_once_and_no_two_that_touch_the_same) {
    const Islands in({300, 0, 1, 150});
    const ContactBatches batches = in.batches();
    ASSERT_EQ(batches.offset.size(), in.offset.size());
    std::set<uint32_t> seen;
    for (size_t n = 0; n + 1 < batches.offset.size(); ++n)
        for (uint32_t batch = batches.offset[n]; batch < batches.offset[n + 1]; ++batch) {
            std::set<uint32_t> touched;
            for (uint32_t lane = 8 * batch; lane < 8 * batch + 8; ++lane) {
                const uint32_t k = batches.member[lane];
                if (k == kNone) continue;
                EXPECT_EQ(batches.lane[k], lane);
                EXPECT_TRUE(in.offset[n] <= k && k < in.offset[n + 1]);
                EXPECT_TRUE(seen.insert(k).second);
                std::set<uint32_t> own(in.members[k].touches.begin(), in.members[k].touches.end());
                own.erase(kNone);
                for (uint32_t thing : own) EXPECT_TRUE(touched.insert(thing).second) << "batch " << batch;
            }
            EXPECT_FALSE(touched.empty());
        }
    for (uint32_t k = 0; k < in.members.size(); ++k)
        EXPECT_EQ(seen.contains(k), in.members[k].kind != BatchMember::Kind::left_out);
}

// Passes over those that push only would otherwise visit all.
TEST(contact_batches, idle_contacts_are_kept_apart_from_those_that_push) {
    Islands in({400});
    for (BatchMember& m : in.members) m.touches = {kNone, kNone, kNone, kNone};
    const ContactBatches batches = in.batches();
    size_t mixed = 0;
    for (size_t batch = 0; batch < batches.size(); ++batch) {
        std::set<BatchMember::Kind> kinds;
        for (size_t lane = 8 * batch; lane < 8 * batch + 8; ++lane)
            if (batches.member[lane] != kNone) kinds.insert(in.members[batches.member[lane]].kind);
        mixed += kinds.size() > 1;
    }
    EXPECT_LE(mixed, 1u);
    EXPECT_EQ(batches.size(), (size_t{400} - 58 + 7) / 8);  // full but for the last; every seventh is left out
}

// Threads take islands in any order.
TEST(contact_batches, are_the_same_in_any_order_of_islands) {
    const Islands in({900, 5, 700, 800});
    const ContactBatches forwards = in.batches(), backwards = in.batches(true);
    EXPECT_EQ(forwards.member, backwards.member);
    EXPECT_EQ(forwards.lane, backwards.lane);
    EXPECT_EQ(forwards.offset, backwards.offset);
}

}  // namespace
}  // namespace sunder
