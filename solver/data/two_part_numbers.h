// Numbers of about 106 bits as sums of two doubles, as far as functions need them (Dekker 1971, Knuth's TAOCP 4.2.2).
// None of it is right where a*b+c is contracted or sums are reordered.
#pragma once

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>

namespace sunder::math {

static_assert(FLT_EVAL_METHOD == 0, "sums and products of doubles have to be rounded to doubles");

struct TwoPart {
    double high, low;  // of low at most half of the last bit of high, but for what is said to be rough
};

/// Exact.
inline TwoPart sum(double a, double b) {
    const double s = a + b, of_b = s - a;
    return {s, (a - (s - of_b)) + (b - of_b)};
}
/// Exact if |a| >= |b|, or a is 0.
inline TwoPart sum_by_size(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
}

/// The upper 26 bits: products of two such numbers are exact.
inline double upper_half(double a) { return std::bit_cast<double>(std::bit_cast<uint64_t>(a) & ~((1ull << 27) - 1)); }

/// To 2^-104 of it, unless it overflows or comes near the smallest numbers.
inline TwoPart product(double a, double b) {
    const double p = a * b, a1 = upper_half(a), a2 = a - a1, b1 = upper_half(b), b2 = b - b1;
    return {p, (((a1 * b1 - p) + a1 * b2) + a2 * b1) + a2 * b2};
}

/// Rough: the sum of the parts is to 2^-104, the upper one to a few units of its last place.
inline TwoPart quotient(TwoPart a, TwoPart b) {
    const double q = a.high / b.high;
    const TwoPart back = product(q, b.high);
    return {q, (((a.high - back.high) - back.low) + (a.low - q * b.low)) / b.high};
}
inline TwoPart square_root(TwoPart a) {
    const double r = std::sqrt(a.high);
    if (r == 0) return {0, 0};
    const TwoPart back = product(r, r);
    return {r, (((a.high - back.high) - back.low) + a.low) / (2 * r)};
}

/// 2^e for -1022 <= e <= 1023.
inline double power_of_two(int64_t e) { return std::bit_cast<double>(static_cast<uint64_t>(e + 1023) << 52); }

}  // namespace sunder::math
