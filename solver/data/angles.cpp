#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "solver/data/math_functions.h"
#include "solver/data/math_tables.h"

namespace sunder::math {
namespace {

constexpr TwoPart kHalfTurn = {0x1.921fb54442d18p1, 0x1.1a62633145c07p-53};
constexpr TwoPart kQuarterTurn = {0x1.921fb54442d18p0, 0x1.1a62633145c07p-54};

// An angle as whole quarters of a turn and what is left of it, at most an eighth (and a rounding).
struct Quartered {
    uint64_t quarters;  // modulo 4
    TwoPart rest;       // rad
};

// Cody and Waite 1980: pi/2 in parts whose multiples by 20 bits are exact.
Quartered subtract_quarters(double x) {
    constexpr double kParts[4] = {0x1.921fb544p0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69, 0x1.b839a252049c1p-104};
    constexpr double kRounder = 0x1.8p52, kQuartersPerRadian = 0x1.45f306dc9c883p-1;
    const double n = (x * kQuartersPerRadian + kRounder) - kRounder;
    const TwoPart a = sum(x - n * kParts[0], -n * kParts[1]), b = sum(a.high, -n * kParts[2]);
    return {static_cast<uint64_t>(static_cast<int64_t>(n)) & 3, sum_by_size(b.high, b.low + (a.low - n * kParts[3]))};
}

// Payne and Hanek 1983: of 2/pi only those 192 bits matter whose products with the mantissa are neither whole turns nor
// too small to be seen.
Quartered multiply_by_two_over_pi(double size) {
    using Wide = unsigned __int128;
    const auto bits = std::bit_cast<uint64_t>(size);
    const uint64_t mantissa = (bits & ((1ull << 52) - 1)) | 1ull << 52;
    const int64_t exponent = static_cast<int64_t>(bits >> 52) - 1075;  // size = mantissa 2^exponent
    // The first bit's weight in the product is two quarters; counted from the word of zeros on.
    const auto first = static_cast<uint64_t>(exponent - 2 + 64);
    uint64_t window[3];
    for (uint64_t i = 0; i < 3; ++i) {
        const uint64_t word = first / 64 + i, shift = first % 64;
        window[i] = shift == 0 ? kTwoOverPi[word] : kTwoOverPi[word] << shift | kTwoOverPi[word + 1] >> (64 - shift);
    }
    const Wide low = Wide{window[2]} * mantissa, middle = Wide{window[1]} * mantissa + static_cast<uint64_t>(low >> 64);
    const uint64_t turns[3] = {window[0] * mantissa + static_cast<uint64_t>(middle >> 64),
                               static_cast<uint64_t>(middle), static_cast<uint64_t>(low)};
    // Now quarters are the upper two bits. What is left is taken to lie about zero.
    const uint64_t upper = turns[0] << 2 | turns[1] >> 62;
    Wide part = Wide{upper} << 64 | (turns[1] << 2 | turns[2] >> 62);
    uint64_t tail = turns[2] << 2;
    const bool is_negative = upper >> 63;
    if (is_negative) part = ~part + (tail == 0), tail = -tail;
    int64_t scale = -128;  // part 2^scale is in quarters
    while (part >> 64 == 0) part = part << 64 | tail, tail = 0, scale -= 64;
    const int zeros = std::countl_zero(static_cast<uint64_t>(part >> 64));
    if (zeros > 0) part = part << zeros | tail >> (64 - zeros), scale -= zeros;
    const uint64_t high = static_cast<uint64_t>(part >> 75);
    const uint64_t rest = static_cast<uint64_t>(part >> 22) & ((1ull << 53) - 1);
    const double sign = is_negative ? -1.0 : 1.0, unit = power_of_two(scale + 22);
    const TwoPart share = {sign * static_cast<double>(high) * (unit * 0x1p53), sign * static_cast<double>(rest) * unit};
    const TwoPart p = product(share.high, kQuarterTurn.high);
    return {(turns[0] >> 62) + is_negative,
            sum_by_size(p.high, p.low + (share.high * kQuarterTurn.low + share.low * kQuarterTurn.high))};
}

// Not for what is no number, nor for infinity.
Quartered in_quarters(double x) {
    if (std::abs(x) <= 0.7853) return {0, {x, 0}};
    if (std::abs(x) < 0x1p19) return subtract_quarters(x);
    Quartered q = multiply_by_two_over_pi(std::abs(x));
    if (x < 0) q = {0 - q.quarters, {-q.rest.high, -q.rest.low}};
    return {q.quarters & 3, q.rest};
}

// Taylor's series for |a| <= pi/4, terms in pairs; what is added last is kept apart.
TwoPart sine_of_rest(TwoPart a) {
    const double x = a.high, z = x * x, z2 = z * z;
    const double ninth_on = (1.0 / 362880 + z * (-1.0 / 39916800)) +
                            z2 * ((1.0 / 6227020800 + z * (-1.0 / 1307674368000)) + z2 * (1.0 / 355687428096000));
    return {x, a.low * (1 - 0.5 * z) + x * z * (-1.0 / 6 + z * ((1.0 / 120 + z * (-1.0 / 5040)) + z2 * ninth_on))};
}
TwoPart cosine_of_rest(TwoPart a) {
    const double x = a.high, z = x * x, z2 = z * z;
    const double eighth_on = (1.0 / 40320 + z * (-1.0 / 3628800)) +
                             z2 * ((1.0 / 479001600 + z * (-1.0 / 87178291200)) + z2 * (1.0 / 20922789888000));
    const TwoPart s = sum_by_size(1.0, -0.5 * z);
    return {s.high, s.low + (z2 * ((1.0 / 24 + z * (-1.0 / 720)) + z2 * eighth_on) - x * a.low)};
}
double sine_of(TwoPart a) {
    const TwoPart s = sine_of_rest(a);
    return s.high + s.low;
}
double cosine_of(TwoPart a) {
    const TwoPart c = cosine_of_rest(a);
    return c.high + c.low;
}

TwoPart negative(TwoPart a) { return {-a.high, -a.low}; }

// atan(q) - q for |q| <= 1/32
double beyond_tangent(double q) {
    const double z = q * q;
    return q * z * ((-1.0 / 3 + z * (1.0 / 5)) + z * z * ((-1.0 / 7 + z * (1.0 / 9)) + z * z * (-1.0 / 11)));
}

// The angle of (x, y) in the first octant, 0 <= y <= x, from `base` on in the direction `sign`: near y/x = c = j/16 it
// is atan(c) + atan((y - c x) / (x + c y)).
double arc(TwoPart y, TwoPart x, TwoPart base, double sign) {
    const auto j = static_cast<int>(16 * (y.high / x.high) + 0.5);
    const double c = j * (1.0 / 16), x1 = upper_half(x.high), y1 = upper_half(y.high);
    const TwoPart across = sum(y.high, -c * x1), along = sum_by_size(x.high, c * y1);
    const TwoPart q = quotient(sum(across.high, across.low + (y.low - c * ((x.high - x1) + x.low))),
                               sum_by_size(along.high, along.low + (x.low + c * ((y.high - y1) + y.low))));
    const TwoPart a = sum(base.high, sign * kArcs[j].high), b = sum(a.high, sign * q.high);
    return b.high + (b.low + (a.low + (base.low + sign * (kArcs[j].low + (q.low + beyond_tangent(q.high))))));
}

// The angle of (x, y), y >= 0, in [0, pi]; one of the two is not zero, and neither is far smaller than the other or
// near the ends of what doubles hold, unless it is zero.
double angle_of(TwoPart y, TwoPart x) {
    const bool is_left = x.high < 0;
    if (is_left) x = negative(x);
    if (y.high > x.high) return arc(x, y, kQuarterTurn, is_left ? 1.0 : -1.0);
    return is_left ? arc(y, x, kHalfTurn, -1.0) : arc(y, x, {0, 0}, 1.0);
}

// sqrt(1 - x^2)
TwoPart other_leg(double x) {
    const TwoPart square = product(x, x), s = sum_by_size(1.0, -square.high);
    return square_root({s.high, s.low - square.low});
}

}  // namespace

double sin(double x) {
    if (!(std::abs(x) < kInfinity)) return x - x;
    if (x == 0) return x;
    const Quartered q = in_quarters(x);
    const double size = q.quarters & 1 ? cosine_of(q.rest) : sine_of(q.rest);
    return q.quarters & 2 ? -size : size;
}

double cos(double x) {
    if (!(std::abs(x) < kInfinity)) return x - x;
    const Quartered q = in_quarters(x);
    const double size = q.quarters & 1 ? sine_of(q.rest) : cosine_of(q.rest);
    return (q.quarters + 1) & 2 ? -size : size;
}

SineAndCosine sincos(double x) {
    if (!(std::abs(x) < kInfinity)) return {x - x, x - x};
    if (x == 0) return {x, 1};
    const Quartered q = in_quarters(x);
    const double s = sine_of(q.rest), c = cosine_of(q.rest);
    const double sine = q.quarters & 1 ? c : s, cosine = q.quarters & 1 ? s : c;
    return {q.quarters & 2 ? -sine : sine, (q.quarters + 1) & 2 ? -cosine : cosine};
}

double tan(double x) {
    if (!(std::abs(x) < kInfinity)) return x - x;
    if (std::abs(x) < 0x1p-27) return x;
    const Quartered q = in_quarters(x);
    const TwoPart parts_of_s = sine_of_rest(q.rest), parts_of_c = cosine_of_rest(q.rest);
    const TwoPart s = sum_by_size(parts_of_s.high, parts_of_s.low), c = sum_by_size(parts_of_c.high, parts_of_c.low);
    const TwoPart t = q.quarters & 1 ? quotient(negative(c), s) : quotient(s, c);
    return t.high + t.low;
}

double atan2(double y, double x) {
    if (x != x || y != y) return x + y;
    const double up = std::abs(y), along = std::abs(x);
    if (up == kInfinity && along == kInfinity) return atan2(std::copysign(1.0, y), std::copysign(1.0, x));
    if (up == 0 || along == kInfinity) return std::copysign(std::signbit(x) ? kHalfTurn.high : 0.0, y);
    if (along == 0 || up == kInfinity) return std::copysign(kQuarterTurn.high, y);
    const double ratio = up / along;
    if (ratio < 0x1p-60) return std::copysign(x > 0 ? ratio : kHalfTurn.high, y);
    if (ratio > 0x1p60) return std::copysign(kQuarterTurn.high, y);
    if (x > 0 && ratio < 1.0 / 32 && up > 0x1p-900 && along < 0x1p900) {  // most turns of a step: what arc() comes to
        const TwoPart q = quotient({up, 0}, {along, 0});
        return std::copysign(q.high + (q.low + beyond_tangent(q.high)), y);
    }
    const double larger = std::max(up, along);
    const double scale = larger > 0x1p500 ? 0x1p-600 : larger < 0x1p-400 ? 0x1p600 : 1.0;
    return std::copysign(angle_of({up * scale, 0}, {x * scale, 0}), y);
}

double asin(double x) {
    if (!(std::abs(x) <= 1)) return x != x ? x + x : std::numeric_limits<double>::quiet_NaN();
    if (std::abs(x) < 0x1p-27) return x;
    return std::copysign(angle_of({std::abs(x), 0}, other_leg(x)), x);
}

double acos(double x) {
    if (!(std::abs(x) <= 1)) return x != x ? x + x : std::numeric_limits<double>::quiet_NaN();
    if (std::abs(x) < 0x1p-60) return kQuarterTurn.high;
    if (x == 1) return 0;
    return angle_of(other_leg(x), {x, 0});
}

}  // namespace sunder::math
