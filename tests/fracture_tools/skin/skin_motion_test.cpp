// What the deformer does not work out again, and what several threads do, changes no bit.
#include "fracture_tools/skin/skin_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "fracture_tools/skin/corner_weights.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder {
namespace {

using testing::Body;

Body small_box() {
    const auto box = testing::make_tet_box({6, 6, 12}, 1.0 / 6, 0.2);
    return testing::make_body(box, testing::kmeans_labels(box, 40, 3));
}

Body with_artist_normals(Body body) {
    auto set = std::make_shared<FragmentSet>(*body.fragments);
    for (const Triangle& t : set->outer_triangles)
        for (const uint32_t v : t) set->outer_corner_normals.push_back(set->vertices[v].normalized().cast<float>());
    body.fragments = set;
    return body;
}

BodyFrame frame_of(const Body& body) { return {body.position, body.orientation, body.plastic, body.intact}; }

VisualMeshBuilder builder_of(const Body& body, VisualTopology topology = VisualTopology::compact) {
    return VisualMeshBuilder(body.fragments, body.rest, {}, topology);
}

void expect_same(const VisualMesh& a, const VisualMesh& b, const std::string& where) {
    EXPECT_EQ(a.positions, b.positions) << where;
    EXPECT_EQ(a.corner_normals, b.corner_normals) << where;
    EXPECT_EQ(a.triangles, b.triangles) << where;
    EXPECT_EQ(a.triangle_fragment, b.triangle_fragment) << where;
    EXPECT_EQ(a.triangle_interface, b.triangle_interface) << where;
    EXPECT_EQ(a.vertex_fragment, b.vertex_fragment) << where;
    EXPECT_EQ(a.skin->influence_offset(), b.skin->influence_offset()) << where;
}

// Moves some particles, all of them or none; breaks some edges now and then.
void next_frame(Body& body, int frame, std::mt19937& random) {
    const auto share = [&] { return random() / 4294967296.0; };
    const double moving = frame % 4 == 0 ? 0 : frame % 4 == 1 ? 1 : 0.1;
    for (size_t p = 0; p < body.position.size(); ++p)
        if (share() < moving) {
            body.position[p] += 0.02 * Vec3(share(), share(), share());
            body.orientation[p] = (body.orientation[p] * Quat(1, 0.1 * share(), 0.1 * share(), 0)).normalized();
        }
    for (uint8_t& intact : body.intact)
        if (frame % 3 == 2 && share() < 0.15) intact = 0;
}

class Incremental : public ::testing::TestWithParam<VisualTopology> {};
INSTANTIATE_TEST_SUITE_P(Topologies, Incremental, ::testing::Values(VisualTopology::compact, VisualTopology::constant),
                         [](const auto& info) {
                             return info.param == VisualTopology::compact ? "compact" : "constant";
                         });

TEST_P(Incremental, frames_after_others_have_the_bits_of_frames_alone) {
    for (const bool has_normals : {false, true}) {
        Body body = has_normals ? with_artist_normals(small_box()) : small_box();
        VisualMeshBuilder kept = builder_of(body, GetParam());
        std::mt19937 random(5);
        std::vector<Body> shown;
        for (int frame = 0; frame < 16; ++frame) {
            next_frame(body, frame, random);
            shown.push_back(body);
            const auto mesh = kept.build(frame_of(body));
            ASSERT_TRUE(mesh);
            VisualMeshBuilder fresh = builder_of(body, GetParam());
            expect_same(*mesh, *fresh.build(frame_of(body)), "frame " + std::to_string(frame));
        }
        for (const int frame : {3, 15, 0, 8}) {  // edges heal
            VisualMeshBuilder fresh = builder_of(body, GetParam());
            expect_same(*kept.build(frame_of(shown[frame])), *fresh.build(frame_of(shown[frame])),
                        "back to frame " + std::to_string(frame));
        }
    }
}

// As threads that come and go: three of them, each for a third.
const RangeRunner kTorn = [](size_t n, size_t, const std::function<void(size_t, size_t)>& body) {
    std::vector<std::jthread> threads;
    for (size_t begin = 0; begin < n; begin += n / 3 + 1)
        threads.emplace_back([&, begin] { body(begin, std::min(n, begin + n / 3 + 1)); });
};

TEST_P(Incremental, any_split_of_the_work_over_threads_gives_the_same_bits) {
    Body body = with_artist_normals(small_box());
    VisualMeshBuilder one = builder_of(body, GetParam()), many = builder_of(body, GetParam());
    std::mt19937 random(6);
    for (int frame = 0; frame < 8; ++frame) {
        next_frame(body, frame, random);
        expect_same(*one.build(frame_of(body)), *many.build(frame_of(body), kTorn), "frame " + std::to_string(frame));
    }
}

// Of different sizes, more of them than threads; one is at fault now and then.
TEST_P(Incremental, bodies_made_together_have_the_bits_of_bodies_made_alone) {
    const auto box = testing::make_tet_box({4, 4, 4}, 0.25, 0.2);
    std::vector<Body> bodies = {testing::make_body(box, testing::kmeans_labels(box, 8, 1)),
                                with_artist_normals(small_box()), small_box(),
                                testing::make_body(box, testing::kmeans_labels(box, 20, 2))};
    std::vector<std::unique_ptr<VisualMeshBuilder>> builders;
    std::vector<VisualMesh> meshes(bodies.size());
    for (const Body& b : bodies)
        builders.push_back(std::make_unique<VisualMeshBuilder>(b.fragments, b.rest, Pose{}, GetParam()));
    std::mt19937 random(8);
    for (int frame = 0; frame < 12; ++frame) {
        for (Body& b : bodies) next_frame(b, frame, random);
        const bool is_faulty = frame % 5 == 3;
        const std::vector<VisualMesh> before = meshes;
        std::vector<MovingBody> moving;
        for (size_t b = 0; b < bodies.size(); ++b)
            moving.push_back({builders[b].get(), frame_of(bodies[b]), &meshes[b]});
        if (is_faulty) moving[3].frame.edge_intact = {}, moving[1].frame.position = {};
        const std::vector<Status> status = build_meshes(moving, kTorn);
        for (const size_t b : {0, 1, 2, 3}) EXPECT_EQ(bool(status[b]), !is_faulty || b % 2 == 0) << b;
        if (is_faulty) {
            EXPECT_NE(status[1].error().what.find("0 positions"), std::string::npos) << status[1].error().what;
            EXPECT_NE(status[3].error().what.find("0 edges"), std::string::npos) << status[3].error().what;
        }
        for (const size_t b : {0, 1, 2, 3}) {
            const std::string where = "frame " + std::to_string(frame) + " body " + std::to_string(b);
            if (is_faulty && b % 2 == 1)
                expect_same(meshes[b], before[b], where);
            else
                expect_same(meshes[b], *builder_of(bodies[b], GetParam()).build(frame_of(bodies[b])), where);
        }
    }
}

TEST_P(Incremental, a_body_at_rest_gives_the_arrays_of_the_frame_before) {
    Body body = small_box();
    VisualMeshBuilder builder = builder_of(body, GetParam());
    const VisualMesh before = *builder.build(frame_of(body)), after = *builder.build(frame_of(body));
    EXPECT_EQ(before.positions.data(), after.positions.data());
    EXPECT_EQ(before.corner_normals.data(), after.corner_normals.data());
    EXPECT_EQ(before.triangles.data(), after.triangles.data());
    body.position[0].x() += 0.01;
    const VisualMesh moved = *builder.build(frame_of(body));
    EXPECT_NE(moved.positions, after.positions);
    EXPECT_EQ(moved.triangles.data(), after.triangles.data());
}

std::vector<std::pair<uint32_t, float>> influences_of(const SkinBinding& skin) {
    std::vector<std::pair<uint32_t, float>> all;
    for (size_t v = 0; v < skin.n_vertices(); ++v)
        for (const auto& [particle, weight] : skin.influences(v)) all.emplace_back(particle, weight);
    return all;
}

TEST(VisualMesh, a_frame_that_is_held_stays_as_it_is_while_others_are_made) {
    Body body = small_box();
    VisualMeshBuilder builder = builder_of(body);
    std::mt19937 random(7);
    const VisualMesh held = *builder.build(frame_of(body));
    const std::vector<Vec3f> positions = held.positions, normals = held.corner_normals;
    const std::vector<Triangle> triangles = held.triangles;
    const auto offset = held.skin->influence_offset();
    const auto influences = influences_of(*held.skin);
    for (int frame = 0; frame < 12; ++frame) {
        next_frame(body, frame, random);
        ASSERT_TRUE(builder.build(frame_of(body)));
    }
    EXPECT_EQ(held.positions.vector(), positions);
    EXPECT_EQ(held.corner_normals.vector(), normals);
    EXPECT_EQ(held.triangles.vector(), triangles);
    EXPECT_EQ(held.skin->influence_offset(), offset);
    EXPECT_EQ(influences_of(*held.skin), influences);
}

TEST(SkinMotion, vector_registers_of_any_width_give_the_bits_of_the_plain_sum) {
    const Body body = small_box();
    SplitTopology topology = SplitTopology::make(make_fragment_faces(*body.fragments).take()).take();
    topology.update(body.intact);
    Skin skin(body.fragments->vertices, body.rest);
    skin.bind(topology, body.intact);
    std::mt19937 random(9);
    std::normal_distribution<double> normal;
    std::vector<Affine> maps(body.position.size());
    for (Affine& a : maps) {
        for (double& x : a.linear.reshaped()) x = normal(random);
        for (double& x : a.offset) x = 10 * normal(random);
    }
    SkinMotion motion(SkinExtras::normal_maps, 0);
    const SkinBinding& binding = *skin.binding();
    ASSERT_TRUE(motion.take(true, {maps, {}, {}}, {maps, {}, {}}));
    std::vector<NormalMap> normal_maps;
    motion.move(binding, run_serially, [&](size_t, std::span<const NormalMap> of_chunk) {
        normal_maps.insert(normal_maps.end(), of_chunk.begin(), of_chunk.end());
    });
    ASSERT_EQ(normal_maps.size(), binding.n_vertices());
    for (size_t v = 0; v < binding.n_vertices(); ++v) {
        double sum[3][4] = {};
        for (const auto& [p, w] : binding.influences(v))
            for (int i = 0; i < 3; ++i)
                for (int c = 0; c < 4; ++c) sum[i][c] += w * (c < 3 ? maps[p].linear(i, c) : maps[p].offset[i]);
        const Vec3& x = binding.rest_position(v);
        for (int i = 0; i < 3; ++i)
            EXPECT_EQ(motion.positions()[v][i], sum[i][0] * x[0] + sum[i][1] * x[1] + sum[i][2] * x[2] + sum[i][3]);
        EXPECT_EQ(motion.velocities()[v], motion.positions()[v]);  // the same maps
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 3; ++i) {
                const int a = (i + 1) % 3, b = (i + 2) % 3, c = (k + 1) % 3, d = (k + 2) % 3;
                EXPECT_EQ(normal_maps[v].column[k][i],
                          static_cast<float>(sum[a][c] * sum[b][d] - sum[b][c] * sum[a][d]));
            }
    }
}

