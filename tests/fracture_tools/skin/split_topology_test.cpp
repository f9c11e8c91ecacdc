#include "fracture_tools/skin/split_topology.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder {
namespace {

using testing::Body;
using testing::make_body;
using testing::make_tet_box;

SplitTopology topology_of(const FragmentSet& set) {
    Result<FragmentFaces> faces = make_fragment_faces(set);
    EXPECT_TRUE(faces) << faces.error().text();
    Result<SplitTopology> topology = SplitTopology::make(faces.take());
    EXPECT_TRUE(topology) << topology.error().text();
    return topology.take();
}

int unbalanced_edges(const SplitTopology& topology) {
    std::map<std::pair<uint32_t, uint32_t>, int> surplus;
    for (const Triangle& t : topology.triangles())
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = t[c], w = t[(c + 1) % 3];
            surplus[{std::min(v, w), std::max(v, w)}] += v < w ? 1 : -1;
        }
    int bad = 0;
    for (const auto& [edge, n] : surplus) bad += n != 0;
    return bad;
}

// Sets of triangles that hang together by vertices.
int components(const SplitTopology& topology) {
    std::vector<uint32_t> root(topology.n_vertices());
    std::iota(root.begin(), root.end(), 0u);
    auto find = [&](uint32_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (const Triangle& t : topology.triangles()) root[find(t[0])] = find(t[1]), root[find(t[1])] = find(t[2]);
    std::set<uint32_t> roots;
    for (const Triangle& t : topology.triangles()) roots.insert(find(t[0]));
    return int(roots.size());
}

// Edges that do not have exactly two triangles.
int non_manifold_edges(const SplitTopology& topology) {
    std::map<std::pair<uint32_t, uint32_t>, int> count;
    for (const Triangle& t : topology.triangles())
        for (int c = 0; c < 3; ++c) ++count[std::minmax(t[c], t[(c + 1) % 3])];
    int bad = 0;
    for (const auto& [edge, n] : count) bad += n != 2;
    return bad;
}

std::vector<uint8_t> break_share(size_t n, double share, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<uint8_t> intact(n, 1);
    for (uint8_t& i : intact) i = random() / 4294967296.0 >= share;
    return intact;
}

int instances_of(const SplitTopology& topology, uint32_t pool_vertex) {
    int n = 0;
    for (uint32_t v = 0; v < topology.n_vertices(); ++v) n += topology.pool_vertex(v) == pool_vertex;
    return n;
}

// Fig. 2 as a slab one cell thick, from the front. p1p2 runs from v1 to v2, p2p3 from v2 over v3 to v4, p1p3 from v2 to
// the left; numbers are pool vertices of the front, the back has the same plus 8.
//
//        0-----v1----2
//        | p1  | p2  |         v1 = 1, v2 = 4, v3 = 5, v4 = 6
//        3-----v2    |
//         \  p3  v3--v4
//           -----7---
struct Fig2 {
    enum : uint32_t { v1 = 1, v2 = 4, v3 = 5, v4 = 6, n_front = 8 };
    FragmentSet set;

    Fig2() {
        const double x[n_front] = {0, 1, 2, 0, 1, 1.5, 2, 1.5}, y[n_front] = {2, 2, 2, 1, 1, 0.5, 0.5, 0};
        for (double z : {1.0, 0.0})
            for (uint32_t i = 0; i < n_front; ++i) set.vertices.push_back(Vec3(x[i], y[i], z));
        auto quad = [](std::vector<Triangle>& to, uint32_t a, uint32_t b) {  // along an outline from a to b, outward
            to.push_back({a, a + n_front, b + n_front});
            to.push_back({a, b + n_front, b});
        };
        const std::vector<std::vector<uint32_t>> outlines = {{0, 3, 4, 1}, {1, 4, 5, 6, 2}, {3, 7, 6, 5, 4}};
        const std::set<std::pair<uint32_t, uint32_t>> cut = {{1, 4}, {3, 4}, {4, 5}, {5, 6}};
        set.fragments.resize(3);
        for (uint32_t f = 0; f < 3; ++f) {
            const std::vector<uint32_t>& o = outlines[f];
            set.fragments[f].outer_begin = uint32_t(set.outer_triangles.size());
            for (uint32_t i = 0; i < o.size(); ++i) {
                const uint32_t from = o[i], to = o[(i + 1) % o.size()];
                if (i + 2 < o.size()) {
                    set.outer_triangles.push_back({o[0], o[i + 1], o[i + 2]});
                    set.outer_triangles.push_back({o[0] + n_front, o[i + 2] + n_front, o[i + 1] + n_front});
                }
                if (!cut.count(std::minmax(from, to))) quad(set.outer_triangles, from, to);
            }
            set.fragments[f].outer_end = uint32_t(set.outer_triangles.size());
        }
        set.outer_material.assign(set.outer_triangles.size(), 0);
        auto interface = [&](size_t a, size_t b, const std::vector<uint32_t>& line) {
            Interface i{FragmentId(a), FragmentId(b)};
            i.triangle_begin = uint32_t(set.interface_triangles.size());
            for (size_t k = 0; k + 1 < line.size(); ++k) quad(set.interface_triangles, line[k], line[k + 1]);
            i.triangle_end = uint32_t(set.interface_triangles.size());
            set.interfaces.push_back(i);
        };
        interface(0, 1, {v2, v1}), interface(0, 2, {3, v2}), interface(1, 2, {v2, v3, v4});
    }

    /// Front vertices that there are several of, with how many, for intact p1p2, p1p3, p2p3. The back does the same.
    std::map<uint32_t, int> split(const std::vector<uint8_t>& intact) const {
        SplitTopology topology = topology_of(set);
        topology.update(intact);
        EXPECT_EQ(unbalanced_edges(topology), 0);
        std::map<uint32_t, int> out;
        for (uint32_t v = 0; v < n_front; ++v) {
            EXPECT_EQ(instances_of(topology, v), instances_of(topology, v + n_front));
            if (instances_of(topology, v) != 1) out[v] = instances_of(topology, v);
        }
        return out;
    }
    int pieces(const std::vector<uint8_t>& intact) const {
        SplitTopology topology = topology_of(set);
        topology.update(intact);
        return components(topology);
    }
};
using Splits = std::map<uint32_t, int>;

TEST(split_topology, figure_2a_is_compact) {
    EXPECT_EQ(Fig2().split({1, 1, 1}), Splits{});
    EXPECT_EQ(Fig2().pieces({1, 1, 1}), 1);
}

TEST(split_topology, figure_2b_splits_v1_but_not_v2_which_still_hangs_together_through_p3) {
    EXPECT_EQ(Fig2().split({0, 1, 1}), (Splits{{Fig2::v1, 2}}));
    EXPECT_EQ(Fig2().pieces({0, 1, 1}), 1);
}

TEST(split_topology, figure_2c_splits_v2_v3_v4_when_the_last_path_to_p2_breaks) {
    EXPECT_EQ(Fig2().split({0, 1, 0}), (Splits{{Fig2::v1, 2}, {Fig2::v2, 2}, {Fig2::v3, 2}, {Fig2::v4, 2}}));
    EXPECT_EQ(Fig2().pieces({0, 1, 0}), 2);
}

TEST(split_topology, figure_2_shattered_gives_each_fragment_its_own_vertices) {
    EXPECT_EQ(Fig2().split({0, 0, 0}), (Splits{{Fig2::v1, 2}, {3, 2}, {Fig2::v2, 3}, {Fig2::v3, 2}, {Fig2::v4, 2}}));
    EXPECT_EQ(Fig2().pieces({0, 0, 0}), 3);
}

TEST(split_topology, compact_mesh_has_no_interior_faces_nor_vertices_at_the_start) {
    const auto box = make_tet_box({6, 6, 6}, 0.1);
    const Body body = make_body(box, testing::block_labels(box, {3, 3, 3}, 0.2));
    SplitTopology topology = topology_of(*body.fragments);
    topology.update(body.intact);
    EXPECT_EQ(topology.triangles().size(), body.fragments->outer_triangles.size());
    EXPECT_EQ(topology.n_vertices(), 6 * 36 + 2u);  // surface vertices of a box of 6^3 cells
    EXPECT_EQ(components(topology), 1);
    EXPECT_EQ(non_manifold_edges(topology), 0);
}

struct Cut {
    const char* name;
    std::function<Body()> make;
};

class any_cut : public ::testing::TestWithParam<Cut> {};

TEST_P(any_cut, edges_balance_whatever_breaks) {
    const Body body = GetParam().make();
    SplitTopology topology = topology_of(*body.fragments);
    uint32_t seed = 1;
    for (double share : {0.0, 0.02, 0.2, 0.6, 1.0, 0.4, 0.0})
        for (int repeat = 0; repeat < 3; ++repeat) {
            topology.update(break_share(body.rest.n_edges(), share, ++seed));
            EXPECT_EQ(unbalanced_edges(topology), 0) << "share " << share << " seed " << seed;
        }
}

TEST_P(any_cut, topology_is_a_function_of_the_interfaces_and_not_of_the_way_there) {
    const Body body = GetParam().make();
    SplitTopology walked = topology_of(*body.fragments);
    for (uint32_t seed : {1, 2, 3, 4}) {
        const auto intact = break_share(body.rest.n_edges(), 0.2 * seed, seed);
        walked.update(intact);
        SplitTopology fresh = topology_of(*body.fragments);
        fresh.update(intact);
        ASSERT_TRUE(std::equal(walked.triangles().begin(), walked.triangles().end(), fresh.triangles().begin(),
                               fresh.triangles().end()));
        EXPECT_TRUE(std::equal(walked.triangle_face().begin(), walked.triangle_face().end(),
                               fresh.triangle_face().begin(), fresh.triangle_face().end()));
    }
}

TEST_P(any_cut, vertices_called_unchanged_have_the_fragments_they_had) {
    const Body body = GetParam().make();
    SplitTopology topology = topology_of(*body.fragments);
    topology.update(break_share(body.rest.n_edges(), 0.3, 5));
    std::vector<std::vector<uint32_t>> before(topology.n_vertices());
    std::vector<uint32_t> pool;
    for (uint32_t v = 0; v < before.size(); ++v)
        topology.connected_fragments(v, before[v]), pool.push_back(topology.pool_vertex(v));
    auto intact = break_share(body.rest.n_edges(), 0.3, 5);
    intact[std::find(intact.begin(), intact.end(), 1) - intact.begin()] = 0;
    ASSERT_TRUE(topology.update(intact));
    const std::set<uint32_t> changed(topology.changed_vertices().begin(), topology.changed_vertices().end());
    size_t kept = 0;
    std::vector<uint32_t> now;
    std::multimap<uint32_t, std::vector<uint32_t>> had;
    for (size_t v = 0; v < before.size(); ++v) had.emplace(pool[v], before[v]);
    for (uint32_t v = 0; v < topology.n_vertices(); ++v) {
        if (changed.contains(topology.pool_vertex(v))) continue;
        ++kept;
        topology.connected_fragments(v, now);
        const auto [begin, end] = had.equal_range(topology.pool_vertex(v));
        EXPECT_TRUE(std::any_of(begin, end, [&](const auto& one) { return one.second == now; }));
    }
    EXPECT_GT(kept, topology.n_vertices() / 4);  // an update that keeps nothing would pass the rest
    EXPECT_FALSE(topology.update(intact));
}

Body blocks() {
    const auto box = make_tet_box({6, 6, 9}, 0.1);
    return make_body(box, testing::block_labels(box, {3, 3, 5}, 0.2));
}
Body kmeans() {
    const auto box = make_tet_box({8, 8, 12}, 0.1, 0.2);
    return make_body(box, testing::kmeans_labels(box, 60, 7));
}
Body confetti() {  // fragments that touch themselves along edges and in points, in pieces, hollow
    const auto box = make_tet_box({4, 4, 4}, 0.1);
    return make_body(box, testing::random_labels(box, 12, 9));
}
INSTANTIATE_TEST_SUITE_P(split_topology, any_cut,
                         ::testing::Values(Cut{"blocks", blocks}, Cut{"kmeans", kmeans}, Cut{"confetti", confetti}),
                         [](const auto& info) { return info.param.name; });

TEST(split_topology, shattered_body_has_as_many_components_as_fragments_and_each_is_closed) {
    for (const Body& body : {blocks(), kmeans()}) {
        SplitTopology topology = topology_of(*body.fragments);
        topology.update(std::vector<uint8_t>(body.rest.n_edges(), 0));
        EXPECT_EQ(components(topology), int(body.fragments->fragments.size()));
        EXPECT_EQ(unbalanced_edges(topology), 0);
    }
}

TEST(split_topology, fragment_that_touches_itself_along_an_edge_keeps_one_edge_there) {
    testing::TetBox box;  // 0-3 is an edge of all three tetrahedra; the first two have nothing else in common
    box.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(-1, 0, 0), Vec3(0, -1, 0)};
    box.tets = {{0, 1, 2, 3}, {0, 4, 5, 3}, {0, 2, 4, 3}};
    const Body body = make_body(box, {0, 0, 1});
    SplitTopology topology = topology_of(*body.fragments);
    topology.update(std::vector<uint8_t>{0});
    EXPECT_EQ(unbalanced_edges(topology), 0);
    EXPECT_EQ(instances_of(topology, 3), 2);  // fragment 0, fragment 1
    EXPECT_EQ(components(topology), 2);
}

