// Functions that every libm has, and each rounds in its own way: a processor with fused multiply-add gives other bits
// than one without, and a newer libm others than an older. These are made of additions, multiplications, divisions and
// square roots of doubles alone, which are rounded alike everywhere, in one order. Nothing of ours calls libm's: what
// libraries' headers call is sent here by the linker (libm_names.cpp). Special values are those of C (Annex F); errno
// is left alone. Rounding to nearest is assumed. Errors are measured in ulp by the tests.
#pragma once

namespace sunder::math {

double exp(double x);
double exp2(double x);
double expm1(double x);
double log(double x);
double log1p(double x);
double log2(double x);
double log10(double x);
double pow(double x, double y);
double cbrt(double x);
double hypot(double x, double y);

struct SineAndCosine {
    double sine, cosine;
};
SineAndCosine sincos(double x);
double sin(double x);
double cos(double x);
double tan(double x);
double atan2(double y, double x);
double asin(double x);
double acos(double x);

}  // namespace sunder::math
