// What of a body's surface lines a hollow inside it.
#pragma once

#include <vector>

#include "solver/data/fragment_set.h"

namespace sunder {

/// All hollows of a body together; of a body that has none, the area is 0.
struct Cavity {
    std::vector<Vec3> lining;  // of each fragment the vector of its area, out of the material (n_fragments x 3), m2
    double area = 0;           // m2
    double volume = 0;         // m3
};

/// Parts of the outer surface that share no vertex with others, and enclose what is no material.
Cavity cavity_of(const FragmentSet& set);

}  // namespace sunder
