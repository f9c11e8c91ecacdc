// The skin of what lies one fragment thick: bent evenly, folded, twisted.
#include <gtest/gtest.h>

#include "fracture_tools/skin/particle_transforms.h"
#include "tests/fracture_tools/bent_strip.h"

namespace sunder {
namespace {

using testing::Bend;
using testing::StripLooks;
using testing::VoronoiBody;

struct Strip {
    const char* name;
    double thickness;  // of fragments 1 m wide, m
    bool is_lattice;
};
void PrintTo(const Strip& strip, std::ostream* out) { *out << strip.name; }

class BentSheet : public ::testing::TestWithParam<Strip> {
protected:
    StripLooks bent(double degrees, double length) {
        const Bend bend{degrees * std::numbers::pi / 180, length, 0.5};
        testing::pose(body_, bend);
        return testing::look_at(body_.frame(), bend, GetParam().thickness);
    }
    VoronoiBody body_ = testing::strip_body(4, GetParam().thickness, GetParam().is_lattice);
};

TEST_P(BentSheet, keeps_its_thickness_around_a_fold) {
    for (const double length : {3.0, 2.0}) {
        const StripLooks looks = bent(150, length);
        EXPECT_GT(looks.n_pairs, 4000);
        // What is across is turned, and not blended: 1 within rounding. Matrices blended gave 0.74 to 0.79 over 2 m.
        EXPECT_NEAR(looks.least_gap, 1, 1e-4);
        EXPECT_NEAR(looks.most_gap, 1, 1e-4);
        // Less where the line across is not normal to the faces: measured 0.97 and more.
        EXPECT_GT(looks.least_thickness, 0.95);
        EXPECT_EQ(looks.n_over, 0);
    }
}

TEST_P(BentSheet, is_smooth_where_it_bends_evenly) {
    const StripLooks looks = bent(150, 12);
    // 12.5 degrees a fragment, 1.6 a row of faces. Of neighbouring faces beyond the bend: measured 0.44, 0.6 to 1.1;
    // with matrices and one ring 1.2, 10 to 26, the most at borders of fragments.
    EXPECT_LT(looks.rms_fold, 0.5);
    EXPECT_LT(looks.worst_fold, 1.5);
    // Of a vertex from where the bend takes it, the most where it begins: measured 0.002 to 0.02 m; with matrices,
    // which put all outside of the arc by an eighth of the width times the angle, 0.03 to 0.07.
    EXPECT_LT(looks.worst_place, 0.025);
}

TEST_P(BentSheet, a_sharp_fold_is_as_sharp_as_a_fragment_is_wide) {
    const Bend bend{std::numbers::pi / 2, 1, 0.5};
    testing::pose(body_, bend);
    const VisualMesh mesh = body_.frame();
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const Vec3& rest = mesh.skin->rest_position(uint32_t(v));
        if (std::abs(rest.x() - bend.middle) < 3.5) continue;  // beyond the supports of all that the bend turned
        EXPECT_LT((mesh.positions[v].cast<double>() - bend.place(rest)).norm(), 1e-5);
    }
}

TEST_P(BentSheet, bending_leaves_no_elastic_part_and_so_none_to_let_go_of) {
    const Bend bend{2.5, 12, 0.5};
    testing::pose(body_, bend);
    ParticleMaps maps;
    ParticleTransforms(body_.rest).evaluate(body_.position, body_.orientation, body_.plastic, body_.intact, maps);
    ASSERT_TRUE(maps.bend());
    for (size_t i = 0; i < maps.turn.size(); ++i) {
        const double at = body_.rest.rest_position[i].x();
        if (std::abs(at - bend.middle) > bend.length / 2 - 2) continue;  // beside it the bend is not even
        // A fit without arcs has the square of the angle over 6, 0.008, and half of it, 0.1, at rims.
        EXPECT_LT((maps.whole(i).linear - maps.turn[i].toRotationMatrix()).norm(), 1e-3) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(skins, BentSheet,
                         ::testing::Values(Strip{"cubes", 1, true}, Strip{"plates", 0.3, true},
                                           Strip{"cells", 0.3, false}, Strip{"thin_cells", 0.05, false}),
                         [](const auto& strip) { return strip.param.name; });

TEST(TwistedRod, keeps_its_section) {
    VoronoiBody rod = testing::strip_body(1, 1, true);
    const auto turn = [](double x) { return Quat(Eigen::AngleAxisd(std::numbers::pi / 3 * x, Vec3::UnitX())); };
    for (size_t i = 0; i < rod.position.size(); ++i)  // 60 degrees a fragment
        rod.orientation[i] = turn(rod.rest.rest_position[i].x()) * rod.rest.rest_orientation[i];
    const VisualMesh mesh = rod.frame();
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        Vec3 now = mesh.positions[v].cast<double>(), rest = mesh.skin->rest_position(uint32_t(v));
        now.x() = rest.x() = 0;
        // Matrices blended leave 0.8 of it between two fragments.
        EXPECT_NEAR(now.norm(), rest.norm(), 1e-5);
    }
}

}  // namespace
}  // namespace sunder
