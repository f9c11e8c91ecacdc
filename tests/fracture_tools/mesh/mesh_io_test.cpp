#include "fracture_tools/mesh/mesh_io.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "fracture_tools/mesh/mesh_checks.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/temporary_meshes.h"

namespace sunder {
namespace {

class MeshIo : public testing::MeshFolder {
protected:
    /// Writes the bunny in another format through assimp.
    std::string exported(const std::string& id, const std::string& extension, const std::string& from) const {
        Assimp::Importer importer;
        const aiScene* scene = importer.ReadFile(from, aiProcess_Triangulate);
        EXPECT_TRUE(scene);
        const std::string path = (folder_ / ("mesh." + extension)).string();
        Assimp::Exporter exporter;
        EXPECT_EQ(exporter.Export(scene, id, path), aiReturn_SUCCESS) << exporter.GetErrorString();
        return path;
    }
};

TriMesh read(const std::string& path, const MeshReadSettings& settings = {}) {
    Result<TriMesh> mesh = read_mesh(path, settings);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().text());
    return mesh ? mesh.take() : TriMesh();
}

Error refused(const std::string& path, const MeshReadSettings& settings = {}) {
    const Result<TriMesh> mesh = read_mesh(path, settings);
    EXPECT_FALSE(mesh);
    return mesh ? Error() : mesh.error();
}

// A tetrahedron with two materials, a UV seam, and a polygon for a face of the second group.
constexpr const char* kTetrahedron = R"(
mtllib none.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
vt 0.5 0.5
usemtl red
f 1/1 3/3 2/2
f 1/4 2/2 4/3
usemtl blue
f 1/1 4/2 3/3
f 2/1 3/2 4/3
)";
constexpr const char* kMaterials = "newmtl red\nKd 1 0 0\nnewmtl unused\nKd 0 1 0\nnewmtl blue\nKd 0 0 1\n";

TEST_F(MeshIo, obj_keeps_materials_in_file_order_and_uvs_by_corner) {
    write("none.mtl", kMaterials);
    const TriMesh mesh = read(write("tetrahedron.obj", kTetrahedron));
    EXPECT_EQ(mesh.positions.size(), 4u);  // seams do not part the surface
    ASSERT_EQ(mesh.triangles.size(), 4u);
    EXPECT_TRUE(check_mesh(mesh).is_solid());
    EXPECT_NEAR(mesh_volume(mesh), 1.0 / 6, 1e-12);
    ASSERT_EQ(mesh.corner_uvs.size(), 12u);
    // assimp puts a default material first: it must not make red number 1.
    ASSERT_EQ(mesh.material_names, (std::vector<std::string>{"red", "unused", "blue"}));
    EXPECT_EQ(std::count(mesh.triangle_material.begin(), mesh.triangle_material.end(), 0), 2);
    EXPECT_EQ(std::count(mesh.triangle_material.begin(), mesh.triangle_material.end(), 2), 2);
    // The origin has three UVs, one a face: (0 0), (0.5 0.5), (0 0).
    std::multiset<float> at_origin;
    for (int corner = 0; corner < 12; ++corner)
        if (mesh.positions[mesh.triangles[corner / 3][corner % 3]].isZero(0))
            at_origin.insert(mesh.corner_uvs[corner].x());
    EXPECT_EQ(at_origin, (std::multiset<float>{0, 0, 0.5f}));
}

// assimp leaves out such vertices, and numbers those behind them wrong: of the first of these texts it makes another
// solid without a word.
TEST_F(MeshIo, obj_numbers_may_begin_with_their_point) {
    const std::string faces = "f 2/1/1 4/2/1 3/3/1\nf 2/1/1 3/2/1 5/3/1\nf 2/1/1 5/2/1 4/3/1\nf 3/1/1 4/2/1 5/3/1\n";
    const std::string zeros = "vt 0.25 0.5\nvt 0 0.75\nvt 1 0\nvn 0.6 0 0.8\n" + faces;
    const TriMesh want =
        read(write("plain.obj", "v 7 0.5 7\nv 0 0 0\nv 0.5 0 0\nv 0 -0.5 0\nv 0 0 0.5\nv 9 9 9\n" + zeros));
    ASSERT_EQ(want.triangles.size(), 4u);
    EXPECT_NEAR(std::abs(mesh_volume(want)), 0.125 / 6, 1e-9);
    const auto same_as_wanted = [&](const std::string& text) {
        SCOPED_TRACE(text);
        const TriMesh mesh = read(write("bare.obj", text));
        EXPECT_EQ(mesh.positions, want.positions);
        EXPECT_EQ(mesh.triangles, want.triangles);
        EXPECT_EQ(mesh.corner_uvs, want.corner_uvs);
        EXPECT_EQ(mesh.corner_normals, want.corner_normals);
    };
    same_as_wanted("v 7 .5 7\nv 0 0 0\nv 0.5 0 0\nv 0 -0.5 0\nv 0 0 0.5\nv 9 9 9\n" + zeros);
    same_as_wanted(
        "v 7 .5 7\nv 0 0 0\nv\t.5 0 0\nv 0 -.5 \\\n .0\r\nv 0 0 +.5 # .5 is a half\nv 9 9 9 # 1\n"
        "vt .25 .5\nvt 0 .75\nvt 1 0\nvn .6 0 .8\n" +
        faces);
    same_as_wanted("v 7 0.5 7\nv 0 0 0 # c \\\nv .5 0 0 # c \\\r\nv 0 -.5 0\nv 0 0 .5\nv 9 9 9\n" + zeros);
}