TEST(split_topology, fragment_that_touches_itself_in_a_point_comes_off_with_two_vertices_there) {
    testing::TetBox box;  // the first two tetrahedra have vertex 0 in common, no edge
    box.vertices = {Vec3(0, 0, 0),  Vec3(1, 0, 0),  Vec3(0, 1, 0),       Vec3(0, 0, 1),
                    Vec3(-1, 0, 0), Vec3(0, -1, 0), Vec3(-0.1, -0.1, -1)};
    box.tets = {{0, 1, 2, 3}, {0, 4, 6, 5}, {0, 2, 4, 3}};
    const Body body = make_body(box, {0, 0, 1});
    SplitTopology topology = topology_of(*body.fragments);
    topology.update(std::vector<uint8_t>{0});
    EXPECT_EQ(unbalanced_edges(topology), 0);
    EXPECT_EQ(instances_of(topology, 0), 3);
    EXPECT_EQ(non_manifold_edges(topology), 0);
    EXPECT_EQ(components(topology), 3);
}

TEST(split_topology, blisters_inside_of_a_whole_body_are_left_out) {
    const auto box = make_tet_box({6, 6, 6}, 0.1);
    const Body body = make_body(box, testing::block_labels(box, {3, 3, 3}, 0.2));
    const FragmentSet& set = *body.fragments;
    SplitTopology topology = topology_of(set);
    topology.update(body.intact);
    const size_t compact = topology.triangles().size();
    // The middle cube (13) lies inside. Its face to one neighbour has 2 x 2 cells: of its vertices only the one in the
    // middle has no other fragment around, and splits. Triangles without it would be blisters.
    const size_t inner =
        std::find_if(set.interfaces.begin(), set.interfaces.end(),
                     [](const Interface& i) { return i.a == FragmentId(12) && i.b == FragmentId(13); }) -
        set.interfaces.begin();
    ASSERT_LT(inner, set.interfaces.size());
    auto intact = body.intact;
    intact[inner] = 0;
    topology.update(intact);
    size_t at_centre = 0;
    for (uint32_t t = set.interfaces[inner].triangle_begin; t < set.interfaces[inner].triangle_end; ++t)
        for (uint32_t v : set.interface_triangles[t])
            at_centre += (set.vertices[v] - Vec3(0.2, 0.3, 0.3)).norm() < 1e-9;
    EXPECT_GT(at_centre, 0u);
    EXPECT_LT(at_centre, 8u);
    EXPECT_EQ(topology.triangles().size(), compact + 2 * at_centre);
    EXPECT_EQ(unbalanced_edges(topology), 0);
}

TEST(split_topology, open_fragment_is_refused_by_name) {
    Fig2 fig;
    std::swap(fig.set.outer_triangles[fig.set.fragments[1].outer_begin][0],
              fig.set.outer_triangles[fig.set.fragments[1].outer_begin][1]);
    Result<FragmentFaces> faces = make_fragment_faces(fig.set);
    ASSERT_TRUE(faces);
    const auto topology = SplitTopology::make(faces.take());
    ASSERT_FALSE(topology);
    EXPECT_EQ(topology.error().code, ErrorCode::bad_input);
    EXPECT_EQ(topology.error().where, "fragment 1");
}

}  // namespace
}  // namespace sunder
