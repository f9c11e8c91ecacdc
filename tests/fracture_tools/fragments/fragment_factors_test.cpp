// Factors of fragments and interfaces: painted, clustered, by region; and what the solver's mesh makes of them.
#include "fracture_tools/fragments/fragment_factors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

constexpr double kGlue = std::numeric_limits<double>::infinity();

FragmentSet lattice(std::array<int, 3> cells, int neighbours = 6) {
    LatticeSettings settings;
    settings.cells = cells;
    settings.size = Vec3(cells[0], cells[1], cells[2]);
    settings.center = 0.5 * settings.size;
    settings.neighbours = neighbours;
    return make_lattice(settings, "lattice").take();
}

/// Cuts a box with weight 1 painted at x = 1 and 0.5 at x = 0.
FragmentSet painted_cut(PrefractureSettings settings, CutMethod method = CutMethod::voronoi) {
    TriMesh box = testing::make_box();
    for (const Vec3& p : box.positions) box.vertex_attributes["paint"].push_back(p.x() > 0.5 ? 1.0f : 0.5f);
    settings.pieces = 40;
    settings.method = method;
    Result<FragmentSet> set = prefracture(box, settings, "box");
    EXPECT_TRUE(set) << (set ? "" : set.error().text());
    return set ? set.take() : FragmentSet();
}

TEST(FragmentFactors, a_painted_map_is_found_on_the_fragments_it_was_painted_on) {
    for (const CutMethod method : {CutMethod::voronoi, CutMethod::kmeans}) {
        PrefractureSettings settings;
        settings.maps = {"paint", "", "paint"};
        const FragmentSet set = painted_cut(settings, method);
        for (const Fragment& f : set.fragments) {
            if (f.outer_begin == f.outer_end) continue;
            double sum = 0, area = 0;  // of x over the fragment's outer surface, along which the paint is linear
            for (uint32_t t = f.outer_begin; t < f.outer_end; ++t) {
                const auto& [i, j, k] = set.outer_triangles[t];
                const Vec3 &p = set.vertices[i], &q = set.vertices[j], &r = set.vertices[k];
                const double own = 0.5 * (q - p).cross(r - p).norm();
                sum += own * (p + q + r).x() / 3, area += own;
            }
            EXPECT_NEAR(f.toughness_factor, 0.5 + 0.5 * sum / area, 1e-6) << "at x = " << sum / area;
            EXPECT_EQ(f.density_factor, f.toughness_factor);
            EXPECT_EQ(f.yield_factor, 1);
        }
    }
}

TEST(FragmentFactors, a_fragment_within_takes_what_is_painted_nearest) {
    TriMesh box = testing::make_box();
    for (const Vec3& p : box.positions) box.vertex_attributes["paint"].push_back(float(1 + p.x()));
    FragmentSet set = lattice({3, 3, 3});
    for (Vec3& v : set.vertices) v /= 3;
    measure_fragments(set);
    ASSERT_EQ(set.fragments[13].outer_begin, set.fragments[13].outer_end);
    set.fragments[13].centroid.x() = 0.9;
    ASSERT_TRUE(apply_maps(box, {"paint", "", ""}, "box", set));
    EXPECT_NEAR(set.fragments[13].toughness_factor, 2, 1e-6);
    EXPECT_NEAR(set.fragments[12].toughness_factor, 1, 0.2);
}

TEST(FragmentFactors, colours_are_maps_and_unknown_ones_are_refused_by_name) {
    TriMesh box = testing::make_box();
    box.corner_colors.assign(3 * box.triangles.size(), Color{0.25f, 0, 1, 1});
    FragmentSet set = lattice({2, 2, 2});
    ASSERT_TRUE(apply_maps(box, {"", "red", ""}, "box", set));
    for (const Fragment& f : set.fragments) EXPECT_EQ(f.yield_factor, 0.25);
    const Status refused = apply_maps(box, {"", "", "weight"}, "box", set);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().parameter, "density_map");
    EXPECT_NE(refused.error().text().find("red, green, blue, alpha"), std::string::npos) << refused.error().text();
    ASSERT_TRUE(apply_maps(box, {"green", "", ""}, "box", set));  // 0 is no factor
    for (const Fragment& f : set.fragments) EXPECT_EQ(f.toughness_factor, kLeastFactor);
    EXPECT_EQ(set.warnings.size(), 1u);
}

