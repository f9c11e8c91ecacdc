// What artists see of a cut along Voronoi cells: nothing until it breaks, and closed pieces when it has.
#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/voronoi_body.h"

namespace sunder {
namespace {

TriMesh bunny() {
    Result<TriMesh> mesh = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    EXPECT_TRUE(mesh);
    return mesh ? mesh.take() : TriMesh();
}

/// The bunny with what an artist adds: a UV chart with seams, normals that are not the geometry's, three materials.
TriMesh dressed_bunny() {
    TriMesh mesh = bunny();
    mesh.material_names = {"fur", "belly", "ears"};
    std::mt19937 random(1);
    for (const Triangle& t : mesh.triangles) {
        const Vec3 middle = (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3;
        mesh.triangle_material.push_back(middle.z() > 0.7 ? 2 : middle.y() < 0 ? 1 : 0);
        for (uint32_t v : t) {
            const Vec3& p = mesh.positions[v];
            mesh.corner_uvs.push_back(Vec2f(float(middle.x() > 0 ? 3 : 0), 0) + Vec2f(float(p.x()), float(p.z())));
            const Vec3 n = Vec3(p.x(), p.y(), p.z() - 0.5) + 0.2 * Vec3(random() % 7, random() % 5, random() % 3);
            mesh.corner_normals.push_back(n.normalized().cast<float>());
        }
    }
    return mesh;
}

using Body = testing::VoronoiBody;

MeshReport report(const VisualMesh& mesh) {
    std::vector<Vec3> points;
    for (const Vec3f& p : mesh.positions) points.push_back(p.cast<double>());
    return check_mesh(MeshView(points, mesh.triangles));
}

size_t unbalanced_edges(const VisualMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> surplus;
    for (const Triangle& t : mesh.triangles)
        for (int c = 0; c < 3; ++c) surplus[std::minmax(t[c], t[(c + 1) % 3])] += t[c] < t[(c + 1) % 3] ? 1 : -1;
    return size_t(std::count_if(surplus.begin(), surplus.end(), [](const auto& s) { return s.second != 0; }));
}

/// Weights of p in a triangle; p lies in its plane.
Vec3 weights(const TriMesh& mesh, uint32_t t, const Vec3& p) {
    const Vec3 &a = mesh.positions[mesh.triangles[t][0]], &b = mesh.positions[mesh.triangles[t][1]],
               &c = mesh.positions[mesh.triangles[t][2]];
    const Vec3 n = (b - a).cross(c - a);
    const double v = (p - a).cross(c - a).dot(n) / n.squaredNorm(), w = (b - a).cross(p - a).dot(n) / n.squaredNorm();
    return {1 - v - w, v, w};
}

TEST(VisualContract, before_the_first_break_the_mesh_is_the_artists_own) {
    const TriMesh mesh = dressed_bunny();
    const Body body(mesh, 200);
    const VisualMesh visual = body.frame();
    const MeshReport whole = report(visual);
    EXPECT_TRUE(whole.is_solid()) << whole.faults[0];
    EXPECT_EQ(whole.n_components, 1u);
    EXPECT_NEAR(whole.volume, mesh_volume(mesh), 1e-6);  // positions are floats
    EXPECT_NEAR(whole.area, mesh_area(mesh), 1e-5);

    // Each triangle lies in one of the artist's: found by its middle, told by attributes that jump between triangles.
    std::vector<double> covered(mesh.triangles.size(), 0);
    size_t searched = 0;
    for (size_t k = 0; k < visual.triangles.size(); ++k) {
        std::array<Vec3, 3> p;
        for (int c = 0; c < 3; ++c) p[c] = body.set->vertices[body.set->outer_triangles[k][c]];
        const double area = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
        if (area < 1e-9) continue;  // too thin to tell its place by coordinates
        ++searched;
        const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
        double best = 1e9;
        uint32_t source = 0;
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto& [a, b, c] = mesh.triangles[t];
            if ((mesh.positions[a] - middle).squaredNorm() > 0.02) continue;
            const Vec3 w = weights(mesh, t, middle);
            if (w.minCoeff() < -1e-9) continue;
            const double off =
                (w[0] * mesh.positions[a] + w[1] * mesh.positions[b] + w[2] * mesh.positions[c] - middle).norm();
            if (off < best) best = off, source = t;
        }
        ASSERT_LT(best, 1e-12) << "triangle " << k << " is not on the artist's surface";
        covered[source] += area;
        EXPECT_EQ(visual.triangle_material[k], mesh.triangle_material[source]);
        for (int c = 0; c < 3; ++c) {
            EXPECT_LT((visual.positions[visual.triangles[k][c]].cast<double>() - p[c]).norm(), 1e-6);
            const Vec3 w = weights(mesh, source, p[c]);
            Vec3 n = Vec3::Zero();
            Eigen::Vector2d uv = Eigen::Vector2d::Zero();
            for (int m = 0; m < 3; ++m) {
                n += w[m] * mesh.corner_normals[3 * source + m].cast<double>();
                uv += w[m] * mesh.corner_uvs[3 * source + m].cast<double>();
            }
            EXPECT_LT((visual.corner_normals[3 * k + c].cast<double>() - n.normalized()).norm(), 2e-6);
            EXPECT_LT((visual.corner_uvs[3 * k + c].cast<double>() - uv).norm(), 1e-6);
        }
    }
    EXPECT_GT(searched, mesh.triangles.size());
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& v = mesh.triangles[t];
        const double area =
            0.5 *
            (mesh.positions[v[1]] - mesh.positions[v[0]]).cross(mesh.positions[v[2]] - mesh.positions[v[0]]).norm();
        EXPECT_NEAR(covered[t], area, 2e-8) << "triangle " << t;  // less what was too thin
    }
}

/// Shading must not show where it will break: at each point the normal is that of the mesh before it was cut.
TEST(VisualContract, a_mesh_without_normals_is_shaded_as_if_it_were_not_cut) {
    const TriMesh mesh = bunny();
    const Body body(mesh, 200), uncut(mesh, 1);
    const VisualMesh visual = body.frame(), whole = uncut.frame();
    std::map<std::array<float, 3>, std::vector<Vec3f>> normals;  // of the uncut mesh, by position
    auto key = [](const Vec3f& p) { return std::array<float, 3>{p.x(), p.y(), p.z()}; };
    for (size_t c = 0; c < whole.corner_normals.size(); ++c)
        normals[key(whole.positions[whole.triangles[c / 3][c % 3]])].push_back(whole.corner_normals[c]);
    size_t compared = 0;
    for (size_t c = 0; c < visual.corner_normals.size(); ++c) {
        const auto found = normals.find(key(visual.positions[visual.triangles[c / 3][c % 3]]));
        if (found == normals.end()) continue;
        float nearest = 2;
        for (const Vec3f& n : found->second) nearest = std::min(nearest, (n - visual.corner_normals[c]).norm());
        EXPECT_LT(nearest, 1e-5);
        ++compared;
    }
    EXPECT_GT(compared, mesh.triangles.size());
}

TEST(VisualContract, breaking_any_share_of_the_interfaces_keeps_every_edge_balanced) {
    for (const TriMesh& mesh : {bunny(), testing::make_box(Vec3(1, 1, 0.02)), testing::make_torus()}) {
        Body body(mesh, 60);
        for (double share : {0.0, 0.02, 0.2, 0.6, 1.0}) {
            body.break_share(share, 7);
            const VisualMesh visual = body.frame();
            EXPECT_EQ(unbalanced_edges(visual), 0u) << share;
            // Pieces of the graph of unbroken interfaces.
            std::vector<uint32_t> piece(body.rest.n_particles());
            std::iota(piece.begin(), piece.end(), 0u);
            auto root = [&](uint32_t i) {
                while (piece[i] != i) i = piece[i];
                return i;
            };
            size_t pieces = piece.size();
            for (size_t e = 0; e < body.intact.size(); ++e)
                if (body.intact[e] && root(body.rest.edges[e].a) != root(body.rest.edges[e].b))
                    piece[root(body.rest.edges[e].a)] = root(body.rest.edges[e].b), --pieces;
            const MeshReport r = report(visual);
            if (share == 0 || share == 1 || share == 0.02) {
                EXPECT_EQ(r.n_components, pieces) << share;
            }
            if (share == 0 || share == 1) {
                EXPECT_EQ(r.open_edges + r.non_manifold_edges + r.non_manifold_vertices + r.inconsistent_edges, 0u);
            }
            EXPECT_NEAR(r.volume, mesh_volume(mesh), 1e-5 * mesh_volume(mesh));
        }
    }
}

// A contact too small to hold by itself must not tie the two sides of a crack together, nor open before it.
TEST(VisualContract, an_interface_without_an_edge_parts_with_what_is_around_it) {
    PrefractureSettings settings;
    settings.weak_interface_share = 0.3;
    Body body(bunny(), 60, settings);
    size_t n_seen = 0;
    for (uint32_t i = 0; i < body.set->interfaces.size(); ++i) {
        const Interface& weak = body.set->interfaces[i];
        if (weak.joins) continue;
        std::fill(body.intact.begin(), body.intact.end(), uint8_t{1});
        std::vector<uint32_t> around;  // edges of a to those that b is joined to as well
        for (uint32_t e = 0; e < body.rest.n_edges(); ++e) {
            const uint32_t a = body.rest.edges[e].a, b = body.rest.edges[e].b;
            if (a != weak.a.value && b != weak.a.value) continue;
            const uint32_t third = a == weak.a.value ? b : a;
            for (const Edge& f : body.rest.edges)
                if (f.a == std::min(third, weak.b.value) && f.b == std::max(third, weak.b.value)) around.push_back(e);
        }
        if (around.size() < 2 || ++n_seen > 8) continue;
        auto visible = [&] {
            const VisualMesh mesh = body.frame();
            EXPECT_EQ(unbalanced_edges(mesh), 0u);
            return std::count(mesh.triangle_interface.begin(), mesh.triangle_interface.end(), int32_t(i));
        };
        for (size_t k = 0; k + 1 < around.size(); ++k) body.intact[around[k]] = 0;
        EXPECT_EQ(visible(), 0) << "interface " << i;
        body.intact[around.back()] = 0;
        EXPECT_GT(visible(), 0) << "interface " << i;  // all but what other fragments hold at every vertex
    }
    EXPECT_GT(n_seen, 4u);
}

TEST(VisualContract, marks_of_the_cut_come_through) {
    TriMesh mesh = bunny();
    for (size_t c = 0; c < 3 * mesh.triangles.size(); ++c) mesh.corner_colors.push_back({0.5f, 0.25f, 0, 1});
    Body body(mesh, 30);
    std::fill(body.intact.begin(), body.intact.end(), uint8_t{0});
    const VisualMesh visual = body.frame();
    ASSERT_EQ(visual.triangle_interface.size(), visual.triangles.size());
    ASSERT_EQ(visual.corner_rim.size(), 3 * visual.triangles.size());
    ASSERT_EQ(visual.corner_colors.size(), 3 * visual.triangles.size());
    size_t n_rim = 0;
    for (size_t t = 0; t < visual.triangles.size(); ++t) {
        const bool interior = visual.triangle_material[t] == body.set->interior_material;
        EXPECT_EQ(visual.triangle_interface[t] >= 0, interior);
        for (size_t c = 3 * t; c < 3 * t + 3; ++c) {
            EXPECT_EQ(visual.corner_colors[c], interior ? (Color{1, 1, 1, 1}) : (Color{0.5f, 0.25f, 0, 1}));
            EXPECT_TRUE(visual.corner_rim[c] == 0 || (interior && visual.corner_rim[c] == 1));
            n_rim += visual.corner_rim[c] == 1;
        }
        if (!interior) continue;
        const Interface& from = body.set->interfaces[size_t(visual.triangle_interface[t])];
        EXPECT_TRUE(visual.triangle_fragment[t] == from.a.value || visual.triangle_fragment[t] == from.b.value);
    }
    EXPECT_GT(n_rim, 100u);
}

}  // namespace
}  // namespace sunder
