// Bodies that no artist means, thousands of ways: vertices far out, edges and corners pulled onto one another, parts
// turned inside out. Each is cut into closed pieces or refused by a sentence; nothing crashes, and nothing takes long.
#include <gtest/gtest.h>

#include <random>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/ugly_meshes.h"

namespace sunder {
namespace {

using testing::joined;
using testing::make_box;
using testing::make_torus;

class Dice {
public:
    explicit Dice(uint32_t seed) : random_(seed) {}
    uint32_t below(size_t n) { return static_cast<uint32_t>(random_() % n); }
    double share() { return double(random_()) / 4294967296.0; }
    Vec3 in_box() { return Vec3(2 * share() - 1, 2 * share() - 1, 2 * share() - 1); }

private:
    std::mt19937 random_;
};

TriMesh body(Dice& io_dice) {
    switch (io_dice.below(4)) {
        case 0:
            return make_box(Vec3(1, 1 + io_dice.below(3), 0.1));
        case 1:
            return make_torus(0.35, 0.15, 12, 6);
        case 2:
            return joined(make_box(), make_torus(0.35, 0.1, 8, 5), 0.5 * io_dice.in_box());
        default:
            return make_torus(1, 0.02, 16, 4);
    }
}

/// One fault more.
void spoil(Dice& io_dice, TriMesh& io_mesh) {
    std::vector<Vec3>& p = io_mesh.positions;
    const uint32_t v = io_dice.below(p.size());
    const Triangle& t = io_mesh.triangles[io_dice.below(io_mesh.triangles.size())];
    switch (io_dice.below(9)) {
        case 0:  // far out, along an axis or anywhere
            p[v] += std::pow(10.0, 8 * io_dice.share()) * Vec3::Unit(io_dice.below(3));
            break;
        case 1:
            p[v] += std::pow(10.0, 3 * io_dice.share() - 1) * io_dice.in_box();
            break;
        case 2:  // through to the other side
            p[v] *= -3 * io_dice.share();
            break;
        case 3:  // onto an edge: a sliver, or no area at all
            p[t[2]] = p[t[0]] + io_dice.share() * (p[t[1]] - p[t[0]]);
            break;
        case 4:  // nearly onto another corner
            p[t[1]] = p[t[0]] + 1e-13 * io_dice.in_box();
            break;
        case 5:  // all on one line
            for (uint32_t w : t) p[w] = p[v] + double(io_dice.below(5)) * Vec3(0.25, 0.5, 0);
            break;
        case 6:  // into one plane
            for (uint32_t w : t) p[w].z() = 0.125;
            break;
        case 7:  // corners of one edge trade places
            std::swap(p[t[0]], p[t[1]]);
            break;
        default:  // a triangle's corner torn off
            p.push_back(p[t[0]] + 4 * io_dice.in_box());
            io_mesh.triangles.front()[0] = uint32_t(p.size() - 1);
    }
}

/// What is wrong with the outcome; empty: nothing.
std::string fault_of(const Result<FragmentSet>& set) {
    if (!set) {
        const Error& e = set.error();
        const bool is_told = !e.what.empty() && e.where == "mesh";
        return e.code == ErrorCode::bad_input && is_told ? "" : "refused without a sentence: " + e.text();
    }
    double volume = 0;
    for (uint32_t i = 0; i < set->fragments.size(); ++i) {
        const MeshReport r = check_mesh(fragment_mesh(*set, FragmentId(i)));
        if (!r.is_solid())
            return "piece " + std::to_string(i) + " is no solid: " + (r.faults.empty() ? "" : r.faults[0]);
        volume += r.volume;
    }
    if (std::abs(volume - set->source_volume) > 1e-9 * set->source_volume) return "the volumes do not sum";
    return "";
}

TEST(NastyBodies, are_cut_into_closed_pieces_or_refused_by_a_sentence) {
    constexpr uint32_t kBodies = 300;
    size_t n_cut = 0;
    for (uint32_t seed = 0; seed < kBodies; ++seed) {
        Dice dice(seed);
        TriMesh mesh = body(dice);
        for (uint32_t n = 1 + dice.below(3); n > 0; --n) spoil(dice, mesh);
        PrefractureSettings settings;
        settings.pieces = 3 + static_cast<int>(dice.below(10));
        settings.seed = seed;
        settings.threads = 1;
        settings.sites.kind = SiteKind::uniform;
        settings.repair = {.mode = RepairMode::keep, .wrap_detail = 0.1};
        const Result<FragmentSet> set = prefracture(mesh, settings, "mesh");
        EXPECT_EQ(fault_of(set), "") << "seed " << seed;
        n_cut += bool(set);
    }
    EXPECT_GT(n_cut, kBodies / 4);
}

// As an artist brought it: the seam of the torus has a vertex twice, and one of the two was dragged away.
TEST(NastyBodies, a_torus_with_one_vertex_far_out_is_cut) {
    Result<TriMesh> mesh = read_mesh(SUNDER_SOURCE_DIR "/tests/data/torus_one_bad_vertex.glb");
    ASSERT_TRUE(mesh);
    Vec3* far_out = &*std::ranges::max_element(mesh->positions, {}, [](const Vec3& p) { return p.norm(); });
    const Vec3 place = *far_out;
    for (double farther : {1.0, 10.0, 1e3, 1e7})
        for (uint32_t seed = 0; seed < 3; ++seed)
            for (RepairMode mode : {RepairMode::keep, RepairMode::automatic}) {
                *far_out = farther * place;
                PrefractureSettings settings;
                settings.pieces = 60;
                settings.seed = seed;
                settings.threads = 1;
                settings.sites.kind = SiteKind::uniform;
                settings.repair = {.mode = mode, .wrap_detail = 0.05};
                const Result<FragmentSet> set = prefracture(*mesh, settings, "mesh");
                EXPECT_EQ(fault_of(set), "");
                EXPECT_TRUE(set || farther > 1 || mode == RepairMode::keep) << set.error().text();
            }
}

}  // namespace
}  // namespace sunder
