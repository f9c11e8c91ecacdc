// Polygons of files are the artist's: cut into triangles that lie in them, whatever their shape and the corner that
// they begin with, with the corners' own UVs.
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <fstream>
#include <map>
#include <sstream>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/mesh/self_intersections.h"
#include "tests/fracture_tools/polygons.h"
#include "tests/fracture_tools/temporary_meshes.h"

namespace sunder {
namespace {

using testing::area_of_polygon;
using testing::concave_polygons;
using testing::make_prism;
using testing::NamedPolygon;
using testing::placed;
using testing::Prism;

class PolygonFiles : public testing::MeshFolder {
protected:
    std::string write_obj(const Prism& prism) const {
        std::ostringstream text;
        text.precision(17);
        for (const Vec3& p : prism.vertices) text << "v " << p.x() << " " << p.y() << " " << p.z() << "\n";
        // Where corners are in the plane of the polygon, and which face they are of.
        for (const Vec3& p : prism.vertices) text << "vt " << p.x() / 8 << " " << p.y() / 8 << "\n";
        for (size_t f = 0; f < prism.faces.size(); ++f) {
            text << (f == 0 ? "usemtl low\n" : f == 1 ? "usemtl high\n" : f == 2 ? "usemtl side\n" : "") << "f";
            for (uint32_t v : prism.faces[f]) text << " " << v + 1 << "/" << v + 1;
            text << "\n";
        }
        return write("prism.obj", text.str());
    }
    std::string write_off(const Prism& prism) const {
        std::ostringstream text;
        text.precision(17);
        text << "OFF\n" << prism.vertices.size() << " " << prism.faces.size() << " 0\n";
        for (const Vec3& p : prism.vertices) text << p.x() << " " << p.y() << " " << p.z() << "\n";
        put_faces(prism, text);
        return write("prism.off", text.str());
    }
    std::string write_ply(const Prism& prism) const {
        std::ostringstream text;
        text.precision(17);
        text << "ply\nformat ascii 1.0\nelement vertex " << prism.vertices.size()
             << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << prism.faces.size()
             << "\nproperty list uchar int vertex_indices\nend_header\n";
        for (const Vec3& p : prism.vertices) text << p.x() << " " << p.y() << " " << p.z() << "\n";
        put_faces(prism, text);
        return write("prism.ply", text.str());
    }
    /// In another format, its polygons as they are.
    std::string exported(const std::string& id, const std::string& extension, const std::string& from) const {
        Assimp::Importer importer;
        Assimp::Exporter exporter;
        std::string path = (folder_ / ("exported." + extension)).string();
        EXPECT_EQ(exporter.Export(importer.ReadFile(from, 0), id, path), aiReturn_SUCCESS);
        return path;
    }

private:
    static void put_faces(const Prism& prism, std::ostringstream& out) {
        for (const auto& face : prism.faces) {
            out << face.size();
            for (uint32_t v : face) out << " " << v;
            out << "\n";
        }
    }
};

TriMesh read(const std::string& path) {
    Result<TriMesh> mesh = read_mesh(path);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().text());
    return mesh ? mesh.take() : TriMesh();
}

/// In order, with the volume, without a triangle that has nearly no area.
void expect_prism(const TriMesh& mesh, double volume, double tolerance) {
    const MeshReport r = check_mesh(mesh);
    EXPECT_TRUE(r.is_solid()) << (r.faults.empty() ? "no volume" : r.faults[0]);
    EXPECT_NEAR(r.volume, volume, tolerance * volume);
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vec3 n = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
        EXPECT_GT(n.norm(), 1e-3 * std::cbrt(volume * volume));
    }
}

TEST_F(PolygonFiles, every_format_keeps_any_polygon_from_any_corner) {
    for (const NamedPolygon& polygon : concave_polygons()) {
        const double area = area_of_polygon(polygon.corners);
        for (size_t start = 0; start < polygon.corners.size(); ++start) {
            SCOPED_TRACE(polygon.name + " from corner " + std::to_string(start));
            const Prism prism = make_prism(polygon.corners, start);
            const std::string obj = write_obj(prism);
            for (const std::string& path : {obj, write_off(prism), write_ply(prism)})
                expect_prism(read(path), area, 1e-12);
            if (start > 1) continue;  // slower
            expect_prism(read(exported("fbxa", "fbx", obj)), 1e-6 * area, 1e-12);
        }
    }
}

