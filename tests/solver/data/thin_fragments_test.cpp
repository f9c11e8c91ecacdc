#include "solver/data/thin_fragments.h"

#include <gtest/gtest.h>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Of the middle one of 27 cubes, with neighbours put elsewhere.
Cover cover_of(const std::vector<Vec3>& directions) {
    SimulationMesh rest = test::lattice_mesh({{3, 3, 3}, 0.1, 6, 1000, {}});
    const ParticleId middle(13);
    Cover cover(rest, middle);
    uint32_t j = 0;
    for (const Vec3& d : directions) {
        rest.rest_position[j] = rest.rest_position[middle] + 0.1 * d.normalized();
        cover.add(rest, middle, ParticleId(j), 0.01);
        ++j;
    }
    return cover;
}

// The gradient of a fit along what they do not span has no measure: such fragments of a free body at rest drove
// themselves to 1e12 times its energy.
TEST(thin_fragments, neighbours_in_a_slanting_plane_span_the_axes_and_not_all_between_them) {
    const Cover corner = cover_of({Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)});
    EXPECT_EQ(corner.directions(), 3);
    EXPECT_TRUE(corner.spans_all());
    // Three about the diagonal, and nearer and nearer to the plane across it.
    const auto leaning = [](double by) { return cover_of({Vec3(1, -by, 0), Vec3(0, 1, -by), Vec3(-by, 0, 1)}); };
    for (const double by : {-0.5, 0.0, 0.5, 0.7, 1.0}) EXPECT_EQ(leaning(by).directions(), 3) << by;
    for (const double by : {-0.5, 0.0, 0.5}) EXPECT_TRUE(leaning(by).spans_all()) << by;
    for (const double by : {0.7, 1.0}) EXPECT_FALSE(leaning(by).spans_all()) << by;
    EXPECT_FALSE(cover_of({Vec3(1, 0, 0), Vec3(0, 1, 0)}).spans_all());
}

}  // namespace
}  // namespace sunder
