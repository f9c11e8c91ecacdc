#include "fracture_tools/skin/visual_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"
#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder {
namespace {

using testing::Body;

BodyFrame frame_of(const Body& body) { return {body.position, body.orientation, body.plastic, body.intact}; }

VisualMesh built(VisualMeshBuilder& builder, const Body& body) {
    Result<VisualMesh> mesh = builder.build(frame_of(body));
    EXPECT_TRUE(mesh) << mesh.error().text();
    return mesh ? mesh.take() : VisualMesh();
}

VisualMesh fresh(const Body& body) {
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    return built(builder, body);
}

Body blocks() {  // 3 x 3 x 3 cubes of 2^3 cells
    return testing::make_body(testing::make_tet_box({6, 6, 6}, 0.1),
                              testing::block_labels(testing::make_tet_box({6, 6, 6}, 0.1), {3, 3, 3}, 0.2));
}

Body kmeans() {
    const auto box = testing::make_tet_box({8, 8, 12}, 0.1, 0.2);
    return testing::make_body(box, testing::kmeans_labels(box, 60, 7));
}

void break_share(Body& body, double share, uint32_t seed) {
    std::mt19937 random(seed);
    for (uint8_t& i : body.intact)
        if (random() / 4294967296.0 < share) i = 0;
}

void shake(Body& body, double amount, uint32_t seed) {
    std::mt19937 random(seed);
    auto noise = [&] { return (random() / 4294967296.0 - 0.5) * 2 * amount; };
    for (size_t i = 0; i < body.position.size(); ++i) {
        for (int k = 0; k < 3; ++k) body.position[i][k] += noise();
        const Vec3 turn(noise(), noise(), noise());
        body.orientation[i] = Quat(Eigen::AngleAxisd(5 * turn.norm(), turn.normalized())) * body.orientation[i];
    }
}

bool same(const VisualMesh& x, const VisualMesh& y) {
    return x.positions == y.positions && x.triangles == y.triangles && x.corner_normals == y.corner_normals &&
           x.corner_uvs == y.corner_uvs && x.triangle_material == y.triangle_material &&
           x.triangle_fragment == y.triangle_fragment && x.vertex_fragment == y.vertex_fragment;
}

void expect_whole(const VisualMesh& mesh) {
    ASSERT_EQ(mesh.corner_normals.size(), 3 * mesh.triangles.size());
    ASSERT_EQ(mesh.triangle_material.size(), mesh.triangles.size());
    ASSERT_EQ(mesh.triangle_fragment.size(), mesh.triangles.size());
    ASSERT_EQ(mesh.vertex_fragment.size(), mesh.positions.size());
    std::vector<uint8_t> used(mesh.positions.size(), 0);
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) {
            ASSERT_LT(v, mesh.positions.size());
            used[v] = 1;
        }
    EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
    for (const Vec3f& p : mesh.positions) ASSERT_TRUE(p.allFinite());
    for (const Vec3f& n : mesh.corner_normals) ASSERT_NEAR(n.norm(), 1, 1e-5);
}

int unbalanced_edges(const VisualMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> surplus;
    for (const Triangle& t : mesh.triangles)
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = t[c], w = t[(c + 1) % 3];
            surplus[std::minmax(v, w)] += v < w ? 1 : -1;
        }
    return int(std::count_if(surplus.begin(), surplus.end(), [](const auto& s) { return s.second != 0; }));
}

int components(const VisualMesh& mesh) {
    std::vector<uint32_t> root(mesh.positions.size());
    std::iota(root.begin(), root.end(), 0u);
    auto find = [&](uint32_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (const Triangle& t : mesh.triangles) root[find(t[0])] = find(t[1]), root[find(t[1])] = find(t[2]);
    std::set<uint32_t> roots;
    for (uint32_t v = 0; v < root.size(); ++v) roots.insert(find(v));
    return int(roots.size());
}

TEST(visual_mesh, rest_frame_is_the_artists_mesh_where_the_body_was_placed) {
    const Body body = kmeans();
    const Pose pose{Vec3(10, -20, 5), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))};
    Body placed = body;
    placed.rest = SimulationMesh();
    append_body(placed.rest, body.rest, pose);
    build_one_rings(placed.rest);
    testing::rest_frame(placed);
    VisualMeshBuilder builder(placed.fragments, placed.rest, pose);
    const VisualMesh mesh = built(builder, placed);
    expect_whole(mesh);
    ASSERT_EQ(mesh.triangles.size(), body.fragments->outer_triangles.size());
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const Vec3 truth = pose.apply(body.fragments->vertices[body.fragments->outer_triangles[t][c]]);
            // half a unit in the last place of a float at 20 m
            ASSERT_LT((mesh.positions[mesh.triangles[t][c]].cast<double>() - truth).cwiseAbs().maxCoeff(), 1e-6);
        }
    EXPECT_TRUE(mesh.corner_uvs.empty());
}

