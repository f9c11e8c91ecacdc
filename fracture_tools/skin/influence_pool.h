// Influences of vertices, put one after the other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>

#include "fracture_tools/skin/skin_weights.h"

namespace sunder {

/// Memory that influences are added to, without being cleared first.
class InfluencePool {
public:
    using Memory = std::shared_ptr<const SkinInfluence[]>;

    explicit InfluencePool(uint32_t capacity)
        : memory_(std::make_shared_for_overwrite<SkinInfluence[]>(capacity + kCopied)), capacity_(capacity) {}

    uint32_t size() const { return size_; }
    Memory memory() const { return memory_; }

    /// Where the next entries go, with room for n: other memory, if there is not enough.
    SkinInfluence* room(uint32_t n) {
        if (size_ + n > capacity_) {
            InfluencePool larger(2 * (size_ + n));
            std::copy(memory_.get(), memory_.get() + size_, larger.memory_.get());
            larger.size_ = size_, std::swap(*this, larger);
        }
        return memory_.get() + size_;
    }
    /// Adds n entries of another pool: so many at a time, for runs are short.
    void add_copies(const SkinInfluence* from, uint32_t n) {
        SkinInfluence* const to = room(n);
        for (uint32_t i = 0; i < n; i += kCopied) std::memcpy(to + i, from + i, kCopied * sizeof(SkinInfluence));
        size_ += n;
    }
    /// Entries that have been written to `room`.
    void add(uint32_t n) { size_ += n; }

private:
    static constexpr uint32_t kCopied = 4;  // at a time; as much memory is behind the last entry

    std::shared_ptr<SkinInfluence[]> memory_;
    uint32_t size_ = 0, capacity_ = 0;
};

}  // namespace sunder
