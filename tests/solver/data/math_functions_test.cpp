// Every function against MPFR over all doubles, and the bits that every machine must get.
#include "solver/data/math_functions.h"

#include <gtest/gtest.h>
#include <mpfr.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "solver/data/frame_state.h"

namespace sunder {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallest = std::numeric_limits<double>::denorm_min();
constexpr size_t kSamples = 20000;  // of each kind

using Draws = std::mt19937_64;
using Kind = std::function<double(Draws&)>;

double share(Draws& draws) { return static_cast<double>(draws() >> 11) * 0x1p-53; }
Kind between(double low, double high) {
    return [=](Draws& draws) { return low + (high - low) * share(draws); };
}
// All exponents alike, both signs; now and then infinities and what is no number.
double any_double(Draws& draws) { return std::bit_cast<double>(draws()); }
Kind scaled(Kind kind, int exponent) {
    return [=](Draws& draws) { return std::ldexp(kind(draws), exponent); };
}
// Just beside the multiples of pi/4, where little is left of an angle.
double near_eighth_of_turn(Draws& draws) {
    return static_cast<double>(draws() >> (44 + draws() % 20)) * 0.785398163397448309616;
}
double near_one(Draws& draws) { return 1 + (share(draws) - 0.5) * std::ldexp(1.0, -static_cast<int>(draws() % 50)); }
double tiny_to_one(Draws& draws) { return std::ldexp(share(draws) - 0.5, 1 - static_cast<int>(draws() % 300)); }

// Where C says what comes out.
const std::vector<double> kSpecial = {0.0,
                                      -0.0,
                                      1.0,
                                      -1.0,
                                      0.5,
                                      -0.5,
                                      2.0,
                                      -2.0,
                                      3.0,
                                      -3.0,
                                      kInfinity,
                                      -kInfinity,
                                      std::numeric_limits<double>::quiet_NaN(),
                                      kSmallest,
                                      -kSmallest,
                                      std::numeric_limits<double>::min(),
                                      std::numeric_limits<double>::max(),
                                      -std::numeric_limits<double>::max(),
                                      0x1p53,
                                      0x1p53 + 2,
                                      -0x1p53 - 2,
                                      0x1p52 + 1,
                                      1e300,
                                      -1e300,
                                      1e-300,
                                      1024.0,
                                      -1074.0,
                                      -1075.0,
                                      -1076.0,
                                      709.78,
                                      -745.13};

// The error of `got` in ulp of the nearest double.
double ulps_apart(double got, mpfr_srcptr wanted) {
    const double nearest = mpfr_get_d(wanted, MPFR_RNDN);
    if (std::isnan(nearest)) return std::isnan(got) ? 0 : kInfinity;
    if (std::isinf(nearest)) return got == nearest ? 0 : kInfinity;
    if (!std::isfinite(got) || (nearest == 0 && std::signbit(got) != std::signbit(nearest))) return kInfinity;
    const int exponent = nearest == 0 ? -1074 : std::max(std::ilogb(nearest) - 52, -1074);
    mpfr_t difference;
    mpfr_init2(difference, 200);
    mpfr_sub_d(difference, wanted, got, MPFR_RNDN);
    mpfr_div_2si(difference, difference, exponent, MPFR_RNDN);
    const double ulps = std::abs(mpfr_get_d(difference, MPFR_RNDN));
    mpfr_clear(difference);
    return ulps;
}

class Oracle {
public:
    Oracle() { mpfr_inits2(120, wanted_, nullptr), mpfr_inits2(53, x_, y_, nullptr); }
    ~Oracle() { mpfr_clears(wanted_, x_, y_, nullptr); }
    Oracle(const Oracle&) = delete;
    Oracle& operator=(const Oracle&) = delete;