TEST(visual_mesh, frames_in_any_order_are_the_same_as_from_scratch) {
    Body whole = kmeans(), torn = whole, shattered = whole;
    break_share(torn, 0.3, 1), break_share(shattered, 1, 1);
    shake(whole, 0.01, 1), shake(torn, 0.02, 2), shake(shattered, 0.03, 3);
    VisualMeshBuilder builder(whole.fragments, whole.rest, {});
    for (const Body* body : {&shattered, &whole, &torn, &torn, &shattered, &torn, &whole})
        EXPECT_TRUE(same(built(builder, *body), fresh(*body)));
}

TEST(visual_mesh, order_of_vertices_and_triangles_is_stable_between_frames_without_breaks) {
    Body body = kmeans();
    break_share(body, 0.3, 1);
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    const VisualMesh before = built(builder, body);
    shake(body, 0.05, 4);
    const VisualMesh after = built(builder, body);
    EXPECT_EQ(before.triangles, after.triangles);
    EXPECT_EQ(before.vertex_fragment, after.vertex_fragment);
    EXPECT_NE(before.positions, after.positions);
}

TEST(visual_mesh, shown_triangles_keep_their_order_when_others_appear) {
    Body body = blocks();
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    const VisualMesh whole = built(builder, body);
    break_share(body, 0.5, 1);
    const VisualMesh torn = built(builder, body);
    ASSERT_GT(torn.triangles.size(), whole.triangles.size());
    for (size_t t = 0; t < whole.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c)  // at rest, so positions tell
            ASSERT_LT((whole.positions[whole.triangles[t][c]] - torn.positions[torn.triangles[t][c]]).norm(), 1e-6);
}

TEST(visual_mesh, break_surfaces_have_the_interior_material_and_both_fragments) {
    Body body = blocks();
    body.fragments->interior_material = 7;
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const VisualMesh mesh = fresh(body);
    const FragmentSet& set = *body.fragments;
    ASSERT_EQ(mesh.triangles.size(), set.outer_triangles.size() + 2 * set.interface_triangles.size());
    std::map<uint32_t, std::array<size_t, 2>> count;  // of a fragment: outer, interior
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        EXPECT_EQ(mesh.triangle_material[t], t < set.outer_triangles.size() ? 0 : 7);
        ++count[mesh.triangle_fragment[t]][t >= set.outer_triangles.size()];
    }
    ASSERT_EQ(count.size(), 27u);
    for (const auto& [fragment, n] : count) EXPECT_EQ(n[0] + n[1], 6 * 4 * 2u);  // a cube of 2^3 cells
    EXPECT_EQ(count[13][0], 0u);  // the one in the middle has no outer faces
}

TEST(visual_mesh, torn_deformed_mesh_has_no_gap_where_fragments_hold_together) {
    // Vertices are shared where the surface is joined, so a balance of indices is one of positions too.
    for (double share : {0.0, 0.02, 0.2, 0.6, 1.0}) {
        Body body = kmeans();
        break_share(body, share, 5);
        shake(body, 0.01, 5);
        const VisualMesh mesh = fresh(body);
        expect_whole(mesh);
        EXPECT_EQ(unbalanced_edges(mesh), 0);
    }
}

class lattice : public ::testing::TestWithParam<int> {};