// assimp passes such lines over.
TEST_F(MeshIo, obj_lines_may_be_indented) {
    const std::string solid = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    const TriMesh want = read(write("plain.obj", solid)),
                  mesh = read(write("indented.obj",
                                    "  # solid\n \n\tv 0 0 0\n  v 1 0 0\nv 0 1\\\n 0\r\n v 0 0 1\n  f 1 3 2\nf 1 2\\\n"
                                    "   4\n \tf 1 4 3\nf 2 3 4\n  "));
    ASSERT_EQ(want.triangles.size(), 4u);
    EXPECT_EQ(mesh.positions, want.positions);
    EXPECT_EQ(mesh.triangles, want.triangles);
}

TEST_F(MeshIo, obj_materials_are_found_beside_a_file_that_is_mended) {
    write("none.mtl", kMaterials);
    std::string bare = kTetrahedron;
    bare.replace(bare.find("0.5 0.5"), 7, ".5 .5");
    const TriMesh mesh = read(write("tetrahedron.obj", bare)), want = read(write("plain.obj", kTetrahedron));
    EXPECT_EQ(mesh.material_names, (std::vector<std::string>{"red", "unused", "blue"}));
    EXPECT_EQ(mesh.corner_uvs, want.corner_uvs);
}

TEST_F(MeshIo, a_file_without_materials_has_number_0_and_no_names) {
    const TriMesh mesh = read(SUNDER_TEST_DATA "/bunny.obj");
    EXPECT_TRUE(mesh.material_names.empty());
    EXPECT_EQ(std::set<int>(mesh.triangle_material.begin(), mesh.triangle_material.end()), (std::set<int>{0}));
}

TEST_F(MeshIo, the_bunny_is_a_solid_of_one_metre_on_the_floor) {
    const MeshReport r = check_mesh(read(SUNDER_TEST_DATA "/bunny.obj"));
    EXPECT_TRUE(r.is_solid());
    EXPECT_TRUE(r.faults.empty());
    EXPECT_EQ(r.n_components, 1u);
    EXPECT_NEAR((r.bounds.max - r.bounds.min).maxCoeff(), 1, 1e-5);
    EXPECT_NEAR(r.bounds.min.z(), 0, 1e-6);
}

TEST_F(MeshIo, every_format_gives_the_same_closed_surface) {
    const std::string bunny = SUNDER_TEST_DATA "/bunny.obj";
    const MeshReport want = check_mesh(read(bunny));
    const std::map<std::string, std::string> formats = {{"ply", "ply"},  {"plyb", "ply"},   {"stl", "stl"},
                                                        {"stlb", "stl"}, {"gltf2", "gltf"}, {"glb2", "glb"},
                                                        {"fbxa", "fbx"}, {"obj", "obj"}};
    for (const auto& [id, extension] : formats) {
        SCOPED_TRACE(id);
        const TriMesh mesh = read(exported(id, extension, bunny));
        const MeshReport r = check_mesh(mesh);
        EXPECT_TRUE(r.is_solid()) << (r.faults.empty() ? "" : r.faults.front());
        EXPECT_EQ(r.n_triangles, want.n_triangles);
        EXPECT_EQ(r.n_vertices, want.n_vertices);
        // 1e-5: single precision, and text with six digits. Assimp writes FBX as centimetres.
        EXPECT_NEAR(r.volume * (extension == "fbx" ? 1e6 : 1), want.volume, 1e-5 * want.volume);
        EXPECT_TRUE(mesh.material_names.empty() || mesh.triangle_material == std::vector<int32_t>(r.n_triangles, 0));
    }
}

