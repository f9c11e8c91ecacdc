// Ellipsoids and rigid solids against planes, spheres, boxes and capsules.
#include "solver/collision/shape_distance.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/collision_cases.h"

namespace sunder {
namespace {

double brute_force_gap(const Ellipsoid& a, const PlacedShape& b) {
    return brute_force_maximum(
        [&](const Vec3& n) { return n.dot(a.center - b.pose.position) - support(a, n) - support(b, n); });
}

double brute_force_gap(const PlacedShape& a, const PlacedShape& b) {
    return brute_force_maximum(
        [&](const Vec3& n) { return n.dot(a.pose.position - b.pose.position) - support(a, n) - support(b, n); });
}

Shape random_shape(std::mt19937_64& rng, ShapeKind kind) {
    Shape s;
    s.kind = kind;
    s.radius = uniform(rng, 0.2, 1);
    s.half_height = uniform(rng, 0.2, 2);
    s.half_extents = uniform3(rng, 0.2, 1.5);
    return s;
}

const char* name(ShapeKind kind) {
    switch (kind) {
        case ShapeKind::plane:
            return "plane";
        case ShapeKind::sphere:
            return "sphere";
        case ShapeKind::box:
            return "box";
        case ShapeKind::capsule:
            return "capsule";
        case ShapeKind::mesh:
            return "mesh";
    }
    return "";
}

class EllipsoidAgainst : public testing::TestWithParam<ShapeKind> {};

TEST_P(EllipsoidAgainst, a_brute_force_search_finds_nothing_better) {
    auto rng = generator(21);
    int overlapping = 0, missed = 0;
    double worst = 0;
    constexpr int kPairs = 1000;
    for (int k = 0; k < kPairs; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 2, 4);
        const PlacedShape b{random_shape(rng, GetParam()), random_pose(rng, 0.5)};
        const double truth = brute_force_gap(a, b), mean = a.radii.mean();
        const Separation s = ellipsoid_shape_distance(a, b);
        expect_whole(s, 10);
        overlapping += truth < 0;
        // The oracle stops short on the kinks of a box, but no direction's slab is wider than the gap: so this is safe.
        EXPECT_LE(s.gap, s.normal.dot(a.center - b.pose.position) - support(a, s.normal) - support(b, s.normal) + 1e-12)
            << k;
        worst = std::max(worst, (truth - s.gap) / mean);
        missed += truth - s.gap > 1e-3 * mean;
    }
    EXPECT_GT(overlapping, kPairs / 8);
    EXPECT_LT(overlapping, kPairs * 7 / 8);
    EXPECT_EQ(missed, 0) << "worst " << worst;
}
INSTANTIATE_TEST_SUITE_P(Shapes, EllipsoidAgainst,
                         testing::Values(ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule),
                         [](const auto& info) { return std::string(name(info.param)); });

TEST(shape_distance, a_plane_touches_an_ellipsoid_at_its_support_point) {
    Ellipsoid e;
    e.radii = Vec3(3, 2, 0.5);
    e.center = Vec3(7, -2, 1.25);
    const Separation flat = ellipsoid_shape_distance(e, {plane(), Pose()});
    EXPECT_DOUBLE_EQ(flat.gap, 0.75);
    EXPECT_EQ(flat.normal, Vec3::UnitZ());
    EXPECT_NEAR((flat.point_a - Vec3(7, -2, 0.75)).norm(), 0, 1e-15);
    EXPECT_NEAR((flat.point_b - Vec3(7, -2, 0)).norm(), 0, 1e-15);

    auto rng = generator(22);
    for (int k = 0; k < 200; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 3, 9);
        const Pose pose = random_pose(rng, 2);
        const Separation s = ellipsoid_shape_distance(a, {plane(), pose});
        const Vec3 n = pose.orientation * Vec3::UnitZ();
        EXPECT_NEAR(s.gap, n.dot(a.center - pose.position) - support(a, n), 1e-12);
        expect_whole(s, 10);
        const Vec3 local = a.axes.transpose() * (s.point_a - a.center);
        EXPECT_NEAR(local.cwiseQuotient(a.radii).norm(), 1, 1e-9);  // on the surface
    }
}

TEST(shape_distance, balls_have_closed_forms_against_every_shape) {
    auto rng = generator(23);
    for (int k = 0; k < 2000; ++k) {
        Ellipsoid ball = random_ellipsoid(rng, 2, 1);
        ball.radii.setConstant(uniform(rng, 0.1, 0.8));
        const auto kind = std::array{ShapeKind::plane, ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule}[k % 4];
        const PlacedShape b{random_shape(rng, kind), random_pose(rng, 0.5)};
        const Separation closed = point_shape_distance(ball.center, b);
        expect_whole(closed, 10);
        const Separation s = ellipsoid_shape_distance(ball, b);
        EXPECT_NEAR(s.gap, closed.gap - ball.radii[0], 1e-9) << name(kind);
        const Manifold m = rigid_contacts({sphere(ball.radii[0]), {ball.center, Quat(ball.axes)}}, b);
        ASSERT_EQ(m.count, 1);
        EXPECT_NEAR(m.points[0].gap, closed.gap - ball.radii[0], 1e-12);
        expect_whole(m.points[0], 10);
    }
}

