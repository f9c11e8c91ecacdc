// Layers in PLY files: names as artists write them, rows where they belong, damage told.
#include "fracture_tools/mesh/layer_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "fracture_tools/mesh/layer_property.h"
#include "fracture_tools/mesh/polygon_files.h"

namespace sunder {
namespace {

TEST(LayerProperty, any_name_comes_back_exactly) {
    for (const std::string name :
         {"Wall .001", "gr\u00fcn", "\u7126\u3052", " 100% a:b ", "a\nb\t\"c\"", "%20", "-._~", ""}) {
        const LayerId layer{name, LayerDomain::corner, LayerKind::uv, 2};
        const std::string property = layer_property(layer);
        for (const char c : property) EXPECT_TRUE(c > ' ' && c < 0x7f) << property;
        const auto read = layer_of_property(property, true, false);
        ASSERT_TRUE(read) << property;
        EXPECT_EQ(read->name, name);
        EXPECT_EQ(std::pair(read->domain, read->kind), std::pair(layer.domain, layer.kind));
    }
    EXPECT_EQ(layer_property({"Wall .001", LayerDomain::corner, LayerKind::uv, 2}), "corner_uv:Wall%20.001");
}

TEST(LayerProperty, what_does_not_fit_is_no_layer) {
    EXPECT_TRUE(layer_of_property("point_weight:a", false, false));
    EXPECT_FALSE(layer_of_property("point_weight:a", true, false));  // of faces
    EXPECT_FALSE(layer_of_property("face_weight:a", true, false));
    EXPECT_FALSE(layer_of_property("point_uv:a", false, false));
    EXPECT_FALSE(layer_of_property("face_int:a", true, false));  // numbers that are not whole
    EXPECT_FALSE(layer_of_property("face_float:a", true, true));
    for (const char* other : {"temperature", "point_float", "edge_float:a", "point_thing:a"})
        EXPECT_FALSE(layer_of_property(other, false, false)) << other;
}

// A square pyramid: a quadrangle and four triangles; the apex is there twice.
constexpr const char* kPyramid = R"(ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
property float temperature
property float point_float:heat%20map
property list uchar int point_int:pair
element face 5
property list uchar int vertex_indices
property list uchar float corner_uv:Wall
property int face_bool:top
end_header
0 0 0 7 0 2 1 -1
1 0 0 7 0.5 2 2 -2
1 1 0 7 1 2 3 -3
0 1 0 7 1.5 2 4 -4
0.5 0.5 1 7 2 2 2000000001 -5
0.5 0.5 1 7 99 2 99 99
4 0 3 2 1  8 0 0 0 3 0 2 0 1  1
3 0 1 4  6 1 0 1 1 1 4  0
3 1 2 5  6 2 1 2 2 2 5  0
3 2 3 4  6 3 2 3 3 3 4  0
3 3 0 5  6 4 3 4 0 4 5  3
)";

// Beyond 64 bits: once turned into an integer, which is nothing that a language promises.
TEST(LayerReader, what_no_integer_holds_is_none) {
    std::string huge = kPyramid;
    const std::string row = "0 2 1 -1\n";
    huge.replace(huge.find(row), row.size(), "0 2 1 -1" + std::string(100, '7') + "\n");
    const Result<TriMesh> mesh = read_ply(huge, "a.ply", 1);
    ASSERT_TRUE(mesh) << mesh.error().text();
    const auto pair = std::ranges::find(mesh->layers, std::string("pair"), &MeshLayer::name);
    ASSERT_NE(pair, mesh->layers.end());
    EXPECT_EQ(std::bit_cast<int32_t>(pair->values[0]), 1);
    EXPECT_EQ(std::bit_cast<int32_t>(pair->values[1]), 0);
}

TEST(LayerReader, rows_follow_vertices_corners_and_faces_through_welding_and_triangulation) {
    const Result<TriMesh> mesh = read_ply(kPyramid, "a.ply", 1);
    ASSERT_TRUE(mesh) << mesh.error().text();
    ASSERT_EQ(mesh->positions.size(), 5u);
    ASSERT_EQ(mesh->triangles.size(), 6u);
    ASSERT_EQ(mesh->layers.size(), 4u);
    EXPECT_TRUE(mesh->vertex_attributes.contains("temperature"));
    EXPECT_EQ(mesh->vertex_attributes.size(), 1u);
    const MeshLayer &heat = mesh->layers[0], &pair = mesh->layers[1], &wall = mesh->layers[2], &top = mesh->layers[3];
    EXPECT_EQ(heat.name, "heat map");
    EXPECT_EQ(heat.values, (std::vector<float>{0, 0.5f, 1, 1.5f, 2}));  // of those at one position the first
    EXPECT_EQ(pair.width, 2u);
    EXPECT_EQ(std::bit_cast<int32_t>(pair.row(4)[0]), 2000000001);
    EXPECT_EQ(std::bit_cast<int32_t>(pair.row(4)[1]), -5);
    ASSERT_EQ(wall.n_rows(), 18u);
    ASSERT_EQ(top.n_rows(), 6u);
    for (uint32_t t = 0; t < 6; ++t) {
        const int face = t < 2 ? 0 : int(t) - 1;
        EXPECT_EQ(std::bit_cast<int32_t>(*top.row(t)), face == 0 || face == 4);
        for (uint32_t c = 0; c < 3; ++c) {
            EXPECT_EQ(wall.row(3 * t + c)[0], float(face));
            EXPECT_EQ(wall.row(3 * t + c)[1],
                      mesh->triangles[t][c] == 4 && face % 2 == 0 ? 5.0f : float(mesh->triangles[t][c]));
        }
    }
}

TEST(LayerReader, rows_of_another_length_are_refused_by_name) {
    const auto refusal = [](std::string from, const std::string& to) {
        std::string text = kPyramid;
        text.replace(text.find(from), from.size(), to);
        const Result<TriMesh> mesh = read_ply(text, "a.ply", 1);
        EXPECT_FALSE(mesh);
        return mesh ? std::string() : mesh.error().what;
    };
    EXPECT_NE(refusal("1 0 0 7 0.5 2 2 -2", "1 0 0 7 0.5 3 2 -2 8").find("vertex 1 has 3 numbers of 'point_int:pair'"),
              std::string::npos);
    EXPECT_NE(refusal("6 1 0 1 1 1 4", "4 1 0 1 1").find("face 1 has 4 numbers of 'corner_uv:Wall'"),
              std::string::npos);
    EXPECT_NE(refusal("8 0 0 0 3 0 2 0 1", "4 0 0 0 3").find("face 0 has 4 numbers of 'corner_uv:Wall'"),
              std::string::npos);
}

TEST(LayerReader, what_is_no_finite_number_is_0) {
    std::string text = kPyramid;
    text.replace(text.find("7 1.5 2"), 7, "7 nan 2");
    const Result<TriMesh> mesh = read_ply(text, "a.ply", 1);
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(mesh->layers[0].values[3], 0);
}

}  // namespace
}  // namespace sunder