TEST_F(MeshIo, fbx_is_read_in_metres_whatever_its_unit) {
    const std::string path = exported("fbxa", "fbx", SUNDER_TEST_DATA "/bunny.obj");
    std::ifstream file(path);
    std::string text((std::istreambuf_iterator<char>(file)), {});
    const std::string unit = "P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",";
    const size_t at = text.find(unit);
    ASSERT_NE(at, std::string::npos);
    const size_t end = text.find('\n', at);
    for (const auto& [cm, longest] : std::map<std::string, double>{{"1", 0.01}, {"100", 1}, {"2.54", 0.0254}}) {
        std::string changed = text;
        changed.replace(at + unit.size(), end - at - unit.size(), cm);
        const MeshReport r = check_mesh(read(write("unit.fbx", changed)));
        EXPECT_NEAR((r.bounds.max - r.bounds.min).maxCoeff(), longest, 1e-5 * longest);
    }
}

TEST_F(MeshIo, uvs_survive_the_formats_that_have_them) {
    write("none.mtl", kMaterials);
    const std::string obj = write("tetrahedron.obj", kTetrahedron);
    auto sorted_uvs = [](const TriMesh& mesh) {
        std::multiset<std::pair<float, float>> uvs;
        for (const Vec2f& uv : mesh.corner_uvs)
            uvs.insert({std::round(uv.x() * 1e5f) / 1e5f, std::round(uv.y() * 1e5f) / 1e5f});
        return uvs;
    };
    const TriMesh want = read(obj);
    for (const auto& [id, extension] : std::map<std::string, std::string>{{"glb2", "glb"}, {"fbxa", "fbx"}}) {
        SCOPED_TRACE(id);
        const TriMesh mesh = read(exported(id, extension, obj));
        EXPECT_EQ(sorted_uvs(mesh), sorted_uvs(want));
        EXPECT_EQ(std::count(mesh.triangle_material.begin(), mesh.triangle_material.end(), mesh.triangle_material[0]),
                  2);
    }
}

TEST_F(MeshIo, off_with_polygons_is_triangulated) {
    const TriMesh mesh = read(write("cube.off",
                                    "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                                    "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"));
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_NEAR(mesh_volume(mesh), 1, 1e-12);
    EXPECT_TRUE(check_mesh(mesh).is_solid());
}

TEST_F(MeshIo, stl_facets_are_welded_by_position) {
    const TriMesh box = testing::make_box();
    std::string text = "solid box\n";
    for (const Triangle& t : box.triangles) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (uint32_t v : t) {
            const Vec3& p = box.positions[v];
            // Minus zero is the same place as zero.
            text += "vertex " + std::string(p.x() == 0 && v % 2 == 0 ? "-0" : std::to_string(p.x())) + " " +
                    std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
        }
        text += "endloop\nendfacet\n";
    }
    const TriMesh mesh = read(write("box.stl", text + "endsolid box\n"));
    EXPECT_EQ(mesh.positions.size(), 8u);
    EXPECT_TRUE(check_mesh(mesh).is_solid());
    EXPECT_TRUE(mesh.corner_normals.empty());
}

TEST_F(MeshIo, exactly_degenerate_triangles_are_dropped) {
    const TriMesh mesh = read(write("flaw.obj",
                                    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\n"
                                    "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 5 2\nf 2 2 3\n"));
    EXPECT_EQ(mesh.triangles.size(), 4u);
    EXPECT_EQ(mesh.positions.size(), 4u);
}

TEST_F(MeshIo, node_transforms_apply_and_faces_without_material_come_last) {
    // glTF: a triangle mesh used by two nodes, one scaled by -2 along x and moved by 10 along y.
    const TriMesh box = testing::make_box();
    std::string positions, indices;
    for (const Vec3& p : box.positions)
        for (int k = 0; k < 3; ++k) {
            const float x = float(p[k]);
            positions.append(reinterpret_cast<const char*>(&x), 4);
        }
    for (const Triangle& t : box.triangles)
        for (uint32_t v : t) {
            const auto i = static_cast<uint16_t>(v);
            indices.append(reinterpret_cast<const char*>(&i), 2);
        }
    write("box.bin", positions + indices);
    const std::string path =
        write("box.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
      "nodes": [{"mesh": 0}, {"mesh": 1, "scale": [-2, 1, 1], "translation": [0, 10, 0]}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]},
                 {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
      "materials": [{"name": "blue"}],
      "buffers": [{"uri": "box.bin", "byteLength": 168}],
      "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
                    {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}]})");
    const TriMesh mesh = read(path, {.scale = 0.1});
    // Faces without material come after the named ones and do not shift them.
    EXPECT_EQ(mesh.material_names, (std::vector<std::string>{"blue", "default"}));
    EXPECT_EQ(std::set<int>(mesh.triangle_material.begin(), mesh.triangle_material.end()), (std::set<int>{0, 1}));
    const MeshReport r = check_mesh(mesh);
    EXPECT_TRUE(r.is_solid());
    EXPECT_EQ(r.n_components, 2u);
    EXPECT_NEAR(r.volume, 3e-3, 1e-9);  // 1 and 2 cubic units, a tenth in size
    EXPECT_NEAR(r.bounds.min.x(), -0.2, 1e-7);
    EXPECT_NEAR(r.bounds.max.y(), 1.1, 1e-7);
}

