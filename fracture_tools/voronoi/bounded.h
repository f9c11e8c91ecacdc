// Numbers that know how far they may be off: the filter before exact arithmetic.
#pragma once

#include <array>
#include <cmath>

namespace sunder {

/// A real number within `error` of `value` (running error analysis; Higham 2002, section 3.3). Unlike intervals with
/// directed rounding it needs no change of the processor's rounding mode.
struct Bounded {
    double value = 0, error = 0;

    bool is_positive() const { return value > error; }
    bool is_negative() const { return -value > error; }
    bool has_sign() const { return std::abs(value) > error; }
};

namespace bounded_detail {
constexpr double kUnit = 0x1p-53;         // relative error of one operation
constexpr double kRoundUp = 1 + 0x1p-50;  // makes up for the rounding of the bounds themselves
constexpr double kUnderflow = 0x1p-1060;  // absolute error of a product too small for full precision
}  // namespace bounded_detail

inline Bounded operator-(const Bounded& a) { return {-a.value, a.error}; }

inline Bounded operator+(const Bounded& a, const Bounded& b) {
    const double v = a.value + b.value;
    return {v, bounded_detail::kRoundUp * (a.error + b.error + bounded_detail::kUnit * std::abs(v))};
}

inline Bounded operator-(const Bounded& a, const Bounded& b) { return a + -b; }

inline Bounded operator*(const Bounded& a, const Bounded& b) {
    const double v = a.value * b.value;
    return {v, bounded_detail::kRoundUp * (std::abs(a.value) * b.error + (std::abs(b.value) + b.error) * a.error +
                                           bounded_detail::kUnit * std::abs(v)) +
                   bounded_detail::kUnderflow};
}

/// The error is infinite where the divisor may be 0.
inline Bounded operator/(const Bounded& a, const Bounded& b) {
    const double v = a.value / b.value, least = std::abs(b.value) - b.error;
    if (!(least > 0)) return {v, HUGE_VAL};
    return {v, bounded_detail::kRoundUp *
                       ((a.error + std::abs(v) * b.error) / least + 2 * bounded_detail::kUnit * std::abs(v)) +
                   bounded_detail::kUnderflow};
}

using Bounded3 = std::array<Bounded, 3>;

inline Bounded dot(const Bounded3& a, const Bounded3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline Bounded3 cross(const Bounded3& a, const Bounded3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace sunder
