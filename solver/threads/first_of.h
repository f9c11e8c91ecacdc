// The first of many that threads look through together.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace sunder {

/// The least number that any thread gave.
class FirstOf {
public:
    void add(size_t i) {
        for (size_t now = first_; i < now && !first_.compare_exchange_weak(now, i);) {
        }
    }
    size_t get() const { return first_; }

private:
    std::atomic<size_t> first_{SIZE_MAX};
};

}  // namespace sunder
