#include "solver/data/ids.h"

#include <gtest/gtest.h>

#include <vector>

#include "solver/scene/live_topology.h"

namespace sunder {
namespace {

template <class From, class To>
constexpr bool kBecomes = std::is_convertible_v<From, To>;
template <class From, class To>
constexpr bool kCanBeMade = std::is_constructible_v<To, From>;
template <class A, class B>
constexpr bool kCompare = requires(A a, B b) {
    a == b;
}
|| requires(A a, B b) { a < b; };

// A number wherever one is read, made of one only where it is said.
static_assert(kBecomes<ParticleId, uint32_t> && kBecomes<ParticleId, size_t>);
static_assert(kCanBeMade<uint32_t, ParticleId> && kCanBeMade<size_t, ParticleId>);
static_assert(!kBecomes<uint32_t, ParticleId> && !kBecomes<size_t, ParticleId>);
static_assert(kCompare<ParticleId, ParticleId> && kCompare<ParticleId, uint32_t>);

// No kind is another.
template <class Id, class... Others>
constexpr bool kIsApart = ((!kCanBeMade<Others, Id> && !kBecomes<Others, Id> && !std::is_assignable_v<Id&, Others> &&
                            !kCompare<Id, Others> && !kCompare<Others, Id>)&&...);
static_assert(kIsApart<ParticleId, EdgeId, PieceId, ContactId, IslandId, FragmentId>);
static_assert(kIsApart<EdgeId, ParticleId, PieceId, ContactId, IslandId, MovableId, FragmentId>);
static_assert(kIsApart<PieceId, ParticleId, EdgeId, ContactId, IslandId, MovableId, FragmentId>);
static_assert(kIsApart<ContactId, ParticleId, EdgeId, PieceId, IslandId, MovableId, FragmentId>);
static_assert(kIsApart<IslandId, ParticleId, EdgeId, PieceId, ContactId, MovableId, FragmentId>);

// But that particles are movables, of the same number; a movable need not be a particle.
static_assert(kBecomes<ParticleId, MovableId> && kCompare<ParticleId, MovableId>);
static_assert(!kBecomes<MovableId, ParticleId> && !kCanBeMade<MovableId, ParticleId>);

// What is asked for a thing takes loops' numbers, but no id of another kind.
static_assert(kBecomes<size_t, ParticleIndex> && kBecomes<int, ParticleIndex> && kBecomes<ParticleId, ParticleIndex>);
static_assert(!kBecomes<EdgeId, ParticleIndex> && !kBecomes<MovableId, ParticleIndex>);
static_assert(kBecomes<ParticleId, MovableIndex> && !kBecomes<PieceId, MovableIndex>);
template <class Id>
constexpr bool kHasPiece = requires(const LiveTopology& live, Id id) {
    live.piece(id);
};
static_assert(kHasPiece<ParticleId> && !kHasPiece<EdgeId> && !kHasPiece<PieceId>);
template <class Id>
constexpr bool kCanBreak = requires(LiveTopology& live, const SimulationMesh& rest, const std::vector<Id>& broken) {
    live.remove_edges(rest, broken);
};
static_assert(kCanBreak<EdgeId> && !kCanBreak<ParticleId> && !kCanBreak<uint32_t>);

// They cost nothing.
static_assert(sizeof(EdgeId) == 4 && std::is_trivially_copyable_v<EdgeId> && std::is_standard_layout_v<EdgeId>);

TEST(ids, are_numbers_in_memory) {
    const std::vector<EdgeId> edges = {EdgeId(3), EdgeId::none(), EdgeId(0)};
    const std::span<const uint32_t> same = numbers(std::span<const EdgeId>(edges));
    ASSERT_EQ(same.size(), 3u);
    EXPECT_EQ(same[0], 3u);
    EXPECT_EQ(same[1], kNone);
    EXPECT_EQ(same[2], 0u);
    EXPECT_TRUE(edges[1].is_none() && EdgeId().is_none() && !edges[2].is_none());
    EXPECT_TRUE(EdgeId(1) < EdgeId(2) && EdgeId(2) < EdgeId::none());
}

}  // namespace
}  // namespace sunder