TEST_F(MeshIo, refuses_what_is_no_mesh_file_with_its_name) {
    const std::string missing = (folder_ / "none.obj").string();
    EXPECT_EQ(refused(missing).code, ErrorCode::bad_input);
    EXPECT_NE(refused(missing).text().find(missing + ": there is no such file"), std::string::npos);
    EXPECT_NE(refused(folder_.string()).what.find("not a file"), std::string::npos);
    EXPECT_NE(refused(write("note.txt", "hello")).mend.find("OBJ"), std::string::npos);
    EXPECT_EQ(refused(write("empty.obj", "")).code, ErrorCode::bad_input);
    EXPECT_EQ(refused(write("foreign.ply", "\x89PNG\r\n\x1a\n not a ply")).code, ErrorCode::bad_input);
    EXPECT_EQ(refused(write("foreign.glb", "hello")).code, ErrorCode::bad_input);
    EXPECT_EQ(refused(write("foreign.fbx", std::string(100, '\0'))).code, ErrorCode::bad_input);
    EXPECT_NE(refused(write("points.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")).code, ErrorCode::internal);
    EXPECT_EQ(refused(SUNDER_TEST_DATA "/bunny.obj", {.scale = 0}).code, ErrorCode::bad_input);
}

// Assimp reads floats, our own readers doubles: at 5e6 the vertices of an OBJ file are half a metre apart.
TEST_F(MeshIo, what_floats_would_crumple_is_refused_in_formats_of_floats) {
    const std::string triangles = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    const std::string obj =
        "v 5000000 5000000 0\nv 5000000.7 5000000 0\nv 5000000 5000000.7 0\nv 5000000 5000000 0.7\n";
    EXPECT_NE(refused(write("far.obj", obj + triangles)).what.find("too far from the origin"), std::string::npos);
    const TriMesh mesh =
        read(write("far.off",
                   "OFF\n4 4 0\n5000000 5000000 0\n5000000.7 5000000 0\n5000000 5000000.7 0\n5000000 5000000 0.7\n"
                   "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"));
    EXPECT_NEAR(check_mesh(mesh).volume, 0.7 * 0.7 * 0.7 / 6, 1e-6);
}

TEST_F(MeshIo, a_truncated_file_is_refused) {
    for (const auto& [id, extension] :
         std::map<std::string, std::string>{{"plyb", "ply"}, {"ply", "ply"}, {"stlb", "stl"}, {"glb2", "glb"}}) {
        SCOPED_TRACE(id);
        std::ifstream in(exported(id, extension, SUNDER_TEST_DATA "/bunny.obj"), std::ios::binary);
        const std::string bytes((std::istreambuf_iterator<char>(in)), {});
        for (size_t share : {1, 10, 50, 90, 99})
            EXPECT_EQ(refused(write("cut." + extension, bytes.substr(0, bytes.size() * share / 100))).code,
                      ErrorCode::bad_input);
    }
    EXPECT_NE(refused(write("cut.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1")).what.find("at vertex 2"), std::string::npos);
    EXPECT_NE(refused(write("far.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")).what.find("vertex 3 of 3"),
              std::string::npos);
}

TEST_F(MeshIo, ply_keeps_doubles_materials_and_texture_coordinates) {
    const TriMesh mesh = read(write(
        "square.ply",
        "ply\r\nformat ascii 1.0\r\ncomment two squares, one bent inward\r\nelement vertex 5\r\n"
        "property double x\r\nproperty double y\r\nproperty double z\r\nproperty float s\r\nproperty float t\r\n"
        "element face 2\r\nproperty list uchar int vertex_indices\r\nproperty uchar red\r\nproperty int material\r\n"
        "end_header\r\n0 0 0 0 0\r\n1 0 0 1 0\r\n1.0000000000000002 1 0 1 1\r\n0 1 0 0 1\r\n0.9 0.5 0 5 5\r\n"
        "4 0 1 2 3 255 3\r\n4 0 4 2 3 0 1\r\n"));
    EXPECT_EQ(mesh.positions[2].x(), 1.0000000000000002);
    EXPECT_EQ(mesh.triangle_material, (std::vector<int32_t>{3, 3, 1, 1}));
    EXPECT_EQ(mesh.corner_uvs.size(), 12u);
    double area = 0;
    for (size_t t = 2; t < 4; ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 n = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
        EXPECT_GT(n.z(), 0);  // a fan from the first corner would fold over at the reflex one
        area += 0.5 * n.z();
    }
    // Shoelace of (0 0) (0.9 0.5) (1 1) (0 1).
    EXPECT_NEAR(area, 0.7, 1e-9);
}