TEST_P(lattice, stays_balanced_and_falls_apart_into_its_cells) {
    LatticeSettings settings;
    settings.neighbours = GetParam();  // 18 and 26 have edges whose interface has no triangles
    Body body;
    body.fragments = std::make_shared<FragmentSet>(make_lattice(settings, "lattice").take());
    body.rest = build_simulation_mesh(*body.fragments, {}).take();
    testing::rest_frame(body);
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    EXPECT_EQ(components(built(builder, body)), 1);
    for (double share : {0.02, 0.2, 0.6}) {
        Body torn = body;
        break_share(torn, share, 7);
        shake(torn, 0.02, 7);
        const VisualMesh mesh = built(builder, torn);
        expect_whole(mesh);
        EXPECT_EQ(unbalanced_edges(mesh), 0);
    }
    break_share(body, 1, 1);
    EXPECT_EQ(components(built(builder, body)), 64);
}
INSTANTIATE_TEST_SUITE_P(visual_mesh, lattice, ::testing::Values(6, 18, 26));

TEST(visual_mesh, lone_fragment_keeps_its_plastic_shape) {
    Body body = blocks();
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const Mat3 F_P = Vec3(2, std::sqrt(0.5), std::sqrt(0.5)).asDiagonal();
    const Quat turn(Eigen::AngleAxisd(1.2, Vec3::UnitY()));
    body.plastic[13] = F_P;
    body.position[13] = Vec3(5, 5, 5);
    body.orientation[13] = turn * body.rest.rest_orientation[13];
    const VisualMesh mesh = fresh(body);
    size_t seen = 0;
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        if (mesh.vertex_fragment[v] != 13) continue;
        ++seen;
        const Vec3 local = F_P.inverse() * (turn.conjugate() * (mesh.positions[v].cast<double>() - Vec3(5, 5, 5)));
        EXPECT_NEAR(local.cwiseAbs().maxCoeff(), 0.1, 1e-6);  // on the cube of 0.2 m
    }
    EXPECT_EQ(seen, 26u);
}

// --- interfaces that have no edge ---

TEST(visual_mesh, interface_without_an_edge_holds_until_its_fragments_are_in_different_pieces) {
    Body body = blocks();
    // Leave the interface 0-1 out of the simulation mesh.
    ASSERT_EQ(body.rest.edges[0].a, 0u);
    ASSERT_EQ(body.rest.edges[0].b, 1u);
    body.rest.edges.erase(body.rest.edges.begin());
    build_one_rings(body.rest);
    testing::rest_frame(body);
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    const size_t whole = built(builder, body).triangles.size();
    EXPECT_EQ(whole, body.fragments->outer_triangles.size());
    // 0 comes off: all its edges break, and the interface without one must let go as well.
    size_t own = 0;
    for (size_t e = 0; e < body.rest.n_edges(); ++e)
        if (body.rest.edges[e].a == 0) body.intact[e] = 0, ++own;
    EXPECT_EQ(own, 2u);
    EXPECT_EQ(built(builder, body).triangles.size(), whole + 3 * 2 * 8);  // three faces of 8 triangles, both sides
}

