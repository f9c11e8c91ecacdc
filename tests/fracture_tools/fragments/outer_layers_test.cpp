// What an artist's mesh carries by name, from the mesh through repair and both cutters to the pieces and the visual
// mesh.
#include "fracture_tools/fragments/outer_layers.h"

#include <gtest/gtest.h>

#include <bit>
#include <set>

#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/skin/skinning.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/voronoi_body.h"

namespace sunder {
namespace {

using testing::make_box;
using testing::make_torus;
using testing::VoronoiBody;

// What is single precision, of numbers up to 10.
constexpr double kRounding = 1e-6;

double field(const Vec3& p) { return 2 * p.x() - 3 * p.y() + p.z() + 0.5; }

float whole(int32_t number) { return std::bit_cast<float>(number); }
int32_t number(float stored) { return std::bit_cast<int32_t>(stored); }

/// A linear field and a group on points, seams at all edges and a second UV map on corners, numbers of triangles,
/// colours.
TriMesh with_layers(TriMesh mesh) {
    MeshLayer heat({"heat", LayerDomain::point, LayerKind::number, 2});
    MeshLayer group({"gr\u00fcn .001", LayerDomain::point, LayerKind::weight, 1});
    MeshLayer picked({"picked", LayerDomain::point, LayerKind::boolean, 1});
    MeshLayer seams({"seams", LayerDomain::corner, LayerKind::number, 1});
    MeshLayer uvs({"Wall", LayerDomain::corner, LayerKind::uv, 2});
    MeshLayer color({"tint", LayerDomain::face, LayerKind::color, 4});
    MeshLayer id({"id", LayerDomain::face, LayerKind::integer, 1});
    for (const Vec3& p : mesh.positions) {
        heat.values.insert(heat.values.end(), {float(field(p)), float(-p.z())});
        group.values.push_back(p.z() > 0.01 ? 1.0f : 0.0f);
        picked.values.push_back(whole(p.x() > 0.3));
    }
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (uint32_t v : mesh.triangles[t]) {
            const Vec3& p = mesh.positions[v];
            seams.values.push_back(float(t));
            uvs.values.insert(uvs.values.end(), {float(p.x()), float(p.y() + p.z())});
        }
        color.values.insert(color.values.end(), {float(t % 2), 0, 1, 0.5f});
        id.values.push_back(whole(int32_t(1'000'000'007 + t)));  // no float holds it
    }
    mesh.layers = {heat, group, picked, seams, uvs, color, id};
    return mesh;
}

const MeshLayer& layer(const std::vector<MeshLayer>& layers, std::string_view name) {
    return *std::ranges::find(layers, name, &MeshLayer::name);
}
const VisualLayer& layer(const VisualMesh& mesh, std::string_view name) {
    return *std::ranges::find(mesh.layers, name, &VisualLayer::name);
}

enum class Way { voronoi, kmeans_tets, kmeans_voronoi };
constexpr Way kWays[] = {Way::voronoi, Way::kmeans_tets, Way::kmeans_voronoi};

PrefractureSettings settings_of(Way way) {
    PrefractureSettings settings;
    settings.method = way == Way::voronoi ? CutMethod::voronoi : CutMethod::kmeans;
    settings.source = way == Way::kmeans_voronoi ? CellSource::voronoi : CellSource::tets;
    settings.pieces = 12;
    return settings;
}

FragmentSet cut(const TriMesh& mesh, const PrefractureSettings& settings) {
    Result<FragmentSet> set = prefracture(mesh, settings, "mesh");
    EXPECT_TRUE(set) << (set ? "" : set.error().text());
    return set ? set.take() : FragmentSet();
}

/// The layers of a set whose surface lies on the source's.
void expect_carried(const FragmentSet& set, const TriMesh& source, bool is_own_surface) {
    const SurfaceLookup lookup(source);
    ASSERT_EQ(set.outer_layers.size(), source.layers.size());
    for (size_t k = 0; k < source.layers.size(); ++k)
        ASSERT_EQ(static_cast<const LayerId&>(set.outer_layers[k]), static_cast<const LayerId&>(source.layers[k]));
    const MeshLayer &heat = layer(set.outer_layers, "heat"), &seams = layer(set.outer_layers, "seams"),
                    &uvs = layer(set.outer_layers, "Wall"), &id = layer(set.outer_layers, "id"),
                    &color = layer(set.outer_layers, "tint"), &picked = layer(set.outer_layers, "picked");
    std::set<int32_t> values;
    for (uint32_t t = 0; t < set.outer_triangles.size(); ++t) {
        const auto& [i, j, k] = set.outer_triangles[t];
        const Vec3 middle = (set.vertices[i] + set.vertices[j] + set.vertices[k]) / 3;
        const auto home = static_cast<uint32_t>(number(*id.row(t)) - 1'000'000'007);
        ASSERT_EQ(home, lookup.nearest(middle).triangle) << t;
        EXPECT_EQ(color.row(t)[0], float(home % 2));
        EXPECT_EQ(color.row(t)[3], 0.5f);
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3& p = set.vertices[set.outer_triangles[t][c]];
            const Vec3 on_source = lookup.nearest(p).position;
            ASSERT_NEAR(heat.row(3 * t + c)[0], field(on_source), kRounding) << t;
            ASSERT_NEAR(heat.row(3 * t + c)[1], -on_source.z(), kRounding) << t;
            ASSERT_EQ(*seams.row(3 * t + c), float(home)) << t;  // a seam at each edge of the source
            if (is_own_surface) {
                ASSERT_NEAR(uvs.row(3 * t + c)[0], p.x(), kRounding);
                ASSERT_NEAR(uvs.row(3 * t + c)[1], p.y() + p.z(), kRounding);
            }
            values.insert(number(*picked.row(3 * t + c)));
        }
    }
    EXPECT_EQ(values, (std::set<int32_t>{0, 1}));
}

TEST(OuterLayers, a_linear_field_stays_linear_faces_and_seams_stay_however_it_is_cut) {
    for (const TriMesh& shape : {make_torus(), make_box(Vec3(1, 0.7, 0.4))})
        for (const Way way : kWays) {
            SCOPED_TRACE(int(way));
            const TriMesh mesh = with_layers(shape);
            expect_carried(cut(mesh, settings_of(way)), mesh, way != Way::kmeans_tets);
        }
}

TEST(OuterLayers, finer_break_surfaces_leave_the_outer_surface_what_it_has) {
    const TriMesh mesh = with_layers(make_box(Vec3(1, 0.7, 0.4)));
    PrefractureSettings settings = settings_of(Way::voronoi);
    const size_t n_plain = cut(mesh, settings).outer_triangles.size();
    settings.interior.detail = 0.3;
    const FragmentSet fine = cut(mesh, settings);
    EXPECT_GT(fine.outer_triangles.size(), n_plain);
    expect_carried(fine, mesh, true);
}

TEST(OuterLayers, no_layers_change_nothing_and_none_are_made) {
    for (const Way way : kWays) {
        const FragmentSet plain = cut(make_torus(), settings_of(way)),
                          set = cut(with_layers(make_torus()), settings_of(way));
        EXPECT_TRUE(plain.outer_layers.empty());
        EXPECT_EQ(plain.vertices, set.vertices);
        EXPECT_EQ(plain.outer_triangles, set.outer_triangles);
        EXPECT_EQ(plain.interface_triangles, set.interface_triangles);
    }
}

TEST(OuterLayers, a_set_whose_rows_do_not_fit_is_refused) {
    const FragmentSet good = cut(with_layers(make_torus()), settings_of(Way::voronoi));
    EXPECT_TRUE(check_fragments(good));
    for (const char* name : {"heat", "seams", "id"}) {
        FragmentSet bad = good;
        std::ranges::find(bad.outer_layers, name, &MeshLayer::name)->values.pop_back();
        ASSERT_FALSE(check_fragments(bad));
        EXPECT_NE(check_fragments(bad).error().what.find(std::string("'") + name + "'"), std::string::npos);
    }
}

TEST(OuterLayers, pieces_carry_them_and_break_surfaces_have_what_is_documented) {
    const FragmentSet set = cut(with_layers(make_box(Vec3(1, 0.7, 0.4))), settings_of(Way::voronoi));
    bool has_inner_vertex = false;
    for (uint32_t f = 0; f < set.fragments.size(); ++f) {
        const TriMesh piece = fragment_mesh(set, FragmentId(f));
        const MeshLayer &heat = layer(piece.layers, "heat"), &id = layer(piece.layers, "id"),
                        &tint = layer(piece.layers, "tint"), &uvs = layer(piece.layers, "Wall");
        ASSERT_EQ(heat.domain, LayerDomain::point);
        ASSERT_EQ(heat.n_rows(), piece.positions.size());
        ASSERT_EQ(id.n_rows(), piece.triangles.size());
        ASSERT_EQ(uvs.n_rows(), 3 * piece.triangles.size());
        std::vector<uint8_t> is_outer(piece.positions.size(), 0);
        for (uint32_t t = 0; t < piece.triangles.size(); ++t) {
            const bool is_break = piece.triangle_material[t] == set.interior_material;
            EXPECT_EQ(number(*id.row(t)) == 0, is_break);
            if (!is_break)
                for (uint32_t v : piece.triangles[t]) is_outer[v] = 1;
            for (int c = 0; is_break && c < 3; ++c) {
                const Vec2f& of_cut = piece.corner_uvs[3 * t + c];
                EXPECT_EQ(std::pair(uvs.row(3 * t + c)[0], uvs.row(3 * t + c)[1]), std::pair(of_cut.x(), of_cut.y()));
            }
            if (is_break) {
                EXPECT_EQ(*tint.row(t), 1.0f);
            }
        }
        for (uint32_t v = 0; v < piece.positions.size(); ++v) {
            EXPECT_NEAR(heat.row(v)[0], is_outer[v] ? field(piece.positions[v]) : 0, kRounding);
            has_inner_vertex |= !is_outer[v];
        }
    }
    EXPECT_TRUE(has_inner_vertex);
}

TEST(OuterLayers, the_visual_mesh_carries_them_before_and_after_it_breaks) {
    VoronoiBody body(with_layers(make_box(Vec3(1, 0.7, 0.4))), 12);
    for (const VisualTopology topology : {VisualTopology::compact, VisualTopology::constant})
        for (const double share : {0.0, 0.5}) {
            body.intact.assign(body.intact.size(), 1);
            body.break_share(share, 3);
            const VisualMesh mesh = body.frame(topology);
            const VisualLayer &heat = layer(mesh, "heat"), &id = layer(mesh, "id"), &uvs = layer(mesh, "Wall"),
                              &group = layer(mesh, "gr\u00fcn .001");
            ASSERT_EQ(heat.n_rows(), mesh.positions.size());
            ASSERT_EQ(group.n_rows(), mesh.positions.size());
            ASSERT_EQ(id.n_rows(), mesh.triangles.size());
            std::vector<uint8_t> is_outer(body.set->vertices.size(), 0);
            for (const Triangle& t : body.set->outer_triangles)
                for (uint32_t v : t) is_outer[v] = 1;
            const std::vector<uint32_t> pool = mesh.skin->pool_vertices();
            for (uint32_t v = 0; v < mesh.positions.size(); ++v)
                EXPECT_NEAR(heat.row(v)[0], is_outer[pool[v]] ? field(body.set->vertices[pool[v]]) : 0, kRounding);
            size_t n_break = 0;
            for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                const bool is_break = mesh.triangle_interface[t] >= 0;
                n_break += is_break;
                EXPECT_EQ(number(*id.row(t)) == 0, is_break);
                for (uint32_t c = 3 * t; is_break && c < 3 * t + 3; ++c)  // both maps are those of the cut
                    EXPECT_EQ(std::pair(uvs.row(c)[0], uvs.row(c)[1]),
                              std::pair(mesh.corner_uvs[c].x(), mesh.corner_uvs[c].y()));
            }
            EXPECT_EQ(n_break > 0, share > 0 || topology == VisualTopology::constant);
        }
}

TEST(OuterLayers, frames_in_which_nothing_broke_share_their_memory) {
    VoronoiBody body(with_layers(make_box(Vec3(1, 0.7, 0.4))), 12);
    VisualMeshBuilder builder(body.set, body.rest, {}, VisualTopology::compact);
    const auto frame = [&] {
        return builder.build({body.position, body.orientation, body.plastic, body.intact}).take();
    };
    const VisualMesh first = frame();
    body.position[0] += Vec3(0, 0, 0.1);
    const VisualMesh second = frame();
    body.intact[0] = 0, body.break_share(0.5, 1);
    const VisualMesh torn = frame();
    for (size_t k = 0; k < first.layers.size(); ++k) {
        EXPECT_EQ(first.layers[k].values.data(), second.layers[k].values.data());
        EXPECT_NE(first.layers[k].values.data(), torn.layers[k].values.data());
    }
}

TEST(OuterLayers, any_number_of_threads_gives_the_same_bits) {
    for (const Way way : kWays) {
        PrefractureSettings settings = settings_of(way);
        std::vector<std::vector<MeshLayer>> found;
        for (const int threads : {1, 3}) {
            settings.threads = threads;
            found.push_back(cut(with_layers(make_torus()), settings).outer_layers);
        }
        for (size_t k = 0; k < found[0].size(); ++k) {
            const auto bits = [&](size_t i) {
                std::vector<int32_t> all;
                for (const float v : found[i][k].values) all.push_back(number(v));
                return all;
            };
            EXPECT_EQ(bits(0), bits(1));
        }
    }
}

}  // namespace
}  // namespace sunder