TEST_F(MeshIo, ply_keeps_colours_and_the_artists_own_numbers) {
    const TriMesh mesh =
        read(write("painted.ply",
                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                   "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                   "property float toughness\nelement face 2\n"
                   "property list uchar int vertex_indices\nend_header\n"
                   "0 0 0 255 0 0 0.5\n1 0 0 0 255 0 1\n0 1 0 0 0 51 2\n0 0 0 0 0 0 9\n3 0 1 2\n3 3 2 1\n"));
    ASSERT_EQ(mesh.positions.size(), 3u);
    ASSERT_EQ(mesh.corner_colors.size(), 6u);
    EXPECT_EQ(mesh.corner_colors[0], (Color{1, 0, 0, 1}));
    EXPECT_EQ(mesh.corner_colors[2], (Color{0, 0, 0.2f, 1}));
    EXPECT_EQ(mesh.corner_colors[3], (Color{0, 0, 0, 1}));  // by corner: a seam stays one
    ASSERT_EQ(mesh.vertex_attributes.size(), 1u);
    EXPECT_EQ(mesh.vertex_attributes.at("toughness"), (std::vector<float>{0.5, 1, 2}));  // the first of those welded
}

TEST_F(MeshIo, attributes_that_are_no_numbers_are_refused) {
    const Error e = refused(write("nan.ply",
                                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                  "property float z\nproperty float paint\nelement face 1\n"
                                  "property list uchar int vertex_indices\nend_header\n"
                                  "0 0 0 1\n1 0 0 nan\n0 1 0 1\n3 0 1 2\n"));
    EXPECT_NE(e.text().find("paint"), std::string::npos) << e.text();
}

TEST_F(MeshIo, ply_of_the_other_byte_order_reads_the_same) {
    std::string big =
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty short y\nproperty double z\n"
        "element face 1\nproperty list uint ushort vertex_index\nend_header\n";
    auto put = [&](auto value) {
        std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
        if constexpr (std::endian::native == std::endian::little) std::reverse(raw.begin(), raw.end());
        big += raw;
    };
    for (const Vec3& p : {Vec3(0.5, -3, 0.1), Vec3(1, 2, 0), Vec3(0, 300, 1e-9)})
        put(float(p.x())), put(int16_t(p.y())), put(p.z());
    put(uint32_t(3)), put(uint16_t(0)), put(uint16_t(1)), put(uint16_t(2));
    const TriMesh mesh = read(write("big.ply", big));
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{Vec3(0.5, -3, 0.1), Vec3(1, 2, 0), Vec3(0, 300, 1e-9)}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST_F(MeshIo, a_ply_header_that_lies_is_refused) {
    const std::string head = "ply\nformat ascii 1.0\n";
    for (const std::string& rest :
         {std::string("element vertex 99999999999999\nproperty float x\nproperty float y\nproperty float "
                      "z\nend_header\n0 0 0\n"),
          std::string("element vertex x\nend_header\n"), std::string("property float x\nend_header\n"),
          std::string("element vertex 1\nproperty quux x\nend_header\n"), std::string("element vertex 1\n"),
          std::string("element vertex 1\nproperty float x\nend_header\n0\n"),
          std::string("element vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                      "property list char int vertex_indices\nend_header\n0 0 0\n-3 0 0 0\n"),
          std::string("element vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                      "property list char int vertex_indices\nend_header\n0 0 0\n3 0 1 -1\n")})
        EXPECT_EQ(refused(write("lie.ply", head + rest)).code, ErrorCode::bad_input) << rest;
}

TEST_F(MeshIo, names_the_vertex_that_is_no_number) {
    const Error e =
        refused(write("bad.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"));
    EXPECT_EQ(e.code, ErrorCode::bad_input);
    EXPECT_NE(e.what.find("vertex"), std::string::npos) << e.text();
    EXPECT_NE(e.what.find("no finite number"), std::string::npos) << e.text();
}

}  // namespace
}  // namespace sunder
