#include "nodes/mesh_frame_file.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "nodes/ply_file.h"

namespace sunder {
namespace {

// Two triangles of two materials that share an edge and a UV.
VisualMesh example() {
    VisualMesh m;
    m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1f, 1.0f / 3, 16777216.0f}};
    m.triangles = {{0, 1, 2}, {2, 1, 3}};
    for (int c = 0; c < 6; ++c) m.corner_normals.push_back(Vec3f(0, 0, c < 3 ? 1.0f : -1.0f));
    for (int c = 0; c < 6; ++c) m.corner_uvs.push_back(Vec2f(static_cast<float>(c % 2), 0.7f));
    m.triangle_material = {0, 1};
    m.triangle_fragment = {5, 6};
    m.vertex_fragment = {5, 5, 6, 6};
    return m;
}

FragmentSet fragments() {
    FragmentSet set;
    set.material_names = {"old clay"};
    set.interior_material = 1;
    return set;
}

TEST(MeshFrameFile, ply_holds_what_the_mesh_holds) {
    const VisualMesh m = example();
    const auto file = PlyFile::parse(std::string(encode_mesh_ply(m).view()), "a.ply");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_TRUE(file->has_comment(kMeshFileMagic));
    const PlyElement *vertex = file->find("vertex"), *face = file->find("face");
    ASSERT_TRUE(vertex && face);
    EXPECT_EQ(face->count, 2u);
    const char* row = file->rows(*vertex) + 3 * PlyFile::row_bytes(*vertex);
    EXPECT_EQ(read_number<float>(row + 4), m.positions[3].y());
    EXPECT_EQ(read_number<int32_t>(row + 12), 6);
    // A face: 1 + 3 ints, material, fragment, 1 + 6 floats, 1 + 9 floats.
    const size_t bytes = 1 + 12 + 8 + 1 + 24 + 1 + 36;
    row = file->rows(*face) + bytes;
    EXPECT_EQ(read_number<int32_t>(row + 1), 2);
    EXPECT_EQ(read_number<int32_t>(row + 13), 1);
    EXPECT_EQ(read_number<int32_t>(row + 17), 6);
    EXPECT_EQ(read_number<float>(row + 26), 0.7f);
    EXPECT_EQ(read_number<float>(row + 47 + 8), -1.0f);
}

TEST(MeshFrameFile, ply_without_uvs_has_no_texcoord) {
    VisualMesh m = example();
    m.corner_uvs.clear();
    const auto file = PlyFile::parse(std::string(encode_mesh_ply(m).view()), "a.ply");
    ASSERT_TRUE(file) << file.error().text();
    for (const PlyProperty& p : file->find("face")->properties) EXPECT_NE(p.name, "texcoord");
}

TEST(MeshFrameFile, obj_reads_back_to_the_same_floats) {
    const VisualMesh m = example();
    std::istringstream text{std::string(encode_mesh_obj(m, fragments()).view())};
    std::vector<Vec3f> positions;
    std::vector<std::string> faces, materials;
    size_t n_uvs = 0, n_normals = 0;
    for (std::string line; std::getline(text, line);) {
        std::istringstream words(line);
        std::string keyword, x, y, z;
        words >> keyword;
        if (keyword == "v") words >> x >> y >> z, positions.push_back({std::stof(x), std::stof(y), std::stof(z)});
        if (keyword == "vt") ++n_uvs;
        if (keyword == "vn") ++n_normals;
        if (keyword == "f") faces.push_back(line);
        if (keyword == "usemtl") materials.push_back(line);
    }
    EXPECT_EQ(positions, m.positions);
    EXPECT_EQ(n_uvs, 2u);  // each written once
    EXPECT_EQ(n_normals, 2u);
    EXPECT_EQ(faces, (std::vector<std::string>{"f 1/1/1 2/2/1 3/1/1", "f 3/2/2 2/1/2 4/2/2"}));
    EXPECT_EQ(materials, (std::vector<std::string>{"usemtl old_clay", "usemtl interior"}));
}

TEST(MeshFrameFile, what_cannot_be_written_is_refused) {
    VisualMesh m = example();
    EXPECT_TRUE(encode_mesh("a.ply", m, fragments()));
    EXPECT_TRUE(encode_mesh("a.obj", m, fragments()));
    EXPECT_EQ(encode_mesh("a.abc", m, fragments()).error().code, ErrorCode::bad_input);
    m.positions[2].y() = std::numeric_limits<float>::quiet_NaN();
    const auto bad = encode_mesh("a.ply", m, fragments());
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, ErrorCode::numerical);
    EXPECT_NE(bad.error().what.find("vertex 2"), std::string::npos);
}

TEST(MeshFrameFile, an_empty_mesh_is_a_whole_file) {
    EXPECT_TRUE(PlyFile::parse(std::string(encode_mesh_ply({}).view()), "a.ply"));
}

}  // namespace
}  // namespace sunder