TEST(shape_distance, faces_edges_and_corners_of_a_box_each_have_their_normal) {
    Ellipsoid ball;
    ball.radii.setConstant(0.5);
    const PlacedShape b{box(Vec3(1, 2, 3)), Pose()};
    ball.center = Vec3(0.3, 0.2, 4);
    Separation s = ellipsoid_shape_distance(ball, b);
    EXPECT_EQ(s.normal, Vec3::UnitZ());
    EXPECT_NEAR(s.gap, 0.5, 1e-14);
    ball.center = Vec3(2, 0.2, 4);
    s = ellipsoid_shape_distance(ball, b);
    EXPECT_NEAR((s.normal - Vec3(1, 0, 1).normalized()).norm(), 0, 1e-9);
    EXPECT_NEAR(s.gap, std::sqrt(2) - 0.5, 1e-12);
    EXPECT_NEAR((s.point_b - Vec3(1, 0.2, 3)).norm(), 0, 1e-9);
    ball.center = Vec3(2, -3, 4);
    s = ellipsoid_shape_distance(ball, b);
    EXPECT_NEAR((s.normal - Vec3(1, -1, 1).normalized()).norm(), 0, 1e-9);
    EXPECT_NEAR((s.point_b - Vec3(1, -2, 3)).norm(), 0, 1e-12);
}

TEST(shape_distance, what_is_deep_inside_is_pushed_out_the_shortest_way) {
    Ellipsoid e;
    e.radii = Vec3(0.3, 0.2, 0.1);
    e.center = Vec3(0.1, 1.5, 0.2);  // nearest to the face y = 2 of the box
    Separation s = ellipsoid_shape_distance(e, {box(Vec3(1, 2, 3)), Pose()});
    EXPECT_NEAR(s.gap, -0.7, 1e-12);
    EXPECT_EQ(s.normal, Vec3::UnitY());
    e.center = Vec3(0, 0, 0.4);  // on the axis of a capsule: across it
    s = ellipsoid_shape_distance(e, {capsule(0.5, 2), Pose()});
    EXPECT_NEAR(s.gap, -0.7, 1e-9);
    EXPECT_NEAR(std::abs(s.normal.y()), 1, 1e-6);
    for (const Shape& shape : std::vector{sphere(1), box(Vec3::Ones()), capsule(0.5, 1)}) {
        e.center.setZero();  // no direction to start from
        s = ellipsoid_shape_distance(e, {shape, Pose()});
        expect_whole(s, 1);
        EXPECT_LT(s.gap, 0);
        const Manifold m = rigid_contacts({sphere(0.1), Pose()}, {shape, Pose()});
        expect_whole(m.points[0], 1);
        const Manifold n = rigid_contacts({box(Vec3::Constant(0.1)), Pose()}, {shape, Pose()});
        ASSERT_GT(n.count, 0);
        for (int k = 0; k < n.count; ++k) expect_whole(n.points[k], 1);
    }
}

TEST(shape_distance, a_box_meets_a_plane_with_its_corners) {
    const Manifold m = rigid_contacts({box(Vec3(1, 2, 3)), {Vec3(0, 0, 3.5), Quat::Identity()}}, {plane(), Pose()});
    ASSERT_EQ(m.count, 8);
    int low = 0;
    for (int k = 0; k < 8; ++k) {
        expect_whole(m.points[k], 10);
        low += std::abs(m.points[k].gap - 0.5) < 1e-14;
        EXPECT_TRUE(std::abs(m.points[k].gap - 0.5) < 1e-14 || std::abs(m.points[k].gap - 6.5) < 1e-14);
    }
    EXPECT_EQ(low, 4);
}

TEST(shape_distance, boxes_stacked_face_to_face_keep_every_corner_of_the_overlap) {
    const PlacedShape lower{box(Vec3(1, 1, 1)), Pose()};
    PlacedShape upper{box(Vec3(0.5, 0.5, 0.5)), {Vec3(0.2, 0, 1.49), Quat::Identity()}};
    Manifold m = rigid_contacts(upper, lower);
    ASSERT_EQ(m.count, 4);
    for (int k = 0; k < 4; ++k) {
        EXPECT_NEAR(m.points[k].gap, -0.01, 1e-12);
        EXPECT_EQ(m.points[k].normal, Vec3::UnitZ());
        expect_whole(m.points[k], 1);
    }
    // Equal squares turned by 45 degrees share an octagon.
    upper = {box(Vec3(1, 1, 0.5)), {Vec3(0, 0, 1.51), Quat(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitZ()))}};
    m = rigid_contacts(upper, lower);
    ASSERT_EQ(m.count, 8);
    for (int k = 0; k < 8; ++k) {
        EXPECT_NEAR(m.points[k].gap, 0.01, 1e-12);
        EXPECT_NEAR(m.points[k].point_a.head<2>().norm(), std::sqrt(4 - 2 * std::sqrt(2)), 1e-9);  // its circumradius
    }
}

