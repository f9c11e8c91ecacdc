// Surfaces on their way: distances against all triangles and winding numbers, motions that are those of one piece, and
// solids that no wall may pass.
#include "solver/collision/surface_distance.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "solver/collision/surface_contacts.h"
#include "solver/data/rotations.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

struct Numbers {
    std::mt19937_64 rng{7};
    double uniform(double low, double high) { return low + (high - low) * 0x1p-53 * double(rng() >> 11); }
    Vec3 vector(double most) {
        const double x = uniform(-most, most), y = uniform(-most, most);
        return {x, y, uniform(-most, most)};
    }
};

// Bent about the y axis, the more the farther along x, and blown up by a share.
std::vector<Vec3> bent(const TriMesh& mesh, double curvature, double blown = 0) {
    std::vector<Vec3> out;
    for (const Vec3& p : mesh.positions) {
        const double angle = curvature * p.x();
        out.push_back((1 + blown) * (rotation_about(Vec3::UnitY(), angle) * Vec3(0, p.y(), p.z()) + Vec3(p.x(), 0, 0)));
    }
    return out;
}

MovingSurface moving(const TriMesh& mesh, const std::vector<Vec3>& begin, const std::vector<Vec3>& end,
                     double thickness = 0) {
    return move_surface(make_surface_tree(mesh, thickness), begin, end);
}

Shape shape_of(const MovingSurface& surface, double share) {
    Shape s;
    s.kind = ShapeKind::mesh, s.surface = &surface, s.share = share;
    return s;
}

