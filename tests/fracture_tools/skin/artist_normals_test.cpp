// Each corner of the outer surface keeps the normal that it was given, turned as the skin turns at its vertex.
#include "fracture_tools/skin/artist_normals.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <map>
#include <random>

#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/skinning.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder {
namespace {

using testing::Body;

Vec3 turned(const Mat3& linear, const Vec3& n) {
    Mat3 cofactor;
    for (int k = 0; k < 3; ++k) cofactor.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    return (cofactor * n).normalized();
}

// Two normals at each vertex, so that corners of one fan differ, and those of several fans agree.
Body with_two_normals_a_vertex(std::mt19937& random) {
    const auto box = testing::make_tet_box({4, 4, 6}, 0.25, 0.2);
    Body body = testing::make_body(box, testing::kmeans_labels(box, 20, 3));
    std::normal_distribution<float> normal;
    std::vector<std::array<Vec3f, 2>> of_vertex(body.fragments->vertices.size());
    for (auto& pair : of_vertex)
        for (Vec3f& n : pair) n = Vec3f(normal(random), normal(random), normal(random)).normalized();
    auto set = std::make_shared<FragmentSet>(*body.fragments);
    for (const Triangle& t : set->outer_triangles)
        for (const uint32_t v : t) set->outer_corner_normals.push_back(of_vertex[v][random() % 2]);
    body.fragments = set;
    return body;
}

TEST(ArtistNormals, each_corner_has_its_own_while_vertices_bend_and_split) {
    std::mt19937 random(2);
    Body body = with_two_normals_a_vertex(random);
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    ParticleTransforms transforms(body.rest);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int frame = 0; frame < 4; ++frame) {
        for (size_t p = 0; p < body.position.size(); ++p) {
            body.position[p] += 0.02 * Vec3(uniform(random), uniform(random), uniform(random));
            body.orientation[p] =
                (body.orientation[p] * Quat(1, 0.2 * uniform(random), 0.2 * uniform(random), 0)).normalized();
        }
        const auto mesh = builder.build({body.position, body.orientation, body.plastic, body.intact});
        ASSERT_TRUE(mesh);
        ParticleMaps particle;
        transforms.evaluate(body.position, body.orientation, body.plastic, body.intact, particle);
        for (size_t t = 0; t < body.fragments->outer_triangles.size(); ++t)
            for (size_t c = 0; c < 3; ++c) {
                Mat3 linear = Mat3::Zero();
                for (const auto& [p, w] : mesh->skin->influences(mesh->triangles[t][c]))
                    linear += double{w} * particle.carried[p].linear;
                const Vec3 truth = turned(linear, body.fragments->outer_corner_normals[3 * t + c].cast<double>());
                ASSERT_LT((mesh->corner_normals[3 * t + c].cast<double>() - truth).norm(), 1e-5) << t << ' ' << c;
            }
        for (uint8_t& intact : body.intact)
            if (random() % 4 == 0) intact = 0;
    }
}

TEST(ArtistNormals, corners_of_a_fan_share_those_that_are_equal_and_no_others) {
    std::mt19937 random(3);
    const Body body = with_two_normals_a_vertex(random);
    const SplitTopology topology = SplitTopology::make(make_fragment_faces(*body.fragments).take()).take();
    const auto& given = body.fragments->outer_corner_normals;
    const ArtistNormals normals(topology, given);
    EXPECT_LT(normals.size(), given.size());
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> of_fan;  // (fan, bits of the first number): which
    for (uint32_t c = 0; c < given.size(); ++c) {
        const auto key = std::pair(topology.corner_fan(c), std::bit_cast<uint32_t>(given[c].x()));
        EXPECT_EQ(of_fan.emplace(key, normals.of_corner()[c]).first->second, normals.of_corner()[c]) << c;
    }
    EXPECT_EQ(of_fan.size(), normals.size());
}

}  // namespace
}  // namespace sunder