TEST(SkinMotion, what_turns_follows_the_weighted_rotation_whatever_the_signs_of_quaternions) {
    const Body body = small_box();
    SplitTopology topology = SplitTopology::make(make_fragment_faces(*body.fragments).take()).take();
    topology.update(body.intact);
    Skin skin(body.fragments->vertices, body.rest);
    skin.bind(topology, body.intact);
    std::mt19937 random(10);
    std::normal_distribution<double> normal;
    const size_t n = body.position.size();
    ParticleMaps maps{std::vector<Affine>(n), std::vector<Affine>(n), std::vector<Quat>(n)};
    for (size_t p = 0; p < n; ++p) {
        for (double& x : maps.carried[p].linear.reshaped()) x = normal(random);
        for (double& x : maps.turned[p].linear.reshaped()) x = normal(random);
        const Vec3 axis = Vec3(normal(random), normal(random), normal(random)).normalized();
        const Quat turn(Eigen::AngleAxisd(0.3 * normal(random), axis));
        maps.turn[p] = random() % 2 ? turn : Quat(-turn.coeffs());
    }
    SkinMotion motion(SkinExtras::none, 0);
    const SkinBinding& binding = *skin.binding();
    ASSERT_TRUE(motion.take(true, maps, {}));
    motion.move(binding, run_serially);
    for (size_t v = 0; v < binding.n_vertices(); ++v) {
        const Vec3& x = binding.rest_position(v);
        Vec3 carried = Vec3::Zero(), arm = Vec3::Zero();
        Mat3 linear = Mat3::Zero(), of_arm = Mat3::Zero();
        Eigen::Vector4d sum = Eigen::Vector4d::Zero();
        for (const auto& [p, w] : binding.influences(v)) {
            carried += w * maps.carried[p].apply(x), linear += w * maps.carried[p].linear;
            arm += w * maps.turned[p].apply(x), of_arm += w * maps.turned[p].linear;
            sum += w * (maps.turn[p].w() < 0 ? -1 : 1) * maps.turn[p].coeffs();  // none turns by half a turn
        }
        const Mat3 Q = Quat(sum).normalized().toRotationMatrix();
        EXPECT_LT((motion.positions()[v] - (carried + Q * arm)).norm(), 1e-13);
        EXPECT_LT((motion.linear_at(binding, v) - (linear + Q * of_arm)).norm(), 1e-13);
    }
    for (Affine& a : maps.turned) a = {Mat3::Zero(), Vec3::Zero()};
    const std::vector<Vec3> before(motion.positions().begin(), motion.positions().end());
    ASSERT_TRUE(motion.take(false, maps, {}));
    motion.move(binding, run_serially);
    SkinMotion plain(SkinExtras::none, 0);
    plain.take(true, {maps.carried, {}, {}}, {});
    plain.move(binding, run_serially);
    EXPECT_TRUE(std::ranges::equal(motion.positions(), plain.positions()));  // to the bit: blocks beside sheets
    EXPECT_FALSE(std::ranges::equal(motion.positions(), before));
}

