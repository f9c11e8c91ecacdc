// The visual mesh with all fragments from the first frame on (Choi 2014, section 4.2).
#include <gtest/gtest.h>

#include <map>

#include "fracture_tools/fragments/fragment_faces.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "tests/fracture_tools/moving_body.h"

namespace sunder {
namespace {

using testing::MovingBody;

VisualMesh built(VisualMeshBuilder& builder, const MovingBody& body) {
    Result<VisualMesh> mesh = builder.build(body.frame());
    EXPECT_TRUE(mesh) << mesh.error().text();
    return mesh ? mesh.take() : VisualMesh();
}

VisualMesh fresh(const MovingBody& body, VisualTopology topology) {
    VisualMeshBuilder builder(body.fragments, body.rest, {}, topology);
    return built(builder, body);
}

TEST(ConstantTopology, what_can_be_seen_is_the_compact_mesh_to_the_last_bit) {
    MovingBody body = testing::moving_body();
    VisualMeshBuilder constant(body.fragments, body.rest, {}, VisualTopology::constant);
    for (const double share : {0.0, 0.02, 0.3, 1.0, 0.3}) {
        body.break_share(share, 1);
        const VisualMesh all = built(constant, body), seen = fresh(body, VisualTopology::compact);
        ASSERT_EQ(all.triangle_hidden.size(), all.triangles.size());
        size_t s = 0;
        for (size_t t = 0; t < all.triangles.size(); ++t) {
            if (all.triangle_hidden[t]) continue;
            ASSERT_LT(s, seen.triangles.size());
            EXPECT_EQ(all.triangle_material[t], seen.triangle_material[s]);
            EXPECT_EQ(all.triangle_fragment[t], seen.triangle_fragment[s]);
            for (int c = 0; c < 3; ++c) {
                const uint32_t v = all.triangles[t][c], w = seen.triangles[s][c];
                ASSERT_EQ(all.positions[v], seen.positions[w]);
                ASSERT_EQ(all.velocities[v], seen.velocities[w]);
                ASSERT_EQ(all.vertex_fragment[v], seen.vertex_fragment[w]);
                ASSERT_EQ(all.corner_normals[3 * t + c], seen.corner_normals[3 * s + c]);
            }
            ++s;
        }
        EXPECT_EQ(s, seen.triangles.size()) << share;
    }
}

TEST(ConstantTopology, vertices_and_faces_are_the_same_in_every_frame) {
    MovingBody body = testing::moving_body();
    const VisualMesh whole = fresh(body, VisualTopology::constant);
    body.break_share(0.4, 2);
    const VisualMesh torn = fresh(body, VisualTopology::constant);
    EXPECT_EQ(whole.triangles, torn.triangles);
    EXPECT_EQ(whole.triangle_material, torn.triangle_material);
    EXPECT_EQ(whole.triangle_fragment, torn.triangle_fragment);
    EXPECT_EQ(whole.positions.size(), torn.positions.size());
    EXPECT_NE(whole.triangle_hidden, torn.triangle_hidden);
}

TEST(ConstantTopology, fragments_are_closed_and_share_no_vertex) {
    const MovingBody body = testing::moving_body();
    const VisualMesh mesh = fresh(body, VisualTopology::constant);
    std::vector<int64_t> owner(mesh.positions.size(), -1);
    std::map<std::pair<uint32_t, uint32_t>, int> surplus;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = mesh.triangles[t][c], w = mesh.triangles[t][(c + 1) % 3];
            if (owner[v] < 0) owner[v] = mesh.triangle_fragment[t];
            ASSERT_EQ(owner[v], mesh.triangle_fragment[t]);
            surplus[std::minmax(v, w)] += v < w ? 1 : -1;
        }
    for (const auto& [edge, n] : surplus) ASSERT_EQ(n, 0);
}

TEST(ConstantTopology, instances_have_equal_bits_until_they_come_apart) {
    MovingBody body = testing::moving_body();
    const FragmentFaces faces = make_fragment_faces(*body.fragments).take();
    for (const double share : {0.0, 0.3}) {
        body.break_share(share, 4);
        const VisualMesh mesh = fresh(body, VisualTopology::constant);
        size_t hidden = 0, apart = 0;
        for (uint32_t f = faces.n_outer; f < faces.n_outer + faces.n_interface; ++f) {
            const uint32_t twin = faces.twin(f);
            EXPECT_EQ(mesh.triangle_hidden[f], mesh.triangle_hidden[twin]);
            bool same = true;
            for (int c = 0; c < 3; ++c) {
                const uint32_t v = mesh.triangles[f][c], w = mesh.triangles[twin][faces.twin_corner(c)];
                same = same && mesh.positions[v] == mesh.positions[w] && mesh.velocities[v] == mesh.velocities[w];
            }
            EXPECT_TRUE(same || !mesh.triangle_hidden[f]);
            hidden += mesh.triangle_hidden[f], apart += !same;
        }
        EXPECT_GT(hidden, 0u);
        EXPECT_EQ(apart > 0, share > 0);
        EXPECT_EQ(hidden == faces.n_interface, share == 0);
        // Normals of outer faces: one for all that are smooth with one another, whichever fragment they belong to.
        std::map<std::array<float, 3>, std::vector<Vec3f>> around;
        for (uint32_t k = 0; share == 0 && k < 3 * faces.n_outer; ++k) {
            const Vec3f& p = mesh.positions[mesh.triangles[k / 3][k % 3]];
            around[{p.x(), p.y(), p.z()}].push_back(mesh.corner_normals[k]);
        }
        for (const auto& [p, normals] : around)
            for (const Vec3f& n : normals)  // the same, or across a crease of 60 degrees and more
                ASSERT_TRUE(n == normals[0] || n.dot(normals[0]) < 0.75f);
    }
}

TEST(ConstantTopology, fragments_move_by_themselves_when_all_is_broken) {
    MovingBody body = testing::moving_body();
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const VisualMesh mesh = fresh(body, VisualTopology::constant);
    EXPECT_EQ(std::count(mesh.triangle_hidden.begin(), mesh.triangle_hidden.end(), 0),
              std::ptrdiff_t(mesh.triangles.size()));
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (uint32_t v : mesh.triangles[t]) ASSERT_EQ(mesh.vertex_fragment[v], mesh.triangle_fragment[t]);
}

}  // namespace
}  // namespace sunder
