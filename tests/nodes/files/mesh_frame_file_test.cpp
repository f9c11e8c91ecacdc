#include "nodes/files/mesh_frame_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>
#include <sstream>

#include "fracture_tools/skin/skinning.h"
#include "nodes/files/mesh_frame_reader.h"
#include "nodes/files/ply_file.h"

namespace sunder {
namespace {

// Two triangles of two materials that share an edge and a UV.
VisualMesh example() {
    VisualMesh m;
    m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1f, 1.0f / 3, 16777216.0f}};
    m.triangles = {{0, 1, 2}, {2, 1, 3}};
    std::vector<Vec3f> normals;
    std::vector<Vec2f> uvs;
    for (int c = 0; c < 6; ++c) normals.push_back(Vec3f(0, 0, c < 3 ? 1.0f : -1.0f));
    for (int c = 0; c < 6; ++c) uvs.push_back(Vec2f(static_cast<float>(c % 2), 0.7f));
    m.corner_normals = normals, m.corner_uvs = uvs;
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
    const auto file = PlyFile::parse(std::string(encode_mesh_ply(m, fragments()).view()), "a.ply");
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

TEST(MeshFrameFile, ply_tells_velocities_hidden_faces_and_materials) {
    VisualMesh m = example();
    m.velocities = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
    m.triangle_hidden = {0, 1};
    const auto file = PlyFile::parse(std::string(encode_mesh_ply(m, fragments()).view()), "a.ply");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_TRUE(file->has_comment("material 0 old clay"));
    EXPECT_TRUE(file->has_comment("material 1 interior"));
    const PlyElement *vertex = file->find("vertex"), *face = file->find("face");
    EXPECT_EQ(read_number<float>(file->rows(*vertex) + 2 * PlyFile::row_bytes(*vertex) + 20), 8.0f);
    EXPECT_EQ(face->properties[3].name, "hidden");
    const size_t bytes = 1 + 12 + 8 + 1 + 1 + 24 + 1 + 36;
    EXPECT_EQ(read_number<uint8_t>(file->rows(*face) + bytes + 21), 1);
}

TEST(MeshFrameFile, ply_reads_back_to_the_same_mesh) {
    VisualMesh full = example();
    full.velocities = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
    full.accelerations = {{-1, -2, -3}, {-4, -5, -6}, {-7, -8, -9}, {-10, -11, -12}};
    full.triangle_hidden = {0, 1};
    VisualMesh plain = example();
    plain.corner_uvs = {};
    for (const VisualMesh& m : {full, plain, VisualMesh()}) {
        const auto frame = decode_mesh_ply(std::string(encode_mesh_ply(m, fragments()).view()), "a.ply");
        ASSERT_TRUE(frame) << frame.error().text();
        EXPECT_EQ(frame->mesh.positions, m.positions);
        EXPECT_EQ(frame->mesh.velocities, m.velocities);
        EXPECT_EQ(frame->mesh.accelerations, m.accelerations);
        EXPECT_EQ(frame->mesh.triangles, m.triangles);
        EXPECT_EQ(frame->mesh.corner_normals, m.corner_normals);
        EXPECT_EQ(frame->mesh.corner_uvs, m.corner_uvs);
        EXPECT_EQ(frame->mesh.triangle_material, m.triangle_material);
        EXPECT_EQ(frame->mesh.triangle_fragment, m.triangle_fragment);
        EXPECT_EQ(frame->mesh.triangle_hidden, m.triangle_hidden);
        EXPECT_EQ(frame->mesh.vertex_fragment, m.vertex_fragment);
        EXPECT_EQ(frame->materials, (std::vector<std::string>{"old clay", "interior"}));
    }
}

TEST(MeshFrameFile, rest_positions_are_those_of_the_mesh_that_was_cut) {
    VisualMesh m = example();
    FragmentSet set = fragments();
    set.vertices = {{0, 0, 0}, {1, 2, 3}, {0.1, 0.2, 0.3}};
    SkinChunk first, second;
    first.vertex = {{2, 0, 0}, {1, 0, 0}}, second.vertex = {{1, 0, 0}, {0, 0, 0}};
    SkinBinding skin;
    skin.chunks = {std::make_shared<SkinChunk>(first), std::make_shared<SkinChunk>(second)};
    skin.first_vertex = {0, 2, 4};
    m.skin = std::make_shared<SkinBinding>(skin);
    const auto frame = decode_mesh_ply(std::string(encode_mesh_ply(m, set).view()), "a.ply");
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_EQ(frame->mesh.rest_positions, (SharedArray<Vec3f>{{0.1f, 0.2f, 0.3f}, {1, 2, 3}, {1, 2, 3}, {0, 0, 0}}));
    EXPECT_EQ(frame->mesh.positions, m.positions);
    EXPECT_EQ(frame->mesh.vertex_fragment, m.vertex_fragment);
    EXPECT_EQ(encode_mesh_ply(frame->mesh, fragments()).view(), encode_mesh_ply(m, set).view());
}

TEST(MeshFrameFile, layers_read_back_to_the_same_bits_under_the_same_names) {
    VisualMesh m = example();
    m.velocities = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
    const auto add = [&](LayerId id, size_t n_rows) {
        std::vector<float> values;
        for (uint32_t k = 0; k < n_rows * id.width; ++k) {
            const uint32_t number = 0x7fc00001u - 3 * k;  // as floats some of these are none
            values.push_back(id.is_blended() ? 0.1f * float(k) : std::bit_cast<float>(number));
        }
        m.layers.push_back({std::move(id), std::move(values)});
    };
    add({"heat map", LayerDomain::point, LayerKind::number, 1}, 4);
    add({"gr\u00fcn", LayerDomain::point, LayerKind::weight, 1}, 4);
    add({"pair", LayerDomain::point, LayerKind::integer, 2}, 4);
    add({"Wall.001", LayerDomain::corner, LayerKind::uv, 2}, 6);
    add({"number", LayerDomain::corner, LayerKind::integer, 1}, 6);
    add({"tint", LayerDomain::face, LayerKind::color, 4}, 2);
    add({"flag", LayerDomain::face, LayerKind::boolean, 1}, 2);
    const std::string bytes(encode_mesh_ply(m, fragments()).view());
    const auto frame = decode_mesh_ply(bytes, "a.ply");
    ASSERT_TRUE(frame) << frame.error().text();
    ASSERT_EQ(frame->mesh.layers.size(), m.layers.size());
    for (size_t k = 0; k < m.layers.size(); ++k) {
        const VisualLayer &read = frame->mesh.layers[k], &written = m.layers[k];
        EXPECT_EQ(static_cast<const LayerId&>(read), static_cast<const LayerId&>(written));
        ASSERT_EQ(read.values.size(), written.values.size());
        EXPECT_EQ(std::memcmp(read.values.data(), written.values.data(), 4 * read.values.size()), 0) << read.name;
    }
    EXPECT_EQ(std::string(encode_mesh_ply(frame->mesh, fragments()).view()), bytes);
    EXPECT_EQ(frame->mesh.velocities, m.velocities);
    for (size_t n = 0; n < bytes.size(); ++n) ASSERT_FALSE(decode_mesh_ply(bytes.substr(0, n), "a.ply")) << n;
}

// Libraries of materials make headers of any length.
TEST(MeshFrameFile, many_names_of_materials_read_back) {
    FragmentSet many;
    many.interior_material = 5000;
    for (int k = 0; k < many.interior_material; ++k)
        many.material_names.push_back(std::string(200, 'n') + std::to_string(k));
    const auto frame = decode_mesh_ply(std::string(encode_mesh_ply(example(), many).view()), "a.ply");
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_EQ(frame->materials.size(), 5001u);
    EXPECT_EQ(frame->materials[4999], many.material_names[4999]);
}

TEST(MeshFrameFile, what_is_no_mesh_frame_is_refused) {
    const std::string whole(encode_mesh_ply(example(), fragments()).view());
    for (size_t n = 0; n < whole.size(); ++n) ASSERT_FALSE(decode_mesh_ply(whole.substr(0, n), "a.ply")) << n;
    const auto refused = [&](const VisualMesh& m) {
        return !decode_mesh_ply(std::string(encode_mesh_ply(m, fragments()).view()), "a.ply");
    };
    VisualMesh m = example();
    m.triangles = {{0, 1, 2}, {2, 1, 4}};
    EXPECT_TRUE(refused(m));
    m = example(), m.triangle_material = {2, 1};
    EXPECT_TRUE(refused(m));
    std::string foreign = whole;
    foreign.replace(foreign.find(kMeshFileMagic), kMeshFileMagic.size(), "sunder mesh frame 9");
    EXPECT_FALSE(decode_mesh_ply(foreign, "a.ply"));
    std::string uneven = whole;  // a list of normals that says 8: the file's length no longer fits
    uneven[uneven.size() - 37] = 8;
    EXPECT_FALSE(decode_mesh_ply(uneven, "a.ply"));
}

TEST(MeshFrameFile, ply_without_uvs_has_no_texcoord) {
    VisualMesh m = example();
    m.corner_uvs = {};
    const auto file = PlyFile::parse(std::string(encode_mesh_ply(m, fragments()).view()), "a.ply");
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

TEST(MeshFrameFile, obj_keeps_materials_apart) {
    VisualMesh m = example();
    m.triangles = {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}};
    m.corner_normals = std::vector<Vec3f>(15, Vec3f(0, 0, 1)), m.corner_uvs = std::vector<Vec2f>(15, Vec2f(0, 0));
    m.triangle_material = {0, 1, 2, 3, 4};
    FragmentSet set;
    set.material_names = {"a b", "a_b", "interior", "a_b_2"};
    set.interior_material = 4;
    std::istringstream text(std::string(encode_mesh_obj(m, set).view()));
    std::vector<std::string> names;
    for (std::string word; text >> word;)
        if (word == "usemtl") names.emplace_back(), text >> names.back();
    EXPECT_EQ(names, (std::vector<std::string>{"a_b", "a_b_2", "interior_2", "a_b_2_2", "interior"}));
}

TEST(MeshFrameFile, what_cannot_be_written_is_refused) {
    VisualMesh m = example();
    EXPECT_TRUE(encode_mesh("a.ply", m, fragments()));
    EXPECT_TRUE(encode_mesh("a.obj", m, fragments()));
    EXPECT_EQ(encode_mesh("a.abc", m, fragments()).error().code, ErrorCode::bad_input);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    m.positions = {{0, 0, 0}, {1, 0, 0}, {0, nan, 0}, {0, 1, 1}};
    const auto bad = encode_mesh("a.ply", m, fragments());
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, ErrorCode::numerical);
    EXPECT_NE(bad.error().what.find("vertex 2"), std::string::npos);
}

TEST(MeshFrameFile, an_empty_mesh_is_a_whole_file) {
    EXPECT_TRUE(PlyFile::parse(std::string(encode_mesh_ply({}, {}).view()), "a.ply"));
}

}  // namespace
}  // namespace sunder