TEST(visual_mesh, edge_without_an_interface_does_no_harm) {
    Body body = blocks();
    // Corner to corner, as weak lattices have.
    body.rest.edges.insert(body.rest.edges.begin() + 1, Edge{ParticleId(0), ParticleId(26), 0.0});
    std::sort(body.rest.edges.begin(), body.rest.edges.end(),
              [](const Edge& x, const Edge& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
    build_one_rings(body.rest);
    testing::rest_frame(body);
    for (size_t e = 0; e < body.intact.size(); ++e)  // break that one alone: nothing to see
        body.intact[e] = !(body.rest.edges[e].a == 0 && body.rest.edges[e].b == 26);
    EXPECT_EQ(fresh(body).triangles.size(), body.fragments->outer_triangles.size());
}

TEST(visual_mesh, edge_that_breaks_unseen_after_a_visible_one_leaves_the_rest_of_the_skin_alone) {
    // The second state changes weights around 0 and 26 but no topology: what else there is must be kept, not shifted.
    Body body = blocks();
    body.rest.edges.insert(body.rest.edges.begin() + 1, Edge{ParticleId(0), ParticleId(26), 0.0});
    std::sort(body.rest.edges.begin(), body.rest.edges.end(),
              [](const Edge& x, const Edge& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
    build_one_rings(body.rest);
    testing::rest_frame(body);
    shake(body, 0.02, 8);
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    built(builder, body);
    for (size_t e = 0; e < body.intact.size(); ++e)
        if (body.rest.edges[e].a < 6 && body.rest.edges[e].b != 26) body.intact[e] = 0;
    built(builder, body);
    for (size_t e = 0; e < body.intact.size(); ++e)
        if (body.rest.edges[e].b == 26 && body.rest.edges[e].a == 0) body.intact[e] = 0;
    EXPECT_TRUE(same(built(builder, body), fresh(body)));
}

// --- normals ---

TEST(visual_mesh, box_has_sharp_edges_and_flat_sides) {
    const VisualMesh mesh = fresh(blocks());
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        const Vec3f flat =
            (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).normalized();
        for (int k = 0; k < 3; ++k) ASSERT_GT(mesh.corner_normals[3 * t + k].dot(flat), 1 - 1e-5f);
    }
}

TEST(visual_mesh, gentle_curves_are_smooth_across_fragments) {
    // A half cylinder of 16 facets: 11.25 degrees each, to be smoothed; the ends are sharp.
    testing::TetBox box = testing::make_tet_box({16, 1, 4}, 1.0);
    for (Vec3& v : box.vertices) {
        const double angle = M_PI * (1 - v.x() / 16), r = 1 + v.y();
        v = Vec3(r * std::cos(angle), r * std::sin(angle), v.z());
    }
    std::vector<uint32_t> label;
    for (size_t t = 0; t < box.tets.size(); ++t) label.push_back(uint32_t(t / 6) % 16);  // columns along x
    const Body body = testing::make_body(box, label);
    const VisualMesh mesh = fresh(body);
    size_t on_outside = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            bool outside = true;
            for (uint32_t v : mesh.triangles[t]) outside &= std::abs(mesh.positions[v].head<2>().norm() - 2) < 1e-3f;
            const Vec3f p = mesh.positions[mesh.triangles[t][c]];
            if (!outside || p.y() < 0.5f) continue;
            ++on_outside;
            const Vec3f radial = Vec3f(p.x(), p.y(), 0).normalized();
            // facets are off by 5.6 degrees; uneven angles of the triangles around a vertex leave some of it
            EXPECT_GT(mesh.corner_normals[3 * t + c].dot(radial), std::cos(2.5f * float(M_PI) / 180));
        }
    EXPECT_GT(on_outside, 100u);
}

TEST(visual_mesh, rim_between_outer_and_break_surface_is_sharp) {
    // Sheared, so that cuts meet the top at 26 degrees: two outer faces at that angle would be smooth.
    Body body = blocks();
    for (Vec3& v : body.fragments->vertices) v.x() += 2 * v.z();
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const VisualMesh mesh = fresh(body);
    size_t shallow = 0;
    for (size_t t = body.fragments->outer_triangles.size(); t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        const Vec3f edge = mesh.positions[b] - mesh.positions[a];
        const Vec3f flat = edge.cross(mesh.positions[c] - mesh.positions[a]).normalized();
        shallow += flat.z() > 0.8f;
        for (int k = 0; k < 3; ++k) ASSERT_GT(mesh.corner_normals[3 * t + k].dot(flat), 1 - 1e-5f);
    }
    EXPECT_GT(shallow, 0u);
}

TEST(visual_mesh, artists_normals_turn_with_the_body) {
    Body body = blocks();
    FragmentSet& set = *body.fragments;
    const Vec3f leaning = Vec3f(1, 2, 3).normalized();
    set.outer_corner_normals.assign(3 * set.outer_triangles.size(), leaning);
    const Pose pose{Vec3(1, 0, 0), Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX()))};
    Body placed = body;
    placed.rest = SimulationMesh();
    append_body(placed.rest, body.rest, pose);
    build_one_rings(placed.rest);
    testing::rest_frame(placed);
    const Quat turn(Eigen::AngleAxisd(1.1, Vec3::UnitZ()));
    for (size_t i = 0; i < placed.position.size(); ++i)
        placed.position[i] = turn * placed.position[i], placed.orientation[i] = turn * placed.orientation[i];
    VisualMeshBuilder builder(placed.fragments, placed.rest, pose);
    const VisualMesh mesh = built(builder, placed);
    const Vec3f truth = (turn * (pose.orientation * leaning.cast<double>())).cast<float>();
    for (const Vec3f& n : mesh.corner_normals) ASSERT_LT((n - truth).norm(), 1e-5f);
}

