// Strong ids: who wants an edge cannot be given a particle. Arrays are plain std::vector, and an id is a number
// wherever one is read.
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <type_traits>

namespace sunder {

/// Stands for no particle, edge, slot, vertex, ... wherever a number may be missing.
constexpr uint32_t kNone = 0xffffffffu;

/// Whether one kind of thing is another kind, too, of the same number.
template <class Tag, class Other>
constexpr bool kIsA = std::is_same_v<Tag, Other>;

/// The number of a thing of one kind, or none. Made of a number only where it is said, and of no id of another kind.
template <class Tag>
struct Id {
    uint32_t value = kNone;

    constexpr Id() = default;
    template <std::integral Number>
    constexpr explicit Id(Number number) : value(static_cast<uint32_t>(number)) {}
    // Version 14 of clang-format does not know `requires`.
    // clang-format off
    template <class Other>
        requires(kIsA<Other, Tag>)
    constexpr Id(Id<Other> other) : value(other.value) {}
    // clang-format on

    static constexpr Id none() { return Id(); }
    constexpr bool is_none() const { return value == kNone; }
    constexpr size_t index() const { return value; }
    constexpr operator uint32_t() const { return value; }
    constexpr Id& operator++() { return ++value, *this; }
    constexpr bool operator==(const Id&) const = default;
    constexpr auto operator<=>(const Id&) const = default;
};

// Version 14 of clang-format does not know `requires`.
// clang-format off
template <class Tag, class Other>
    requires(!kIsA<Tag, Other> && !kIsA<Other, Tag>)
bool operator==(Id<Tag>, Id<Other>) = delete;
template <class Tag, class Other>
    requires(!kIsA<Tag, Other> && !kIsA<Other, Tag>)
std::strong_ordering operator<=>(Id<Tag>, Id<Other>) = delete;
// clang-format on

/// What a function takes for an id where its callers count: the id, or a loop's number, and no id of another kind.
template <class Tag>
class Index {
public:
    template <std::integral Number>
    constexpr Index(Number number) : number_(static_cast<size_t>(number)) {}
    // Version 14 of clang-format does not know `requires`.
    // clang-format off
    template <class Other>
        requires(kIsA<Other, Tag>)
    constexpr Index(Id<Other> id) : number_(id.value) {}
    // clang-format on

    constexpr operator size_t() const { return number_; }

private:
    size_t number_;
};

using FragmentId = Id<struct FragmentTag>;
using ParticleId = Id<struct ParticleTag>;  // of the scene; a group has that of its centre
using EdgeId = Id<struct EdgeTag>;
using PieceId = Id<struct PieceTag>;      // what hangs together, then rigid bodies
using MovableId = Id<struct MovableTag>;  // particles, then rigid bodies
using ContactId = Id<struct ContactTag>;
using IslandId = Id<struct IslandTag>;  // of contacts

template <>
inline constexpr bool kIsA<ParticleTag, MovableTag> = true;

using ParticleIndex = Index<ParticleTag>;
using PieceIndex = Index<PieceTag>;
using MovableIndex = Index<MovableTag>;

/// The numbers of ids, for those who know no ids: kernels, and what sorts anything.
template <class Tag>
std::span<const uint32_t> numbers(std::span<const Id<Tag>> ids) {
    static_assert(sizeof(Id<Tag>) == sizeof(uint32_t) && std::is_standard_layout_v<Id<Tag>>);
    return {reinterpret_cast<const uint32_t*>(ids.data()), ids.size()};
}

}  // namespace sunder

template <class Tag>
struct std::hash<sunder::Id<Tag>> {
    size_t operator()(const sunder::Id<Tag>& id) const noexcept { return std::hash<uint32_t>()(id.value); }
};
