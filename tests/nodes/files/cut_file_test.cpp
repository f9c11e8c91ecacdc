#include "nodes/files/cut_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <tuple>

#include "nodes/files/file_io.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

/// Every field is something that it is not by default, and no two are alike.
FragmentSet example() {
    FragmentSet s;
    s.vertices = {{0.1, -0.0, 3}, {4.9e-324, 5, 6}, {7, 8, 9}};
    Fragment f;
    f.volume = 1.5, f.centroid = {1, 2, 3}, f.orientation = Quat(0.1, 0.2, 0.3, 0.4), f.radii = {4, 5, 6},
    f.cluster = -7;
    f.covariance << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    f.toughness_factor = 0.25, f.yield_factor = 2, f.density_factor = 3, f.outer_begin = 1, f.outer_end = 2;
    s.fragments = {f, Fragment{}};
    Interface i;
    i.a = FragmentId(0), i.b = FragmentId(1), i.area = 0.5, i.normal = {0, 0, 1}, i.centroid = {3, 2, 1};
    i.triangle_begin = 4, i.triangle_end = 9, i.joins = false;
    i.toughness_factor = std::numeric_limits<double>::infinity();
    s.interfaces = {i};
    s.outer_triangles = {{0, 1, 2}}, s.outer_material = {3}, s.outer_corner_uvs = {{0, 1}, {2, 3}, {4, 5}};
    s.outer_corner_normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    s.outer_corner_colors = {{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 0, 1, 2}};
    s.interface_triangles = {{2, 1, 0}}, s.interface_corner_uvs = {{6, 7}, {8, 9}, {10, 11}};
    s.interface_corner_rim = {0.5f, 0.25f, 1}, s.interior_smooth_angle = 33, s.interior_material = 4;
    s.material_names = {"", "paint"}, s.vertex_groups = {{"top", {FragmentId(1)}}, {"none", {}}};
    s.source_volume = 12, s.source_area = 34, s.source_path = "a b.obj", s.warnings = {"mind the gap"};
    return s;
}

std::string bytes_of(const FragmentSet& set, ContentKey key = 42) { return std::string(encode_cut(set, key).view()); }

TEST(CutFile, holds_every_field_bit_for_bit) {
    const FragmentSet written = example();
    const auto read = decode_cut(bytes_of(written), 42);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->vertices, written.vertices);
    EXPECT_TRUE(std::signbit(read->vertices[0].y()));
    ASSERT_EQ(read->fragments.size(), 2u);
    const Fragment &f = read->fragments[0], &g = written.fragments[0];
    EXPECT_EQ(f.covariance, g.covariance);
    EXPECT_EQ(f.orientation.coeffs(), g.orientation.coeffs());
    EXPECT_EQ(std::tie(f.volume, f.centroid, f.radii, f.cluster, f.toughness_factor, f.yield_factor, f.density_factor,
                       f.outer_begin, f.outer_end),
              std::tie(g.volume, g.centroid, g.radii, g.cluster, g.toughness_factor, g.yield_factor, g.density_factor,
                       g.outer_begin, g.outer_end));
    ASSERT_EQ(read->interfaces.size(), 1u);
    const Interface &i = read->interfaces[0], &j = written.interfaces[0];
    EXPECT_EQ(
        std::tie(i.a, i.b, i.area, i.normal, i.centroid, i.triangle_begin, i.triangle_end, i.toughness_factor, i.joins),
        std::tie(j.a, j.b, j.area, j.normal, j.centroid, j.triangle_begin, j.triangle_end, j.toughness_factor,
                 j.joins));
    const auto others = [](const FragmentSet& s) {
        return std::tie(s.outer_triangles, s.outer_material, s.outer_corner_uvs, s.outer_corner_normals,
                        s.outer_corner_colors, s.interface_triangles, s.interface_corner_uvs, s.interface_corner_rim,
                        s.interior_smooth_angle, s.interior_material, s.material_names, s.vertex_groups,
                        s.source_volume, s.source_area, s.source_path, s.warnings);
    };
    EXPECT_EQ(others(*read), others(written));
    EXPECT_EQ(bytes_of(*read), bytes_of(written));
}