TEST(visual_mesh, degenerate_triangles_and_crushed_bodies_give_no_nan) {
    Body body = blocks();
    for (Vec3& v : body.fragments->vertices) v.z() = std::round(v.z() * 4) / 4;  // some cells lose their height
    Body crushed = body;
    for (Vec3& x : crushed.position) x = Vec3(1, 1, 1);
    break_share(crushed, 0.5, 3);
    Body flat = crushed;
    for (Mat3& F : flat.plastic) F = Mat3::Zero();
    for (const Body& b : {body, crushed, flat}) expect_whole(fresh(b));
}

// --- UVs ---

TEST(visual_mesh, uvs_are_the_artists_outside_and_mirrored_on_the_two_sides_of_a_cut) {
    Body body = blocks();
    FragmentSet& set = *body.fragments;
    for (size_t c = 0; c < 3 * set.outer_triangles.size(); ++c) set.outer_corner_uvs.push_back(Vec2f(float(c), 1));
    for (const Triangle& t : set.interface_triangles)
        for (uint32_t v : t)  // any function of the position
            set.interface_corner_uvs.push_back(Vec2f(float(1 + v), float(set.vertices[v].sum())));
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const VisualMesh mesh = fresh(body);
    ASSERT_EQ(mesh.corner_uvs.size(), 3 * mesh.triangles.size());
    const size_t outer = set.outer_triangles.size(), cut = set.interface_triangles.size();
    for (size_t c = 0; c < 3 * outer; ++c) EXPECT_EQ(mesh.corner_uvs[c], Vec2f(float(c), 1));
    for (size_t t = 0; t < cut; ++t)
        for (int c = 0; c < 3; ++c) {
            const size_t side_a = 3 * (outer + t) + c, side_b = 3 * (outer + cut + t) + (3 - c) % 3;
            // the same place ...
            ASSERT_LT((mesh.positions[mesh.triangles[outer + t][c]] -
                       mesh.positions[mesh.triangles[outer + cut + t][(3 - c) % 3]])
                          .norm(),
                      1e-6f);
            // ... has the same texture, seen from behind
            EXPECT_EQ(mesh.corner_uvs[side_a], set.interface_corner_uvs[3 * t + c]);
            EXPECT_EQ(mesh.corner_uvs[side_b], Vec2f(-mesh.corner_uvs[side_a].x(), mesh.corner_uvs[side_a].y()));
        }
}

TEST(visual_mesh, missing_uvs_of_one_kind_are_zero) {
    Body body = blocks();
    body.fragments->outer_corner_uvs.assign(3 * body.fragments->outer_triangles.size(), Vec2f(0.25f, 0.5f));
    std::fill(body.intact.begin(), body.intact.end(), 0);
    const VisualMesh mesh = fresh(body);
    ASSERT_EQ(mesh.corner_uvs.size(), 3 * mesh.triangles.size());
    EXPECT_EQ(mesh.corner_uvs[0], Vec2f(0.25f, 0.5f));
    EXPECT_EQ(mesh.corner_uvs.back(), Vec2f(0, 0));
}

// --- bad input ---

ErrorCode code_of(VisualMeshBuilder& builder, const BodyFrame& frame) {
    const Result<VisualMesh> mesh = builder.build(frame);
    EXPECT_FALSE(mesh);
    return mesh ? ErrorCode::internal : mesh.error().code;
}