double winding_number(const SurfaceField& f, const Vec3& x) {
    double angle = 0;
    for (const Triangle& t : f.surface->tree->triangles) {
        const Vec3 a = f.surface->vertex(t[0], f.share) - x, b = f.surface->vertex(t[1], f.share) - x,
                   c = f.surface->vertex(t[2], f.share) - x;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (2 * std::numbers::pi);
}

// By many points of each triangle: never below the distance, and above by no more than their spacing.
double distance_to_points(const SurfaceField& f, const Vec3& x, double& o_spacing) {
    constexpr int kParts = 24;
    double least = 1e9;
    o_spacing = 0;
    for (const Triangle& t : f.surface->tree->triangles) {
        const Vec3 a = f.surface->vertex(t[0], f.share), b = f.surface->vertex(t[1], f.share),
                   c = f.surface->vertex(t[2], f.share);
        o_spacing = std::max({o_spacing, (b - a).norm() / kParts, (c - a).norm() / kParts, (c - b).norm() / kParts});
        for (int i = 0; i <= kParts; ++i)
            for (int j = 0; i + j <= kParts; ++j)
                least = std::min(least, (a + double(i) / kParts * (b - a) + double(j) / kParts * (c - a) - x).norm());
    }
    return least;
}

TEST(moving_surface, distances_are_those_of_the_deformed_triangles) {
    const TriMesh mesh = test::ring(0.6, 0.2, 12, 7);
    const MovingSurface s = moving(mesh, bent(mesh, 0.4), bent(mesh, -0.9, 0.3));
    const SurfaceField field(shape_of(s, 0.37));
    Numbers numbers;
    for (int k = 0; k < 300; ++k) {
        const Vec3 x = numbers.vector(1.1);
        const GridSample at = sample(field, x);
        double spacing;
        const double told = distance_to_points(field, x, spacing);
        EXPECT_LE(std::abs(at.distance), told + 1e-12);
        EXPECT_GE(std::abs(at.distance), told - spacing);
        EXPECT_EQ(at.distance<0, winding_number(field, x)> 0.5) << x.transpose();
        EXPECT_NEAR(at.gradient.norm(), 1, 1e-9);
        // The gradient leads to the surface.
        EXPECT_NEAR(sample(field, x - at.distance * at.gradient).distance, 0, 1e-9);
    }
}

TEST(moving_surface, a_sheet_with_a_thickness_has_two_sides) {
    TriMesh sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    const MovingSurface s = moving(sheet, sheet.positions, sheet.positions, 0.1);
    const SurfaceField field(shape_of(s, 0.5));
    for (const double z : {-0.3, -0.02, 0.0, 0.02, 0.3}) {
        const GridSample at = sample(field, Vec3(0.3, 0.4, z));
        EXPECT_NEAR(at.distance, std::abs(z) - 0.05, 1e-12);
        if (z == 0) continue;
        EXPECT_NEAR(at.gradient.z(), z > 0 ? 1 : -1, 1e-12);
    }
    EXPECT_NEAR(sample(field, Vec3(1.2, 0.5, 0)).distance, 0.15, 1e-12);
}

TEST(moving_surface, what_moves_as_one_is_not_deformed_and_turns_steadily) {
    const TriMesh mesh = test::block({-1, -0.5, -0.1}, {1, 0.5, 0.1});
    const Pose from{Vec3(3, 1, 0), rotation_about(Vec3(1, 2, 3).normalized(), 0.3)},
        to{Vec3(3.4, 1, 1), rotation_about(Vec3(1, 2, 3).normalized(), 1.7)};
    std::vector<Vec3> begin, end;
    for (const Vec3& p : mesh.positions) begin.push_back(from.apply(p)), end.push_back(to.apply(p));
    const MovingSurface s = moving(mesh, begin, end);
    EXPECT_LT(s.longest, 1e-14);
    for (size_t v = 0; v < begin.size(); ++v)
        EXPECT_LT((s.whole.apply(s.vertex(uint32_t(v), 1)) - end[v]).norm(), 1e-14);
    EXPECT_NEAR(angle_between(s.whole.orientation, Quat::Identity()), 1.4, 1e-12);
    EXPECT_EQ(moving(mesh, begin, begin).whole.orientation.coeffs(), Quat::Identity().coeffs());
    EXPECT_EQ(moving(mesh, begin, begin).end_key, s.begin_key);
}

TEST(moving_surface, boxes_of_a_tree_hold_its_triangles_at_every_moment) {
    const TriMesh mesh = test::ball(1, 3);
    const MovingSurface s = moving(mesh, bent(mesh, 0.1), bent(mesh, 1.3, 0.5));
    size_t leaves = 0;
    for (size_t n = 0; n < s.tree->nodes.size(); ++n) {
        const SurfaceTree::Node& node = s.tree->nodes[n];
        leaves += node.right == 0 ? node.end - node.begin : 0;
        for (const double share : {0.0, 0.3, 1.0})
            for (uint32_t t = node.begin; t < node.end; ++t)
                for (const uint32_t v : s.tree->triangles[t]) {
                    const Aabb box = s.box(n, share);
                    const Vec3 x = s.vertex(v, share);
                    EXPECT_TRUE(((box.min.array() - 1e-12) <= x.array()).all());
                    EXPECT_TRUE(((box.max.array() + 1e-12) >= x.array()).all());
                }
    }
    EXPECT_EQ(leaves, mesh.triangles.size());
}

// A plate 5 mm thick whose middle goes 50 mm in a step, its rim nowhere: what it comes upon gives a contact, and what
// it does not, none that pushes.
TEST(moving_surface, no_thin_wall_passes_what_it_comes_upon) {
    const TriMesh plate = test::terrain(1, 16, 0, [](double, double) { return 0.005; });
    std::vector<Vec3> end = plate.positions;
    const auto rise = [](const Vec3& p) { return 0.05 * (1 - 4 * p.x() * p.x()) * (1 - 4 * p.y() * p.y()); };
    for (Vec3& p : end) p.z() += rise(p);
    const MovingSurface s = moving(plate, plate.positions, end);
    const DrivenPose drive = drive_of(std::make_shared<const MovingSurface>(s));
    MovingShape mesh{shape_of(s, 0), drive.begin, drive.end, true, 1};
    Numbers numbers;
    int met = 0, missed = 0;
    for (int k = 0; k < 500; ++k) {
        Ellipsoid a;
        a.axes = rotation_about(numbers.vector(1).normalized(), numbers.uniform(0, 3)).toRotationMatrix();
        a.radii = Vec3(numbers.uniform(0.001, 0.004), 0.002, 0.003);
        a.center = Vec3(numbers.uniform(-0.45, 0.45), numbers.uniform(-0.45, 0.45), numbers.uniform(0.01, 0.08));
        std::vector<Separation> found;
        const Vec3 shift = mesh.begin.apply(mesh.end.inverse_apply(a.center)) - a.center;
        surface_contacts(a, mesh, shift, 1e-4, found);
        const double top = 0.005 + rise(a.center), low = a.center.z() - 0.001, high = a.center.z() - 0.004;
        bool closes = false;
        for (const Separation& c : found) {
            const Vec3 motion = surface_motion(mesh, c.point_b);
            closes |= c.normal.z() > 0.5 && c.gap - c.normal.dot(motion) < 1e-4;
            EXPECT_GT(c.normal.z(), 0.5) << "it is before the plate";
        }
        const bool meets = top - 0.001 > low, misses = top + 0.002 < high;
        EXPECT_TRUE(closes || !meets) << a.center.transpose();
        EXPECT_TRUE(!closes || !misses) << a.center.transpose();
        met += meets, missed += misses;
    }
    EXPECT_GT(met, 100);
    EXPECT_GT(missed, 100);
}

TEST(moving_surface, a_rigid_sphere_and_a_box_are_met_too) {
    const TriMesh plate = test::terrain(1, 8, 0, [](double, double) { return 0.005; });
    std::vector<Vec3> end = plate.positions;
    for (Vec3& p : end) p.z() += 0.1 * (0.25 - p.x() * p.x());
    const MovingSurface s = moving(plate, plate.positions, end);
    const DrivenPose drive = drive_of(std::make_shared<const MovingSurface>(s));
    const MovingShape mesh{shape_of(s, 0), drive.begin, drive.end, true, 1};
    for (const ShapeKind kind : {ShapeKind::sphere, ShapeKind::box}) {
        PlacedShape a;
        a.shape.kind = kind, a.shape.radius = 0.004, a.shape.half_extents = Vec3::Constant(0.004);
        a.pose.position = Vec3(0.02, 0, 0.02);
        std::vector<Separation> found;
        surface_contacts(a, mesh, mesh.begin.apply(mesh.end.inverse_apply(a.pose.position)) - a.pose.position, 1e-4,
                         found);
        ASSERT_FALSE(found.empty());
        EXPECT_GT(found[0].normal.z(), 0.9);
        EXPECT_NEAR(found[0].gap, 0.011, 5e-4);
        EXPECT_NEAR(surface_motion(mesh, found[0].point_b).z(), 0.025, 1e-3);
        found.clear();
        a.pose.position.z() = 0.05;
        surface_contacts(a, mesh, mesh.begin.apply(mesh.end.inverse_apply(a.pose.position)) - a.pose.position, 1e-4,
                         found);
        EXPECT_TRUE(found.empty());
    }
}

}  // namespace
}  // namespace sunder
