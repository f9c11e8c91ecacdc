#include "fracture_tools/repair/repair_shells.h"

#include <gtest/gtest.h>

#include "tests/fracture_tools/polygons.h"
#include "tests/fracture_tools/repair/repaired.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/ugly_meshes.h"

namespace sunder {
namespace {

using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_sheet;
using testing::placed;
using testing::refused;
using testing::Repaired;
using testing::repaired;
using testing::scaled;
using testing::tells;

/// Over [0, 1]^2 at z = 0, bent by as much.
TriMesh sheet(double bend = 0) {
    return make_sheet(5, [=](double x, double y) { return bend * x * (1 - x) * std::cos(4 * y); });
}

/// A sheet that reaches from wall to wall of the unit box, where the box has no vertices.
TriMesh membrane() {
    TriMesh mesh;
    mesh.positions = {Vec3(0.5, 0, 0), Vec3(0.5, 1, 0), Vec3(0.5, 1, 1), Vec3(0.5, 0, 1)};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

TriMesh at(TriMesh mesh, double angle, const Vec3& shift) {
    mesh.positions = placed(std::move(mesh.positions), angle, shift);
    return mesh;
}

void expect_dropped(const TriMesh& mesh, double volume, const char* told) {
    const Repaired r = repaired(mesh);
    EXPECT_NEAR(mesh_volume(r.mesh), volume, 1e-9 * volume);
    EXPECT_TRUE(tells(r, told));
    EXPECT_TRUE(tells(r, "within solid matter dropped, first near"));
}

TEST(BuriedSheets, are_dropped_wherever_the_body_lies) {
    const std::vector<TriMesh> sheets = {membrane(), at(scaled(sheet(), 0.3), 0.9, Vec3(0.5, 0.4, 0.5)),
                                         at(scaled(sheet(0.3), 0.3), 0.2, Vec3(0.5, 0.4, 0.5))};
    for (const TriMesh& inner : sheets)
        for (const TriMesh& outer : {make_box(), flipped(make_box())})
            for (double angle : {0.0, 0.7})
                for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(1e4, -300, 20)})
                    for (const TriMesh& mesh : {joined(outer, inner), joined(inner, outer)})
                        expect_dropped(at(mesh, angle, shift), 1, "1 open sheet");
}

TEST(BuriedSheets, go_however_many_there_are_and_holes_around_them_are_closed) {
    TriMesh mesh = joined(testing::make_torus(), scaled(sheet(0.2), 0.1), Vec3(0.3, -0.05, 0));
    for (double x : {-0.4, -0.36}) mesh = joined(mesh, scaled(sheet(), 0.1), Vec3(x, -0.05, 0.1 * x));
    expect_dropped(mesh, mesh_volume(testing::make_torus()), "3 open sheets");
    mesh.triangles.erase(mesh.triangles.begin() + 400);
    const Repaired r = repaired(mesh);
    EXPECT_TRUE(tells(r, "3 open sheets"));
    EXPECT_TRUE(tells(r, "1 hole closed"));
    EXPECT_NEAR(mesh_volume(r.mesh), mesh_volume(testing::make_torus()), 1e-12);
}

TEST(BuriedSheets, are_those_in_matter_and_not_those_in_a_cavity) {
    const TriMesh hollow = joined(make_box(), flipped(scaled(make_box(), 0.5)), Vec3::Constant(0.25));
    const TriMesh small = scaled(sheet(), 0.1);
    expect_dropped(joined(hollow, small, Vec3(0.1, 0.1, 0.1)), 0.875, "1 open sheet");
    EXPECT_NE(refused(joined(hollow, small, Vec3(0.4, 0.4, 0.4))).what.find("the mesh is open"), std::string::npos);
    // A solid within the cavity has a sheet of its own.
    const TriMesh nested = joined(hollow, scaled(make_box(), 0.25), Vec3::Constant(0.375));
    expect_dropped(joined(nested, small, Vec3(0.45, 0.45, 0.45)), 0.875 + 1.0 / 64, "1 open sheet");
    EXPECT_NE(refused(joined(nested, small, Vec3(0.26, 0.26, 0.26))).what.find("the mesh is open"), std::string::npos);
}

TEST(BuriedSheets, what_reaches_out_of_the_matter_is_refused_by_its_place) {
    const Error e = refused(joined(make_box(), sheet(), Vec3(0.5, 0.2, 0.3)));
    EXPECT_NE(e.what.find("the mesh is open: 20 boundary edges, first near (0.5 0.2 0.3)"), std::string::npos)
        << e.what;
    EXPECT_EQ(e.parameter, "thickness");
    EXPECT_NE(refused(joined(make_box(), sheet(), Vec3(0, 0, 2))).what.find("the mesh is open"), std::string::npos);
}

}  // namespace
}  // namespace sunder