TEST(visual_mesh, frames_that_do_not_fit_the_body_are_refused) {
    Body body = blocks();
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    const BodyFrame good = frame_of(body);
    BodyFrame bad = good;
    bad.position = bad.position.first(26);
    EXPECT_EQ(code_of(builder, bad), ErrorCode::bad_input);
    bad = good, bad.orientation = {};
    EXPECT_EQ(code_of(builder, bad), ErrorCode::bad_input);
    bad = good, bad.plastic_deformation = bad.plastic_deformation.first(1);
    EXPECT_EQ(code_of(builder, bad), ErrorCode::bad_input);
    bad = good, bad.edge_intact = bad.edge_intact.first(53);
    EXPECT_EQ(code_of(builder, bad), ErrorCode::bad_input);
    EXPECT_TRUE(builder.build(good));  // and none of it has spoilt the builder
}

TEST(visual_mesh, numbers_gone_bad_are_reported_with_the_particle) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Body good = blocks();
    VisualMeshBuilder builder(good.fragments, good.rest, {});
    Body bad = good;
    bad.position[5].y() = nan;
    const Result<VisualMesh> mesh = builder.build(frame_of(bad));
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, ErrorCode::numerical);
    EXPECT_NE(mesh.error().what.find("particle 5"), std::string::npos);
    bad = good, bad.orientation[3].coeffs().setZero();
    EXPECT_EQ(code_of(builder, frame_of(bad)), ErrorCode::numerical);
    bad = good, bad.plastic[3](0, 1) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(code_of(builder, frame_of(bad)), ErrorCode::numerical);
    EXPECT_TRUE(builder.build(frame_of(good)));
}

TEST(visual_mesh, fragments_that_do_not_fit_together_are_refused) {
    auto refused = [](const std::function<void(FragmentSet&, SimulationMesh&)>& spoil) {
        Body body = blocks();
        const Body good = body;
        spoil(*body.fragments, body.rest);
        VisualMeshBuilder builder(body.fragments, body.rest, {});
        EXPECT_EQ(code_of(builder, frame_of(good)), ErrorCode::bad_input);
    };
    refused([](FragmentSet& s, SimulationMesh&) { s.fragments.pop_back(); });
    refused([](FragmentSet& s, SimulationMesh&) { s.fragments.clear(); });
    refused([](FragmentSet& s, SimulationMesh&) { s.fragments[3].outer_end = 1 << 30; });
    refused([](FragmentSet& s, SimulationMesh&) { s.outer_triangles[0][0] = 1 << 30; });
    refused([](FragmentSet& s, SimulationMesh&) { s.outer_triangles[0][0] = s.outer_triangles[0][1]; });
    refused([](FragmentSet& s, SimulationMesh&) { std::swap(s.outer_triangles[0][0], s.outer_triangles[0][1]); });
    refused([](FragmentSet& s, SimulationMesh&) { s.interfaces[4].triangle_end = 1 << 30; });
    refused([](FragmentSet& s, SimulationMesh&) { std::swap(s.interfaces[4], s.interfaces[5]); });
    refused([](FragmentSet& s, SimulationMesh&) { s.interfaces.pop_back(); });
    refused([](FragmentSet& s, SimulationMesh&) { s.interfaces.back().b = FragmentId(99); });
    refused([](FragmentSet& s, SimulationMesh&) { s.outer_material.pop_back(); });
    refused([](FragmentSet& s, SimulationMesh&) { s.outer_corner_uvs.resize(5); });
    refused([](FragmentSet& s, SimulationMesh&) { s.outer_corner_normals.resize(5); });
    refused([](FragmentSet& s, SimulationMesh&) { s.interface_corner_uvs.resize(5); });
    refused([](FragmentSet& s, SimulationMesh&) { s.vertices[9].x() = std::numeric_limits<double>::quiet_NaN(); });
    refused([](FragmentSet&, SimulationMesh& m) { m.rest_position.pop_back(); });
    refused([](FragmentSet&, SimulationMesh& m) { m.edges[0].b = ParticleId(99); });
    refused([](FragmentSet&, SimulationMesh& m) { m.group_offset.clear(); });
    refused([](FragmentSet&, SimulationMesh& m) { m.rest_position[0].x() = std::numeric_limits<double>::infinity(); });
}

TEST(visual_mesh, no_fragments_at_all_are_refused) {
    VisualMeshBuilder builder(nullptr, SimulationMesh(), {});
    EXPECT_FALSE(builder.build({}));
}

}  // namespace
}  // namespace sunder
