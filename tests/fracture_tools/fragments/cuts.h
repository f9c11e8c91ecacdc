// Cuts as tests want them: made, or refused.
#pragma once

#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"

namespace sunder::testing {

constexpr CutMethod kMethods[] = {CutMethod::voronoi, CutMethod::kmeans};

inline FragmentSet cut(const TriMesh& mesh, int pieces, uint32_t seed = 0, CutMethod method = CutMethod::kmeans,
                       SiteKind sites = SiteKind::kmeans) {
    PrefractureSettings settings;
    settings.method = method;
    settings.sites.kind = sites;
    settings.sites.points = {Vec3(0.4, 0.3, 0.01)};
    settings.pieces = pieces;
    settings.seed = seed;
    Result<FragmentSet> set = prefracture(mesh, settings, "mesh");
    EXPECT_TRUE(set) << (set ? "" : set.error().text());
    return set ? set.take() : FragmentSet();
}

inline Error refused(const TriMesh& mesh, PrefractureSettings settings, CutMethod method) {
    settings.method = method;
    const Result<FragmentSet> set = prefracture(mesh, settings, "mesh");
    EXPECT_FALSE(set);
    return set ? Error() : set.error();
}
inline Error refused(const TriMesh& mesh, CutMethod method = CutMethod::kmeans) { return refused(mesh, {}, method); }

inline double volume_sum(const FragmentSet& set) {
    double sum = 0;
    for (const Fragment& f : set.fragments) sum += f.volume;
    return sum;
}

}  // namespace sunder::testing