TEST(CutFile, layers_are_held_and_a_set_without_any_is_written_as_ever) {
    FragmentSet written = example();
    const std::string plain = bytes_of(written);
    written.outer_layers = {{{"heat map", LayerDomain::point, LayerKind::number, 1}, {1, 2, 3}},
                            {{"Wall", LayerDomain::corner, LayerKind::uv, 2}, {1, 2, 3, 4, 5, 6}},
                            {{"id", LayerDomain::face, LayerKind::integer, 1}, {7}}};
    const std::string bytes = bytes_of(written);
    const auto read = decode_cut(bytes, 42);
    ASSERT_TRUE(read);
    ASSERT_EQ(read->outer_layers.size(), 3u);
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(static_cast<const LayerId&>(read->outer_layers[k]), written.outer_layers[k]);
        EXPECT_EQ(read->outer_layers[k].values, written.outer_layers[k].values);
    }
    EXPECT_EQ(bytes_of(*read), bytes);
    // The fields of before, then the layers, then the checksum.
    EXPECT_EQ(bytes.substr(0, plain.size() - 8), plain.substr(0, plain.size() - 8));
    EXPECT_TRUE(decode_cut(plain, 42)->outer_layers.empty());
    for (size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decode_cut(std::string_view(bytes).substr(0, n), 42)) << n;
}

TEST(CutFile, another_key_a_cut_off_file_and_a_changed_byte_are_no_cut) {
    const std::string whole = bytes_of(example());
    EXPECT_FALSE(decode_cut(whole, 43));
    for (size_t n = 0; n < whole.size(); ++n) EXPECT_FALSE(decode_cut(std::string_view(whole).substr(0, n), 42)) << n;
    for (size_t n = 0; n < whole.size(); ++n) {
        std::string spoiled = whole;
        spoiled[n] = char(spoiled[n] ^ 1);
        EXPECT_FALSE(decode_cut(spoiled, 42)) << n;
    }
}

class CutFolderOfAGraph : public ::testing::Test {
protected:
    Graph graph() {
        Graph g;
        EXPECT_TRUE(g.add_node("mesh", "mesh_file"));
        EXPECT_TRUE(g.add_node("cut", "prefracture"));
        EXPECT_TRUE(g.set("mesh", "path", (folder_.path() / "box.obj").string()));
        EXPECT_TRUE(g.connect({"mesh", "mesh"}, {"cut", "mesh"}));
        EXPECT_TRUE(g.set("cut", "pieces", 6));
        g.set_cut_folder(cuts_.string());
        return g;
    }
    void SetUp() override {
        std::ofstream file(folder_.path() / "box.obj");
        for (int i = 0; i < 8; ++i) file << "v " << (i & 1) << ' ' << (i >> 1 & 1) << ' ' << (i >> 2) << '\n';
        file << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    }
    static std::string cut(Graph& g) {
        const auto value = g.evaluate("cut", "fragments", 1);
        EXPECT_TRUE(value);
        return bytes_of(*std::get<std::shared_ptr<const FragmentSet>>(*value));
    }
    std::vector<fs::path> files() const {
        std::vector<fs::path> found;
        for (const auto& entry : fs::directory_iterator(cuts_)) found.push_back(entry.path());
        return found;
    }

    TemporaryFolder folder_;
    fs::path cuts_ = folder_.path() / "bake" / "cuts";
};

TEST_F(CutFolderOfAGraph, gives_another_graph_the_same_cut_without_cutting) {
    Graph first = graph();
    const std::string made = cut(first);
    ASSERT_EQ(files().size(), 1u);
    Graph second = graph();
    EXPECT_EQ(cut(second), made);
    EXPECT_EQ(second.cook_count("mesh"), 0u);  // nothing was read to be cut
    EXPECT_EQ(first.cook_count("mesh"), 1u);
}

TEST_F(CutFolderOfAGraph, keeps_the_last_cut_of_a_node_and_cuts_anew_what_changed_or_is_spoiled) {
    Graph g = graph();
    const std::string six = cut(g);
    const fs::path of_six = files().front();
    ASSERT_TRUE(g.set("cut", "pieces", 5));
    EXPECT_NE(cut(g), six);
    ASSERT_EQ(files().size(), 1u);
    EXPECT_NE(files().front(), of_six);
    ASSERT_TRUE(g.set("cut", "pieces", 6));
    std::ofstream(of_six) << "spoiled";
    EXPECT_EQ(cut(g), six);
    Graph again = graph();
    EXPECT_EQ(cut(again), six);
    EXPECT_EQ(again.cook_count("mesh"), 0u);
}

TEST_F(CutFolderOfAGraph, that_cannot_be_written_changes_nothing) {
    std::ofstream(folder_.path() / "bake") << "a file in its place";
    Graph g = graph();
    EXPECT_FALSE(cut(g).empty());
}

}  // namespace
}  // namespace sunder