TEST(CornerWeights, angles_and_normals_of_triangles_of_all_shapes_and_sizes) {
    std::mt19937 random(8);
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
    std::vector<uint32_t> which;
    for (uint32_t t = 0; t < 1001; ++t) {  // no multiple of a batch
        const double size = std::pow(10.0, int(t % 9) - 6), squeeze = t % 2 ? 1 : 1e-3;
        const Vec3 a = 10 * vector(), side = vector();
        points.push_back(a), points.push_back(a + size * side);
        points.push_back(a + size * (0.5 * side + squeeze * vector()));
        triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2}), which.push_back(7 + t);
    }
    const std::vector<uint8_t> silent(which.size() + 7, 0);
    std::vector<CornerWeights> out(which.size());
    weigh_corners(triangles, which, silent, points, 0, which.size(), 7, out.data());
    for (uint32_t t = 0; t < which.size(); ++t) {
        const Vec3 corner[3] = {points[3 * t], points[3 * t + 1], points[3 * t + 2]};
        const Vec3 n = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
        double longest = 0;
        for (int c = 0; c < 3; ++c) longest = std::max(longest, (corner[(c + 1) % 3] - corner[c]).squaredNorm());
        if (n.norm() < 2 * kSliver * longest) continue;
        EXPECT_LT((out[t].normal.cast<double>() - n.normalized()).norm(), 1e-6) << t;
        for (int c = 0; c < 3; ++c) {
            const Vec3 u = corner[(c + 1) % 3] - corner[c], v = corner[(c + 2) % 3] - corner[c];
            EXPECT_NEAR(out[t].angle[c], std::atan2(u.cross(v).norm(), u.dot(v)), 1e-6) << t;
        }
    }
}

TEST(CornerWeights, triangles_without_area_say_nothing) {
    const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 0, 0}, {0, 1, 1}};
    const std::vector<uint32_t> which = {0, 1, 2};
    CornerWeights out[3];
    weigh_corners(triangles, which, std::vector<uint8_t>(3, 0), points, 0, 3, 0, out);
    for (const CornerWeights& w : out) {
        EXPECT_TRUE(w.normal.isZero(0));
        EXPECT_TRUE(w.angle.allFinite());
    }
}

}  // namespace
}  // namespace sunder
