// Where calls of libm's inexact functions go that come with headers of CGAL, OpenVDB, Boost and Eigen, or slip into
// code of ours: whoever links sunder_data has the linker's --wrap send each of these names here (CMakeLists.txt; the
// test c_api_libm finds what is missing). Calls within shared libraries are theirs and stay as they are.
#include "solver/data/math_functions.h"

extern "C" {

double __wrap_exp(double x) { return sunder::math::exp(x); }
double __wrap_exp2(double x) { return sunder::math::exp2(x); }
double __wrap_expm1(double x) { return sunder::math::expm1(x); }
double __wrap_log(double x) { return sunder::math::log(x); }
double __wrap_log1p(double x) { return sunder::math::log1p(x); }
double __wrap_log2(double x) { return sunder::math::log2(x); }
double __wrap_log10(double x) { return sunder::math::log10(x); }
float __wrap_log10f(float x) { return static_cast<float>(sunder::math::log10(static_cast<double>(x))); }
double __wrap_pow(double x, double y) { return sunder::math::pow(x, y); }
double __wrap_cbrt(double x) { return sunder::math::cbrt(x); }
double __wrap_hypot(double x, double y) { return sunder::math::hypot(x, y); }
double __wrap_sin(double x) { return sunder::math::sin(x); }
double __wrap_cos(double x) { return sunder::math::cos(x); }
void __wrap_sincos(double x, double* sine, double* cosine) {
    const sunder::math::SineAndCosine both = sunder::math::sincos(x);
    *sine = both.sine, *cosine = both.cosine;
}
double __wrap_tan(double x) { return sunder::math::tan(x); }
double __wrap_atan(double x) { return sunder::math::atan2(x, 1); }
double __wrap_atan2(double y, double x) { return sunder::math::atan2(y, x); }
double __wrap_asin(double x) { return sunder::math::asin(x); }
double __wrap_acos(double x) { return sunder::math::acos(x); }

}  // extern "C"