TEST(FragmentFactors, clusters_hang_together_and_are_of_like_size) {
    for (uint64_t seed : {0, 1, 2}) {
        FragmentSet set = lattice({12, 6, 4});
        gather_clusters(6, 3, seed, set);
        std::map<int32_t, double> volume;
        for (const Fragment& f : set.fragments) volume[f.cluster] += f.volume;
        ASSERT_EQ(volume.size(), 6u);
        EXPECT_EQ(volume.begin()->first, 0);
        EXPECT_EQ(set.fragments[0].cluster, 0);  // numbered by their lowest fragment
        for (const auto& [cluster, v] : volume) EXPECT_NEAR(v, 48, 30) << "cluster " << cluster;

        // In one part each: as many are left when edges between clusters go.
        SimulationMesh mesh = build_simulation_mesh(set, {}).take();
        std::vector<uint32_t> part(set.fragments.size());
        for (uint32_t i = 0; i < part.size(); ++i) part[i] = i;
        for (size_t round = 0; round < part.size(); ++round)
            for (const Edge& e : mesh.edges)
                if (e.toughness_factor == 3) part[e.a] = part[e.b] = std::min(part[e.a], part[e.b]);
        EXPECT_EQ(std::set<uint32_t>(part.begin(), part.end()).size(), 6u);
        for (const Interface& i : set.interfaces)
            EXPECT_EQ(i.toughness_factor,
                      set.fragments[i.a.index()].cluster == set.fragments[i.b.index()].cluster ? 3 : 1);
    }
}

TEST(FragmentFactors, parts_of_a_cluster_that_nothing_joins_are_clusters_of_their_own) {
    FragmentSet set = lattice({4, 1, 1});
    set.interfaces.erase(set.interfaces.begin() + 1);  // two bars
    gather_clusters(1, 2, 0, set);
    EXPECT_EQ(set.fragments[1].cluster, set.fragments[0].cluster);
    EXPECT_EQ(set.fragments[3].cluster, set.fragments[2].cluster);
    EXPECT_NE(set.fragments[0].cluster, set.fragments[2].cluster);
}

TEST(FragmentFactors, weak_interfaces_join_nothing_but_stay_in_the_table) {
    PrefractureSettings settings;
    const FragmentSet all = painted_cut(settings);
    settings.weak_interface_share = 0.1;
    const FragmentSet some = painted_cut(settings);
    ASSERT_EQ(some.interfaces.size(), all.interfaces.size());
    const size_t n_edges = build_simulation_mesh(some, {})->n_edges();
    EXPECT_LT(n_edges, all.interfaces.size());
    EXPECT_GT(n_edges, all.interfaces.size() / 2);
    for (const Interface& i : some.interfaces) {
        const double section = std::cbrt(some.fragments[i.a.index()].volume * some.fragments[i.b.index()].volume);
        EXPECT_EQ(i.joins, i.area >= 0.1 * section);
    }
}

TEST(FragmentFactors, the_only_contact_joins_however_small_it_is) {
    FragmentSet set = lattice({3, 1, 1});
    leave_out_weak_interfaces(1.5, set);
    for (const Interface& i : set.interfaces) EXPECT_TRUE(i.joins);
    FragmentSet block = lattice({3, 3, 3}, 26);  // across edges and corners the area is 0
    leave_out_weak_interfaces(0.01, block);
    for (const Interface& i : block.interfaces) EXPECT_EQ(i.joins, i.area > 0);
}

TEST(FragmentFactors, a_region_multiplies_what_is_there) {
    FragmentSet set = lattice({3, 1, 1});
    set.fragments[1].yield_factor = 2;
    apply_region({1, 1, 0}, {.toughness = 3, .yield = 5, .density = 7, .interface_toughness = kGlue}, set);
    EXPECT_EQ(set.fragments[0].toughness_factor, 3);
    EXPECT_EQ(set.fragments[1].yield_factor, 10);
    EXPECT_EQ(set.fragments[2].density_factor, 1);
    EXPECT_EQ(set.interfaces[0].toughness_factor, kGlue);
    EXPECT_EQ(set.interfaces[1].toughness_factor, 1);

    const SimulationMesh mesh = build_simulation_mesh(set, {.density = 10}).take();
    EXPECT_EQ(mesh.mass, (std::vector<double>{70, 70, 10}));
    EXPECT_EQ(mesh.yield_factor, (std::vector<double>{5, 10, 1}));
    EXPECT_EQ(mesh.toughness_factor, (std::vector<double>{3, 3, 1}));
    EXPECT_EQ(mesh.edges[0].toughness_factor, kGlue);
    EXPECT_TRUE(build_simulation_mesh(lattice({2, 1, 1}), {})->yield_factor.empty());
}

}  // namespace
}  // namespace sunder
