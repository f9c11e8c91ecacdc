#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/data/math_functions.h"
#include "solver/data/math_tables.h"

namespace sunder::math {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kBeyond = 746;  // e^746 is larger than all doubles, and e^-746 is nearer to 0 than to the smallest

constexpr TwoPart kLog2 = {0x1.62e42fefa38p-1, 0x1.ef35793c7673p-45};         // the upper part a multiple of 2^-42
constexpr TwoPart kStep = {0x1.62e42fefap-6, 0x1.cf79abc9e3b3ap-45};          // log(2) / 32, likewise
constexpr double kStepsPerUnit = 0x1.71547652b82fep5;                         // 32 / log(2)
constexpr TwoPart kPerLog2 = {0x1.71547652b82fep0, 0x1.777d0ffda0d24p-56};    // 1 / log(2)
constexpr TwoPart kPerLog10 = {0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};  // 1 / log(10)
constexpr double kRounder = 0x1.8p52;  // what it was added to, and taken from again, is rounded to a whole number

// e^x = 2^exponent (root + root growth): Tang's reduction (1989) to |r| <= log(2)/64 with a table of roots, and
// Taylor's series there.
struct Exponential {
    int64_t exponent;
    TwoPart root;   // 2^(j/32)
    double growth;  // e^r - 1

    // Of x = step log(2)/32 + r
    Exponential(int64_t step, double r) : exponent(step >> 5), root(kRoots[step & 31]) {
        const double r2 = r * r;
        growth = r + r2 * ((1.0 / 2 + r * (1.0 / 6)) + r2 * ((1.0 / 24 + r * (1.0 / 120)) + r2 * (1.0 / 720)));
    }
    // Of x + low, |x| < kBeyond
    static Exponential of(double x, double low = 0) {
        const double n = (x * kStepsPerUnit + kRounder) - kRounder;
        return {static_cast<int64_t>(n), ((x - n * kStep.high) - n * kStep.low) + low};
    }
    double value() const {
        const double v = root.high + (root.high * growth + root.low);
        if (-1021 <= exponent && exponent <= 1022) return v * power_of_two(exponent);
        const int64_t half = exponent / 2;  // may end among the smallest numbers, or beyond the largest
        return v * power_of_two(half) * power_of_two(exponent - half);
    }
};

// x = 2^shift (c + rest) with c = 1 + j/64 and |rest| <= 1/128, exactly. Where c is above 1.41 the logarithm is put
// together of one power of two more and half of c: near x = 1 it is then that of 1 + rest/c alone.
struct LogReduction {
    int64_t shift;
    double c, rest;
    TwoPart multiple;  // of log 2, and log c; the upper part is exact

    explicit LogReduction(double x) {  // > 0, finite
        constexpr uint64_t kMantissa = (1ull << 52) - 1;
        const bool is_small = x < std::numeric_limits<double>::min();
        const auto bits = std::bit_cast<uint64_t>(is_small ? x * 0x1p54 : x);
        const auto j = static_cast<int64_t>(((bits & kMantissa) + (1ull << 45)) >> 46);
        shift = static_cast<int64_t>(bits >> 52) - (is_small ? 1077 : 1023);
        c = 1 + static_cast<double>(j) * (1.0 / 64);
        rest = std::bit_cast<double>((bits & kMantissa) | (1023ull << 52)) - c;
        const auto n = static_cast<double>(j > 26 ? shift + 1 : shift);
        multiple = {n * kLog2.high + kLogs[j].high, n * kLog2.low + kLogs[j].low};
    }
};

// Of log(1 + r) what is left after r - r^2/2, by r^3; |r| <= 1/128. Terms go in pairs, so that sums need not wait for
// one another: here and below.
double cubic_rest(double r) {
    const double r2 = r * r;
    return (1.0 / 3 + r * (-1.0 / 4)) +
           r2 * ((1.0 / 5 + r * (-1.0 / 6)) + r2 * ((1.0 / 7 + r * (-1.0 / 8)) + r2 * (1.0 / 9)));
}

// r: rest / c
double log_of(const LogReduction& reduced, double r) {
    const TwoPart s = sum_by_size(reduced.multiple.high, r);
    return s.high + (s.low + (reduced.multiple.low + r * r * (-1.0 / 2 + r * cubic_rest(r))));
}

// To 2^-66 of it. x > 0, finite.
TwoPart log_in_parts(double x) {
    const LogReduction reduced(x);
    const double r = reduced.rest / reduced.c, r1 = upper_half(r);
    const double r_low = ((reduced.rest - r1 * reduced.c) - (r - r1) * reduced.c) / reduced.c;
    const TwoPart square = product(r, r);
    const TwoPart a = sum_by_size(reduced.multiple.high, r), b = sum_by_size(a.high, -0.5 * square.high);
    const double rest = r_low - 0.5 * square.low - r * r_low + r * square.high * cubic_rest(r);
    return sum_by_size(b.high, b.low + (a.low + (reduced.multiple.low + rest)));
}

// What logarithms are where there is none: of zero, of less, of infinity, of what is no number.
double log_without_reduction(double x) { return x == 0 ? -kInfinity : x > 0 ? x : x != x ? x + x : kNoNumber; }
bool can_be_reduced(double x) { return x > 0 && x < kInfinity; }

// The logarithm to another base.
double log_in_base(double x, const TwoPart& per_log_of_base) {
    if (!can_be_reduced(x)) return log_without_reduction(x);
    const TwoPart natural = log_in_parts(x), p = product(natural.high, per_log_of_base.high);
    return p.high + (p.low + (natural.high * per_log_of_base.low + natural.low * per_log_of_base.high));
}

bool is_whole(double y) { return std::abs(y) >= 0x1p53 || static_cast<double>(static_cast<int64_t>(y)) == y; }
bool is_odd(double y) { return std::abs(y) < 0x1p53 && is_whole(y) && (static_cast<int64_t>(y) & 1) != 0; }

// x^y for 0 < x < infinity
double power(double x, double y) {
    const TwoPart log_x = log_in_parts(x);
    const double rough = y * log_x.high;
    if (!(std::abs(rough) < kBeyond)) return rough > 0 ? kInfinity : 0.0;
    const TwoPart z = product(y, log_x.high);
    return Exponential::of(z.high, z.low + y * log_x.low).value();
}

}  // namespace

