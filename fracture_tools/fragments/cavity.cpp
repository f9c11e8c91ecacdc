#include "fracture_tools/fragments/cavity.h"

#include "solver/data/disjoint_sets.h"

namespace sunder {

Cavity cavity_of(const FragmentSet& set) {
    std::vector<uint32_t> parts = disjoint_sets(set.vertices.size());
    for (const Triangle& t : set.outer_triangles) unite(parts, t[0], t[1]), unite(parts, t[0], t[2]);
    std::vector<double> volume(parts.size(), 0.0);  // by the part's lowest vertex, m3
    const auto area_of = [&](const Triangle& t) -> Vec3 {
        const Vec3& a = set.vertices[t[0]];
        return (set.vertices[t[1]] - a).cross(set.vertices[t[2]] - a) / 2;
    };
    for (const Triangle& t : set.outer_triangles) {
        const uint32_t part = lowest(parts, t[0]);
        volume[part] += (set.vertices[t[0]] - set.vertices[part]).dot(area_of(t)) / 3;
    }
    Cavity cavity;
    cavity.lining.assign(set.fragments.size(), Vec3::Zero());
    for (size_t f = 0; f < set.fragments.size(); ++f)
        for (uint32_t k = set.fragments[f].outer_begin; k < set.fragments[f].outer_end; ++k) {
            const Triangle& t = set.outer_triangles[k];
            if (volume[lowest(parts, t[0])] >= 0) continue;
            cavity.lining[f] += area_of(t), cavity.area += area_of(t).norm();
        }
    for (const double v : volume)
        if (v < 0) cavity.volume -= v;
    return cavity;
}

}  // namespace sunder
