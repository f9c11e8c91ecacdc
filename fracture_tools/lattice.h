// A box of cubic cells, one fragment each: the body of accuracy cases and lessons.
#pragma once

#include <array>

#include "solver/data/fragment_set.h"
#include "solver/data/result.h"

namespace sunder {

struct LatticeSettings {
    Vec3 size = Vec3::Constant(1.0);       // m, > 0
    std::array<int, 3> cells = {4, 4, 4};  // 1 .. 1000 each, product <= 4e6
    Vec3 center = Vec3::Zero();            // m
    int neighbours = 6;                    // 6 (faces), 18 (and edges), 26 (and corners)

    Status check(const std::string& where) const;
};

/// Fragments are numbered x fastest, then y, then z. Neighbours across a cell edge or corner are interfaces of area 0.
Result<FragmentSet> make_lattice(const LatticeSettings& settings, const std::string& where);

}  // namespace sunder