double exp(double x) {
    if (!(std::abs(x) < kBeyond)) return x != x ? x + x : x > 0 ? kInfinity : 0.0;
    return Exponential::of(x).value();
}

double exp2(double x) {
    if (!(std::abs(x) < 1080)) return x != x ? x + x : x > 0 ? kInfinity : 0.0;
    const double n = (x * 32 + kRounder) - kRounder, rest = x - n * (1.0 / 32);
    return Exponential(static_cast<int64_t>(n), rest * (32 * kStep.high) + rest * (32 * kStep.low)).value();
}

double expm1(double x) {
    if (std::abs(x) < 0x1p-54) return x;
    if (std::abs(x) < 1.0 / 16) {
        const double x2 = x * x;
        const double seventh_on = (1.0 / 5040 + x * (1.0 / 40320)) + x2 * (1.0 / 362880 + x * (1.0 / 3628800));
        const double third_on = (1.0 / 6 + x * (1.0 / 24)) + x2 * ((1.0 / 120 + x * (1.0 / 720)) + x2 * seventh_on);
        return x + x2 * (1.0 / 2 + x * third_on);
    }
    if (x > 40) return exp(x);
    if (!(x > -40)) return x != x ? x + x : -1.0;
    const Exponential e = Exponential::of(x);
    const double power = power_of_two(e.exponent);
    const TwoPart difference = sum(power * e.root.high, -1.0);
    return difference.high + (difference.low + power * (e.root.low + e.root.high * e.growth));
}

double log(double x) {
    if (!can_be_reduced(x)) return log_without_reduction(x);
    const LogReduction reduced(x);
    return log_of(reduced, reduced.rest / reduced.c);
}

double log1p(double x) {
    if (std::abs(x) < 1.0 / 128) return x + x * x * (-1.0 / 2 + x * cubic_rest(x));
    const TwoPart s = sum(1.0, x);
    if (!can_be_reduced(s.high)) return log_without_reduction(s.high);
    if (x > 0x1p54) return log(x);
    const LogReduction reduced(s.high);
    return log_of(reduced, (reduced.rest + s.low * power_of_two(-reduced.shift)) / reduced.c);
}

double log2(double x) { return log_in_base(x, kPerLog2); }
double log10(double x) { return log_in_base(x, kPerLog10); }

double pow(double x, double y) {
    if (y == 0 || x == 1) return 1;
    if (x != x || y != y) return x + y;
    const double size = std::abs(x);
    if (std::abs(y) == kInfinity) return size == 1 ? 1.0 : (size > 1) == (y > 0) ? kInfinity : 0.0;
    if (std::signbit(x) && size != 0 && size != kInfinity && !is_whole(y)) return kNoNumber;
    const double unsigned_power = size == 0 || size == kInfinity ? ((size == 0) == (y > 0) ? 0.0 : kInfinity)
                                  : size == 1                    ? 1.0
                                                                 : power(size, y);
    return std::signbit(x) && is_odd(y) ? -unsigned_power : unsigned_power;
}

// A cubic that is right to 0.8 %, a step of Halley's with its result cut to 26 bits, whose square is exact, and one
// more.
double cbrt(double x) {
    const double size = std::abs(x);
    if (size == 0 || !(size < kInfinity)) return x + x;
    const bool is_small = size < std::numeric_limits<double>::min();
    const auto bits = std::bit_cast<uint64_t>(is_small ? size * 0x1p54 : size);
    const int64_t e = static_cast<int64_t>(bits >> 52) - 1023 + 3 * 1024;  // whose thirds are rounded down
    const double m = std::bit_cast<double>((bits & ((1ull << 52) - 1)) | static_cast<uint64_t>(1023 + e % 3) << 52);
    const double guess = 0.6817 + m * (0.3645 + m * (-0.0433 + m * 0.0023)), cube = guess * guess * guess;
    const double t = upper_half(guess * ((cube + 2 * m) / (2 * cube + m)));
    const double wanted = m / (t * t);
    const double root = t + t * ((wanted - t) / (2 * t + wanted));
    return std::copysign(root * power_of_two(e / 3 - 1024 - (is_small ? 18 : 0)), x);
}

double hypot(double x, double y) {
    const double a = std::max(std::abs(x), std::abs(y)), b = std::min(std::abs(x), std::abs(y));
    if (std::abs(x) == kInfinity || std::abs(y) == kInfinity) return kInfinity;
    if (x != x || y != y) return x + y;
    if (b <= a * 0x1p-54) return a + b;
    const double scale = a > 0x1p510 ? 0x1p-600 : a < 0x1p-450 ? 0x1p600 : 1.0;
    const TwoPart p = product(a * scale, a * scale), q = product(b * scale, b * scale);
    const TwoPart s = sum_by_size(p.high, q.high);
    const TwoPart root = square_root({s.high, s.low + (p.low + q.low)});
    return (root.high + root.low) / scale;
}

}  // namespace sunder::math
