// Walks the surface of every fragment of a set.
#pragma once

#include "solver/data/fragment_set.h"

namespace sunder {

/// Calls visit(fragment, triangle) for every triangle of every fragment, outward; order of the set.
template <class Visit>
void for_each_fragment_triangle(const FragmentSet& set, Visit visit) {
    for (size_t f = 0; f < set.fragments.size(); ++f)
        for (uint32_t t = set.fragments[f].outer_begin; t < set.fragments[f].outer_end; ++t)
            visit(f, set.outer_triangles[t]);
    for (const Interface& face : set.interfaces)
        for (uint32_t t = face.triangle_begin; t < face.triangle_end; ++t) {
            const auto& [p, q, r] = set.interface_triangles[t];
            visit(face.a.index(), set.interface_triangles[t]);
            visit(face.b.index(), Triangle{p, r, q});
        }
}

}  // namespace sunder
