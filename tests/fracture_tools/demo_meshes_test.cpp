// The acceptance checks of cutting on meshes that nobody made for us: those of Debian's libcgal-demo, unpacked into
// SUNDER_DEMO_MESHES by the test unpack_demo_meshes.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <set>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/repair/mesh_repair.h"
#include "tests/fracture_tools/voronoi/cut_checks.h"

namespace sunder {
namespace {

struct DemoMesh {
    std::string name, file;
    std::string expected;  // part of what is told; empty: nothing
    bool is_cut = true;    // else refused
    bool is_slow = false;  // 300 pieces only of the others
};

void PrintTo(const DemoMesh& demo, std::ostream* out) { *out << demo.file; }

TriMesh read(const DemoMesh& demo) {
    Result<TriMesh> mesh = read_mesh(SUNDER_DEMO_MESHES "/" + demo.file);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().text()) << " (libcgal-demo is needed)";
    TriMesh out = mesh ? mesh.take() : TriMesh();
    // Unit box, and UVs that tell where a corner is: x and y.
    Aabb box;
    for (const Vec3& p : out.positions) box.extend(p);
    for (Vec3& p : out.positions) p = (p - box.min) / (box.max - box.min).maxCoeff();
    for (const Triangle& t : out.triangles)
        for (uint32_t v : t) out.corner_uvs.push_back(out.positions[v].head<2>().cast<float>());
    return out;
}

PrefractureSettings settings(int pieces, SiteKind sites) {
    PrefractureSettings s;
    s.pieces = pieces;
    s.sites.kind = sites;
    s.sites.points = {Vec3(0.4, 0.3, 0.01)};
    s.least_piece = sites == SiteKind::kmeans ? 0.1 : 0.01;
    return s;
}

/// UVs of outer corners where they should be; empty: they are.
std::string fault_of_uvs(const FragmentSet& set) {
    for (size_t k = 0; k < set.outer_corner_uvs.size(); ++k) {
        const Vec3& p = set.vertices[set.outer_triangles[k / 3][k % 3]];
        if ((set.outer_corner_uvs[k] - Vec2f(p.head<2>().cast<float>())).norm() > 1e-6f)
            return "UVs of outer corner " + std::to_string(k) + " are off";
    }
    return set.outer_corner_uvs.empty() ? "no UVs" : "";
}

/// Frames are right-handed, radii positive, masses sum up, interfaces have area and unit normals.
std::string fault_of_measures(const FragmentSet& set) {
    double mass = 0;
    for (size_t i = 0; i < set.fragments.size(); ++i) {
        const Fragment& f = set.fragments[i];
        const Mat3 frame = f.orientation.toRotationMatrix();
        if ((frame.transpose() * frame - Mat3::Identity()).norm() > 1e-12 || std::abs(frame.determinant() - 1) > 1e-12)
            return "the frame of piece " + std::to_string(i);
        if (!(f.radii.minCoeff() > 0)) return "the radii of piece " + std::to_string(i);
        mass += 1000 * f.volume;
    }
    if (std::abs(mass - 1000 * set.source_volume) > 1e-10 * mass) return "the masses";
    for (const Interface& face : set.interfaces)
        if (!(face.area > 0) || face.triangle_end <= face.triangle_begin) return "an interface without area";
    return "";
}

class Demo : public ::testing::TestWithParam<DemoMesh> {};

TEST_P(Demo, is_cut_into_closed_pieces_that_fill_it_or_refused_by_name) {
    const TriMesh mesh = read(GetParam());
    for (const auto& [pieces, sites] : {std::pair(20, SiteKind::kmeans), std::pair(300, SiteKind::uniform)}) {
        if (pieces == 300 && GetParam().is_slow) continue;
        SCOPED_TRACE(pieces);
        const PrefractureSettings s = settings(pieces, sites);
        const Result<FragmentSet> set = prefracture(mesh, s, "mesh");
        std::string told = set ? "" : set.error().what;
        if (set)
            for (const std::string& w : set->warnings) told += w + "\n";
        if (GetParam().expected.empty())
            EXPECT_EQ(told, "");
        else
            EXPECT_NE(told.find(GetParam().expected), std::string::npos) << told;
        ASSERT_EQ(bool(set), GetParam().is_cut) << told;
        if (!set) continue;
        if (set->source_volume == mesh_volume(mesh)) {  // not repaired: what was cut is at hand
            EXPECT_EQ(testing::fault_of_pieces(mesh, *set), "");
            EXPECT_EQ(fault_of_uvs(*set), "");
        } else {
            double volume = 0;
            for (uint32_t i = 0; i < set->fragments.size(); ++i) {
                const MeshReport r = check_mesh(fragment_mesh(*set, FragmentId(i)));
                EXPECT_TRUE(r.is_solid()) << "piece " << i << ": " << (r.faults.empty() ? "" : r.faults[0]);
                volume += r.volume;
            }
            EXPECT_NEAR(volume, set->source_volume, 1e-9 * set->source_volume);
        }
        EXPECT_EQ(fault_of_measures(*set), "");
    }
}

const DemoMesh kMeshes[] = {
    {"elephant", "elephant.off", ""},                             // genus 3
    {"fandisk", "fandisk.off", ""},                               // sharp edges
    {"knot2", "knot2.off", ""},                                   // two parts, knotted
    {"cheese", "cheese.off", ""},                                 // genus 133
    {"turbine", "turbine.off", ""},                               // thin blades
    {"couplingdown", "couplingdown.off", ""},                     // machined, genus 9
    {"sphere_stl", "sphere.stl", ""},                             // a soup in the file
    {"camel", "camel.off", "crosses or touches itself"},          //
    {"bones", "bones.off", "shells that cross or touch united"},  // 26 parts, some through others
    {"dragon", "ChineseDragon-10kv.off", "2 holes closed"},       // and it crosses itself
    {"head", "head.off", "3 holes closed"},                       // eyes, and the neck
    {"shark", "mech-holes-shark.off", "4 holes closed"},          //
    {"terrain", "horizons.off", "the mesh is open", false},       // two sheets
    {"diplodocus", "diplodocus.off", "was parted", true, true},   // edges with more than two triangles
    {"elephant_with_holes", "elephant-with-holes.off", "106 holes closed", true, true},
    {"bunny00", "bunny00.off", "", true, true}};  // 75,000 triangles
INSTANTIATE_TEST_SUITE_P(Meshes, Demo, ::testing::ValuesIn(kMeshes), [](const auto& info) { return info.param.name; });

TEST(DemoMeshes, even_pieces_are_as_many_as_asked_for_and_of_like_size) {
    const Result<FragmentSet> set =
        prefracture(read({"elephant", "elephant.off", ""}), settings(300, SiteKind::kmeans), "mesh");
    ASSERT_TRUE(set);
    EXPECT_EQ(set->fragments.size(), 300u);
    double least = HUGE_VAL, largest = 0, sum = 0;
    for (const Fragment& f : set->fragments)
        least = std::min(least, f.volume), largest = std::max(largest, f.volume), sum += f.volume;
    EXPECT_GE(least, 0.3 * sum / 300);
    EXPECT_LE(largest, 3 * sum / 300);
}

TEST(DemoMeshes, tetrahedra_keep_the_volume_within_their_share) {
    PrefractureSettings s = settings(100, SiteKind::kmeans);
    s.method = CutMethod::kmeans;
    const TriMesh mesh = read({"elephant", "elephant.off", ""});
    const Result<FragmentSet> set = prefracture(mesh, s, "mesh");
    ASSERT_TRUE(set);
    double volume = 0;
    for (uint32_t i = 0; i < set->fragments.size(); ++i) {
        const MeshReport r = check_mesh(fragment_mesh(*set, FragmentId(i)));
        EXPECT_TRUE(r.is_solid()) << i;
        volume += r.volume;
    }
    EXPECT_NEAR(volume, mesh_volume(mesh), 0.015 * mesh_volume(mesh));
}

}  // namespace
}  // namespace sunder
