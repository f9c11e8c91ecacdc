// Strong ids: an edge cannot index a particle. Arrays are plain std::vector, indexed by id.index().
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace sunder {

/// Stands for no particle, edge, slot, vertex, ... wherever a number may be missing.
constexpr uint32_t kNone = 0xffffffffu;

template <class Tag>
struct Id {
    uint32_t value = kNone;

    constexpr Id() = default;
    constexpr explicit Id(size_t index) : value(static_cast<uint32_t>(index)) {}
    static constexpr Id none() { return Id(); }
    constexpr bool is_none() const { return value == kNone; }
    constexpr size_t index() const { return value; }
    constexpr auto operator<=>(const Id&) const = default;
};

using FragmentId = Id<struct FragmentTag>;

}  // namespace sunder

template <class Tag>
struct std::hash<sunder::Id<Tag>> {
    size_t operator()(const sunder::Id<Tag>& id) const noexcept { return std::hash<uint32_t>()(id.value); }
};
