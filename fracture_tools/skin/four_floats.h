// Four floats in a register: a vector and what fills its row.
#pragma once

#include <cmath>

namespace sunder {

typedef float FourFloats __attribute__((vector_size(16), may_alias));

/// Of the first three, in all four lanes.
inline __attribute__((always_inline)) FourFloats length_of(const FourFloats& v) {
    const FourFloats s = v * v;
    const FourFloats squared = __builtin_shufflevector(s, s, 0, 0, 0, 0) + __builtin_shufflevector(s, s, 1, 1, 1, 1) +
                               __builtin_shufflevector(s, s, 2, 2, 2, 2);
    FourFloats length = {};
    for (int i = 0; i < 4; ++i) length[i] = std::sqrt(squared[i]);
    return length;
}

/// Shorter images of unit normals have vanished (a flattened blend).
inline constexpr float kShortestNormal = 1e-12f;

}  // namespace sunder