    template <class Function>
    mpfr_srcptr value(Function* function, double x) {
        mpfr_set_d(x_, x, MPFR_RNDN);
        function(wanted_, x_, MPFR_RNDN);
        return wanted_;
    }
    template <class Function>
    mpfr_srcptr value(Function* function, double x, double y) {
        mpfr_set_d(x_, x, MPFR_RNDN), mpfr_set_d(y_, y, MPFR_RNDN);
        function(wanted_, x_, y_, MPFR_RNDN);
        return wanted_;
    }

private:
    mpfr_t wanted_, x_, y_;
};

struct Worst {
    double ulps = 0, x = 0, y = 0;
    void look(double at, double of_x, double of_y = 0) {
        if (!(at <= ulps)) ulps = at, x = of_x, y = of_y;
    }
    void expect_within(double bound, const char* name) const {
        std::printf("%-6s %.3f ulp at most, at %.17g, %.17g\n", name, ulps, x, y);
        EXPECT_LE(ulps, bound) << name << " at " << std::hexfloat << x << ", " << y;
    }
};

using MpfrOfOne = int(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
using MpfrOfTwo = int(mpfr_ptr, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);

void compare(const char* name, double (*ours)(double), MpfrOfOne* theirs, double bound,
             const std::vector<Kind>& kinds) {
    Oracle oracle;
    Worst worst;
    const auto look = [&](double x) { worst.look(ulps_apart(ours(x), oracle.value(theirs, x)), x); };
    for (const double x : kSpecial) look(x);
    Draws draws(1);
    for (const Kind& kind : kinds)
        for (size_t i = 0; i < kSamples; ++i) look(kind(draws));
    worst.expect_within(bound, name);
}

void compare(const char* name, double (*ours)(double, double), MpfrOfTwo* theirs, double bound,
             const std::vector<std::pair<Kind, Kind>>& kinds) {
    Oracle oracle;
    Worst worst;
    const auto look = [&](double x, double y) { worst.look(ulps_apart(ours(x, y), oracle.value(theirs, x, y)), x, y); };
    for (const double x : kSpecial)
        for (const double y : kSpecial) look(x, y);
    Draws draws(1);
    for (const auto& [of_x, of_y] : kinds)
        for (size_t i = 0; i < kSamples; ++i) {
            const double x = of_x(draws);
            look(x, of_y(draws));
        }
    worst.expect_within(bound, name);
}

// Bounds: where a half is nearly all, what is added last is exact but for its own rounding; others round a part of a
// tenth of the result once more, and near 1/16, 1/64 and 1/128 as much as a third of it. Where results are below the
// smallest normal number they are rounded twice.

TEST(math_functions, exponentials_are_within_an_ulp) {
    compare("exp", math::exp, mpfr_exp, 0.76, {any_double, between(-746, 710), between(-1, 1), between(-746, -707)});
    compare("exp2", math::exp2, mpfr_exp2, 0.76,
            {any_double, between(-1076, 1025), between(-1, 1), between(-1076, -1021)});
    compare("expm1", math::expm1, mpfr_expm1, 1,
            {any_double, between(-45, 710), between(-1, 1), between(-0.1, 0.1), tiny_to_one});
}

TEST(math_functions, logarithms_are_within_an_ulp) {
    compare("log", math::log, mpfr_log, 1,
            {any_double, between(0, 2), between(0.98, 1.02), near_one, scaled(between(0, 1), -1030)});
    compare("log1p", math::log1p, mpfr_log1p, 1, {any_double, between(-1, 2), between(-0.02, 0.02), tiny_to_one});
    compare("log2", math::log2, mpfr_log2, 0.51, {any_double, between(0, 2), near_one});
    compare("log10", math::log10, mpfr_log10, 0.51, {any_double, between(0, 2), near_one});
}

TEST(math_functions, powers_and_roots_are_within_an_ulp) {
    compare("pow", math::pow, mpfr_pow, 0.76,
            {{any_double, any_double},
             {between(0, 4), between(-500, 500)},
             {near_one, between(-1e5, 1e5)},
             {any_double, between(-3, 3)},
             {between(0, 1), between(-4, 4)}});
    compare("cbrt", math::cbrt, mpfr_cbrt, 0.67, {any_double, between(1, 8), scaled(between(0, 1), -1030)});
    compare("hypot", math::hypot, mpfr_hypot, 0.51,
            {{any_double, any_double},
             {between(-1, 1), between(-1, 1)},
             {scaled(between(-1, 1), -1060), scaled(between(-1, 1), -1060)},
             {scaled(between(-1, 1), 1024), scaled(between(-1, 1), 1024)}});
}

TEST(math_functions, sines_and_tangents_are_within_an_ulp) {
    const std::vector<Kind> kinds = {any_double, between(-10, 10), between(-6e5, 6e5), near_eighth_of_turn,
                                     tiny_to_one};
    compare("sin", math::sin, mpfr_sin, 0.8, kinds);
    compare("cos", math::cos, mpfr_cos, 0.8, kinds);
    compare("tan", math::tan, mpfr_tan, 1, kinds);
}

TEST(math_functions, arcs_are_within_an_ulp) {
    compare("atan2", math::atan2, mpfr_atan2, 0.51,
            {{any_double, any_double}, {between(-1, 1), between(-1, 1)}, {tiny_to_one, tiny_to_one}});
    compare("asin", math::asin, mpfr_asin, 0.51, {any_double, between(-1, 1), near_one, tiny_to_one});
    compare("acos", math::acos, mpfr_acos, 0.53, {any_double, between(-1, 1), near_one, tiny_to_one});
}

TEST(math_functions, the_double_nearest_to_a_multiple_of_a_quarter_turn_keeps_its_digits) {
    // Of all doubles this one comes nearest: 4.7e-19 are left of it.
    const double x = std::ldexp(6381956970095103.0, 797);
    Oracle oracle;
    EXPECT_LE(ulps_apart(math::cos(x), oracle.value(mpfr_cos, x)), 0.51);
    EXPECT_LE(ulps_apart(math::tan(x), oracle.value(mpfr_tan, x)), 1);
}

TEST(math_functions, sincos_is_sine_and_cosine) {
    Draws draws(1);
    for (size_t i = 0; i < kSamples; ++i) {
        const double x = between(-1e6, 1e6)(draws);
        const math::SineAndCosine both = math::sincos(x);
        ASSERT_EQ(both.sine, math::sin(x));
        ASSERT_EQ(both.cosine, math::cos(x));
    }
}

TEST(math_functions, whole_powers_of_the_base_have_whole_logarithms) {
    for (int e = -1074; e <= 1023; ++e) ASSERT_EQ(math::log2(std::ldexp(1.0, e)), e);
    for (int e = -1074; e <= 1023; ++e) ASSERT_EQ(math::exp2(e), std::ldexp(1.0, e));
    for (int e = 0; e <= 22; ++e) ASSERT_EQ(math::log10(math::pow(10, e)), e);
}

// Results for the same random numbers, hashed: what another processor, compiler or set of flags gives must be the same.
// A change of a function changes its hash, and the bits of every scene.
template <class Function>
uint64_t hash_of_results(const Function& function, const Kind& kind) {
    Draws draws(7);
    std::vector<double> results;
    for (size_t i = 0; i < kSamples; ++i) results.push_back(function(kind(draws)));
    return hash_of(results);
}

TEST(math_functions, bits_are_those_of_every_other_machine) {
    const auto with = [](double (*function)(double, double), double second) {
        return [=](double first) { return function(first, second); };
    };
    const Kind wide = between(-700, 700), positive = between(0, 100), narrow = between(-1, 1);
    const std::pair<const char*, std::pair<uint64_t, uint64_t>> of[] = {
        {"exp", {hash_of_results(math::exp, wide), 0x56dfeb634d788bc5ull}},
        {"exp2", {hash_of_results(math::exp2, wide), 0xba838ef5e1f01edcull}},
        {"expm1", {hash_of_results(math::expm1, narrow), 0x6f8c7eea523a66cfull}},
        {"log", {hash_of_results(math::log, positive), 0xab7f9617e2c80252ull}},
        {"log1p", {hash_of_results(math::log1p, positive), 0x3bf7dadb0fd05ecdull}},
        {"log2", {hash_of_results(math::log2, positive), 0xfc45d57e0d9a9456ull}},
        {"log10", {hash_of_results(math::log10, positive), 0xd57a3241e12e815bull}},
        {"pow", {hash_of_results(with(math::pow, 1.7), positive), 0xcf6d5d66333f6603ull}},
        {"cbrt", {hash_of_results(math::cbrt, wide), 0x89c9ec20fb22d7f6ull}},
        {"hypot", {hash_of_results(with(math::hypot, 0.3), narrow), 0x13fe00ae7e9cf828ull}},
        {"sin", {hash_of_results(math::sin, wide), 0xbfb5d12a50cb120bull}},
        {"cos", {hash_of_results(math::cos, wide), 0xcfcf005defa7e0bull}},
        {"tan", {hash_of_results(math::tan, wide), 0x986a8c47bfb3848full}},
        {"sin of large angles", {hash_of_results(math::sin, scaled(wide, 400)), 0xcc9923a254d6a7acull}},
        {"atan2", {hash_of_results(with(math::atan2, 0.3), narrow), 0xdd5a85dc679b79ull}},
        {"asin", {hash_of_results(math::asin, narrow), 0x93582a5ff0404e47ull}},
        {"acos", {hash_of_results(math::acos, narrow), 0x5768008374d268f7ull}},
    };
    for (const auto& [name, hashes] : of)
        EXPECT_EQ(hashes.first, hashes.second) << name << std::hex << " 0x" << hashes.first;
}

}  // namespace
}  // namespace sunder
