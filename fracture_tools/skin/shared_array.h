// Arrays of a frame that many may hold: what did not change from one frame to the next is the same memory.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace sunder {

/// A finished array; a copy holds the same memory.
template <class T>
class SharedArray {
public:
    using value_type = T;
    using const_iterator = typename std::vector<T>::const_iterator;

    SharedArray() = default;
    SharedArray(std::vector<T> values) : values_(std::make_shared<const std::vector<T>>(std::move(values))) {}
    SharedArray(std::initializer_list<T> values) : SharedArray(std::vector<T>(values)) {}
    explicit SharedArray(std::shared_ptr<const std::vector<T>> values) : values_(std::move(values)) {}

    const std::vector<T>& vector() const {
        static const std::vector<T> none;
        return values_ ? *values_ : none;
    }
    operator const std::vector<T>&() const { return vector(); }
    operator std::span<const T>() const { return vector(); }

    size_t size() const { return vector().size(); }
    bool empty() const { return vector().empty(); }
    const T* data() const { return vector().data(); }
    const T& operator[](size_t i) const { return (*values_)[i]; }
    const_iterator begin() const { return vector().begin(); }
    const_iterator end() const { return vector().end(); }
    const T& back() const { return vector().back(); }

    /// Of the contents.
    bool operator==(const SharedArray& other) const { return values_ == other.values_ || vector() == other.vector(); }

private:
    std::shared_ptr<const std::vector<T>> values_;
};

/// Objects that are made anew each frame, in memory that no reader holds any more: fresh memory costs more than what is
/// written into it, since each page is cleared first. Kept: what is read, and one more.
template <class T>
class Recycler {
public:
    struct Slot {
        std::shared_ptr<T> object;
        uint64_t written = 0;  // whatever its user counts frames by
        size_t finished = 0;   // entries at the front that its user knows to be as they should; 0 in new memory
    };

    /// An object that nobody reads, with what it held when it was written last; or a new one.
    Slot& take() {
        Slot free;
        std::erase_if(slots_, [&](Slot& s) {
            if (s.object.use_count() > 1) return false;
            if (!free.object || s.written > free.written) std::swap(free, s);
            return true;
        });
        std::atomic_thread_fence(std::memory_order_acquire);  // its last reader, in whatever thread, has done
        if (!free.object) free.object = std::make_shared<T>();
        return slots_.emplace_back(std::move(free));
    }

private:
    std::vector<Slot> slots_;
};

template <class T>
class ArrayRecycler {
public:
    using Slot = typename Recycler<std::vector<T>>::Slot;

    /// An array of `n` entries to write; another length than it had sets `written` to 0. `most`: as long as it will
    /// ever be (a body that tears goes on growing); what nobody writes to takes no memory.
    Slot& take(size_t n, size_t most = 0) {
        Slot& slot = recycler_.take();
        std::vector<T>& values = *slot.object;
        if (values.size() == n) return slot;
        slot.written = 0, slot.finished = std::min(slot.finished, n);
        if (values.capacity() < n) {
            values = {}, slot.finished = 0;
            values.reserve(std::max(n + n / 8, most));
        }
        values.resize(n);
        return slot;
    }

    static SharedArray<T> share(const Slot& slot) {
        return SharedArray<T>(std::shared_ptr<const std::vector<T>>(slot.object));
    }

private:
    Recycler<std::vector<T>> recycler_;
};

}  // namespace sunder
