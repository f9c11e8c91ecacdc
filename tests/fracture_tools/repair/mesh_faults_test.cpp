#include "fracture_tools/repair/mesh_faults.h"

#include <gtest/gtest.h>

#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::joined;
using testing::make_box;

const MeshFault* find(const MeshFaults& found, MeshFaultKind kind) {
    for (const MeshFault& f : found.faults)
        if (f.kind == kind) return &f;
    return nullptr;
}

TEST(MeshFaults, a_mesh_in_order_has_none) {
    const MeshFaults found = find_mesh_faults(make_box());
    EXPECT_TRUE(found.faults.empty());
    EXPECT_TRUE(found.faces.triangles.empty());
}

TEST(MeshFaults, faces_beside_a_missing_one_are_listed_with_their_places) {
    TriMesh box = make_box();
    box.triangles.erase(box.triangles.begin());  // {0, 2, 3} of the floor
    const MeshFaults found = find_mesh_faults(box);
    const MeshFault* open = find(found, MeshFaultKind::open_edge);
    ASSERT_TRUE(open);
    EXPECT_EQ(open->count, 3u);
    ASSERT_EQ(open->triangles.size(), 3u);
    for (uint32_t t : open->triangles) {
        int on_floor = 0;
        for (uint32_t v : found.faces.triangles[t]) on_floor += found.faces.positions[v].z() == 0;
        EXPECT_GE(on_floor, 2) << "an edge of the hole belongs to it";
    }
    EXPECT_EQ(fault_text(*open).find("3 open edges, first near ("), 0u);
}

TEST(MeshFaults, crossings_are_found_beyond_what_the_topology_tells) {
    const MeshFaults found = find_mesh_faults(joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1)));
    EXPECT_TRUE(found.report.is_solid());
    const MeshFault* crossing = find(found, MeshFaultKind::crossing);
    ASSERT_TRUE(crossing);
    EXPECT_EQ(crossing->count, crossing->triangles.size());
    EXPECT_GT(crossing->count, 4u);
    EXPECT_LT(crossing->count, 24u) << "faces that nothing crosses are not listed";
}

TEST(MeshFaults, solids_that_share_an_edge_or_a_corner_do_not_cross_there) {
    for (const Vec3& shift : {Vec3(1, 1, 0), Vec3(1, 1, 1)})
        EXPECT_FALSE(find(find_mesh_faults(joined(make_box(), make_box(), shift)), MeshFaultKind::crossing));
}

TEST(MeshFaults, bad_numbers_are_one_fault_and_nothing_is_computed_from_them) {
    TriMesh box = make_box();
    box.positions[2].x() = std::nan("");
    const MeshFaults found = find_mesh_faults(box);
    ASSERT_EQ(found.faults.size(), 1u);
    EXPECT_EQ(found.faults[0].kind, MeshFaultKind::bad_number);
    EXPECT_TRUE(found.faces.triangles.empty());
}

}  // namespace
}  // namespace sunder
