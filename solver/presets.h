// Named points on the front of speed against accuracy (docs/images/chart.svg): what an artist chooses between.
#pragma once

#include <array>
#include <string_view>

namespace sunder {

struct Preset {
    std::string_view name;
    int substeps, iterations, hit_substeps;  // as in SolverSettings
};

/// Of method projective, which most of the front is made of (jacobi is faster for soft or resting bodies, and for tears
/// at the finest steps); from the fastest to the most accurate; the middle one is what SolverSettings starts with.
inline constexpr std::array kPresets = {Preset{"preview", 4, 1, 16}, Preset{"default", 8, 2, 16},
                                        Preset{"final", 32, 1, 64}};

/// The preset of that name, or null.
constexpr const Preset* find_preset(std::string_view name) {
    for (const Preset& preset : kPresets)
        if (preset.name == name) return &preset;
    return nullptr;
}

}  // namespace sunder