TEST_F(PolygonFiles, polygons_turned_and_far_away_are_as_good_as_their_numbers) {
    for (const NamedPolygon& polygon : concave_polygons())
        for (size_t start = 0; start < polygon.corners.size(); start += 3) {
            SCOPED_TRACE(polygon.name + " from corner " + std::to_string(start));
            const double area = area_of_polygon(polygon.corners);
            Prism prism = make_prism(polygon.corners, start);
            prism.vertices = placed(std::move(prism.vertices), 0.7, Vec3(100, -30, 7));
            // A hundred metres off, doubles are 1e-14 m apart, floats 1e-5.
            for (const std::string& path : {write_off(prism), write_ply(prism)}) expect_prism(read(path), area, 1e-12);
            expect_prism(read(write_obj(prism)), area, 1e-4);
        }
}

TEST_F(PolygonFiles, corners_have_their_own_uvs_and_faces_their_material) {
    for (const NamedPolygon& polygon : concave_polygons()) {
        SCOPED_TRACE(polygon.name);
        const double area = area_of_polygon(polygon.corners);
        write("prism.mtl", "newmtl low\nnewmtl high\nnewmtl side\n");
        const TriMesh mesh = read(write_obj(make_prism(polygon.corners, 2)));
        ASSERT_EQ(mesh.corner_uvs.size(), 3 * mesh.triangles.size());
        std::map<int32_t, double> covered;
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            for (uint32_t c = 0; c < 3; ++c) {
                const Vec3& p = mesh.positions[mesh.triangles[t][c]];
                EXPECT_EQ(mesh.corner_uvs[3 * t + c], Vec2f(float(p.x() / 8), float(p.y() / 8)));
            }
            const auto& [a, b, c] = mesh.triangles[t];
            const Vec3& origin = mesh.positions[a];
            covered[mesh.triangle_material[t]] +=
                0.5 * (mesh.positions[b] - origin).cross(mesh.positions[c] - origin).z();
        }
        ASSERT_EQ(mesh.material_names.size(), 3u);
        EXPECT_NEAR(covered[0], -area, 1e-12 * area);
        EXPECT_NEAR(covered[1], area, 1e-12 * area);
    }
}

TEST_F(PolygonFiles, pieces_have_the_volume_and_nothing_is_repaired) {
    for (const NamedPolygon& polygon : concave_polygons()) {
        SCOPED_TRACE(polygon.name);
        PrefractureSettings settings;
        settings.pieces = 20;
        settings.repair.mode = RepairMode::refuse;
        const Result<FragmentSet> set = prefracture(read(write_obj(make_prism(polygon.corners))), settings, "prism");
        ASSERT_TRUE(set) << set.error().text();
        double volume = 0;
        for (const Fragment& f : set->fragments) volume += f.volume;
        EXPECT_NEAR(volume, area_of_polygon(polygon.corners), 1e-12 * volume);
        EXPECT_TRUE(set->warnings.empty()) << set->warnings[0];
    }
}

TEST_F(PolygonFiles, a_polygon_that_crosses_itself_is_closed_against_its_neighbours) {
    Prism prism =
        make_prism({Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, 1, 0), Vec3(1, 1, 0), Vec3(1, 2, 0), Vec3(0, 2, 0)});
    prism.vertices[3] = Vec3(3, -1, 0);
    const MeshReport r = check_mesh(read(write_off(prism)));
    EXPECT_EQ(r.open_edges + r.non_manifold_edges + r.inconsistent_edges, 0u);
}

TEST_F(PolygonFiles, lines_and_points_beside_faces_are_passed_over) {
    Prism prism = make_prism(concave_polygons()[0].corners);
    std::ostringstream more;
    std::ifstream file(write_obj(prism));
    more << file.rdbuf() << "v 50 50 50\nl 1 13\np 13\n";
    const TriMesh mesh = read(write("lines.obj", more.str()));
    EXPECT_EQ(mesh.positions.size(), 12u);
    expect_prism(mesh, 3, 1e-12);
}

// The second one's rows would be read by the first one's columns, of which one may not be there.
TEST_F(PolygonFiles, vertices_that_come_twice_are_refused) {
    const std::string place = "property float x\nproperty float y\nproperty float z\n";
    const Result<TriMesh> mesh = read_mesh(write(
        "twice.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + place + "property float heat\nelement vertex 2\n" +
                         place + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                         "0 0 0 1\n1 0 0\n0 1 0\n3 0 1 2\n"));
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().what, "the PLY header has the line 'element vertex 2'");
}

}  // namespace
}  // namespace sunder
