// Where calls of libm's functions of floats go that come with the readers of assimp, as those of doubles go to
// solver/data/libm_names.cpp: what a file holds is read to the same bits on every processor. (In the plain build these
// calls are within the system's libassimp, and not ours.)
#include "solver/data/math_functions.h"

extern "C" {

float __wrap_powf(float x, float y) { return float(sunder::math::pow(x, y)); }
float __wrap_sinf(float x) { return float(sunder::math::sin(x)); }
float __wrap_cosf(float x) { return float(sunder::math::cos(x)); }
void __wrap_sincosf(float x, float* sine, float* cosine) {
    const sunder::math::SineAndCosine both = sunder::math::sincos(x);
    *sine = float(both.sine), *cosine = float(both.cosine);
}
float __wrap_atan2f(float y, float x) { return float(sunder::math::atan2(y, x)); }
float __wrap_asinf(float x) { return float(sunder::math::asin(x)); }
float __wrap_acosf(float x) { return float(sunder::math::acos(x)); }

}  // extern "C"
