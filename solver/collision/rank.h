// Medians of numbers.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <span>

namespace sunder {

/// The number that comes `rank`th in ascending order. -0 comes before 0, and what is no number has its place too: of
/// numbers that only seem equal it is not up to a standard library which is found.
inline double number_of_rank(std::span<double> io_numbers, size_t rank) {
    const auto at = io_numbers.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(io_numbers.begin(), at, io_numbers.end(),
                     [](double a, double b) { return std::strong_order(a, b) < 0; });
    return *at;
}

}  // namespace sunder