TEST(shape_distance, crossed_edges_of_boxes_touch_in_one_point) {
    const Quat upright(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX()));
    const PlacedShape lower{box(Vec3(2, 1, 1)), {Vec3::Zero(), upright}};  // ridge along x at z = sqrt 2
    const Quat across = Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())) * upright;
    for (const double gap : {-0.05, 0.05}) {
        const PlacedShape upper{box(Vec3(2, 1, 1)), {Vec3(0.3, 0.2, 2 * std::sqrt(2) + gap), across}};
        const Manifold m = rigid_contacts(upper, lower);
        ASSERT_EQ(m.count, 1);
        EXPECT_NEAR(m.points[0].gap, gap, 1e-12);
        EXPECT_NEAR((m.points[0].normal - Vec3::UnitZ()).norm(), 0, 1e-9);
        EXPECT_NEAR((m.points[0].point_a.head<2>() - Eigen::Vector2d(0.3, 0)).norm(), 0, 1e-9);
    }
}

class BoxAgainst : public testing::TestWithParam<ShapeKind> {};

TEST_P(BoxAgainst, the_deepest_point_agrees_with_a_brute_force_search) {
    auto rng = generator(24);
    int overlapping = 0;
    constexpr int kPairs = 300;
    for (int k = 0; k < kPairs; ++k) {
        const PlacedShape a{random_shape(rng, ShapeKind::box), random_pose(rng, 2)};
        const PlacedShape b{random_shape(rng, GetParam()), random_pose(rng, 0.5)};
        const double truth = brute_force_gap(a, b);
        overlapping += truth < 0;
        const Manifold m = rigid_contacts(a, b);
        ASSERT_GE(m.count, 1);
        for (int c = 0; c < m.count; ++c) {
            expect_whole(m.points[c], 10);
            // No point may lie deeper than the solids overlap along its normal.
            const Vec3 n = m.points[c].normal;
            EXPECT_GE(m.points[c].gap, n.dot(a.pose.position - b.pose.position) - support(a, n) - support(b, n) - 1e-9);
        }
        // A face stands for an edge that is shallower by less than 2 percent; the oracle is short by 1e-3.
        if (truth > 0) {
            EXPECT_NEAR(m.least_gap(), truth, 2e-3 + 0.03 * truth) << k;
        }
        if (truth > -1e-3) continue;
        // Pushed out of their deepest point again and again, the solids part, and on about the shortest way.
        Vec3 way = Vec3::Zero();
        PlacedShape moved = a;
        for (int push = 0; push < 30; ++push) {
            const Manifold now = rigid_contacts(moved, b);
            int deepest = 0;
            for (int c = 1; c < now.count; ++c)
                if (now.points[c].gap < now.points[deepest].gap) deepest = c;
            const double depth = std::max(0.0, -now.points[deepest].gap);
            way += depth * now.points[deepest].normal;
            moved.pose.position = a.pose.position + way;
        }
        EXPECT_GT(brute_force_gap(moved, b), -0.02) << k;
        EXPECT_LT(way.norm(), -truth * 1.25 + 0.01) << k;
    }
    EXPECT_GT(overlapping, kPairs / 10);
    EXPECT_LT(overlapping, kPairs * 9 / 10);
}
INSTANTIATE_TEST_SUITE_P(Shapes, BoxAgainst, testing::Values(ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule),
                         [](const auto& info) { return std::string(name(info.param)); });

TEST(shape_distance, a_capsule_lying_on_a_box_rests_on_two_points) {
    const PlacedShape slab{box(Vec3(1, 1, 0.5)), Pose()};
    const Quat lying(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY()));
    for (const double gap : {-0.05, 0.05}) {
        const Manifold m = rigid_contacts(slab, {capsule(0.25, 3), {Vec3(0.2, 0.1, 0.75 + gap), lying}});
        ASSERT_EQ(m.count, 2);
        for (int k = 0; k < 2; ++k) {
            EXPECT_NEAR(m.points[k].gap, gap, 1e-12);
            EXPECT_NEAR((m.points[k].normal + Vec3::UnitZ()).norm(), 0, 1e-12);  // pushes the box down
            EXPECT_NEAR(std::abs(m.points[k].point_a.x()), 1, 1e-9);             // over the ends of the face
        }
    }
}

TEST(shape_distance, boxes_and_radii_bound_their_shapes) {
    auto rng = generator(25);
    for (int k = 0; k < 300; ++k) {
        const auto kind = std::array{ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule}[k % 3];
        const PlacedShape s{random_shape(rng, kind), random_pose(rng, 2)};
        const Aabb box = bounding_box(s);
        for (int i = 0; i < 3; ++i) {
            EXPECT_NEAR(box.max[i], s.pose.position[i] + support(s, Vec3::Unit(i)), 1e-12);
            EXPECT_NEAR(box.min[i], s.pose.position[i] - support(s, -Vec3::Unit(i)), 1e-12);
        }
        EXPECT_GE(bounding_radius(s.shape), support(s, random_direction(rng)));
    }
}

}  // namespace
}  // namespace sunder
