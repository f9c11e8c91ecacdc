// Named layers of a mesh through repairs: they go where their vertices, corners and triangles go.
#include "fracture_tools/repair/repair_attributes.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/repair/mesh_repair.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::as_soup;
using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

// x + 2 y + 3 z: linear, hence known wherever a vertex is.
double field(const Vec3& p) { return p.x() + 2 * p.y() + 3 * p.z(); }

TriMesh with_layers(TriMesh mesh) {
    MeshLayer point({"point", LayerDomain::point, LayerKind::number, 1});
    MeshLayer corner({"corner", LayerDomain::corner, LayerKind::number, 2});
    MeshLayer uv({"uv", LayerDomain::corner, LayerKind::uv, 2});
    MeshLayer face({"face", LayerDomain::face, LayerKind::integer, 1});
    for (const Vec3& p : mesh.positions) point.values.push_back(float(field(p)));
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const uint32_t v : mesh.triangles[t]) {
            corner.values.insert(corner.values.end(), {float(field(mesh.positions[v])), float(t)});
            uv.values.insert(uv.values.end(), {float(field(mesh.positions[v])), 0});
        }
        face.values.push_back(std::bit_cast<float>(t));
    }
    mesh.layers = {point, corner, uv, face};
    return mesh;
}

struct Errors {
    double point = 0, corner = 0, uv = 0;  // largest, of the field
    size_t foreign = 0;                    // corners that are not of the triangle that their face is
};

Errors errors(const TriMesh& source, const RepairSettings& settings) {
    std::vector<std::string> warnings;
    const Result<RepairedMesh> repaired = repair_mesh(with_layers(source), settings, "mesh", warnings);
    EXPECT_TRUE(repaired) << (repaired ? "" : repaired.error().text());
    if (!repaired) return {1e9, 1e9, 1e9, 1};
    const TriMesh& mesh = repaired->mesh;
    EXPECT_EQ(mesh.layers.size(), 4u);
    EXPECT_EQ(mesh.layers[0].n_rows(), mesh.positions.size());
    EXPECT_EQ(mesh.layers[1].n_rows(), 3 * mesh.triangles.size());
    EXPECT_EQ(mesh.layers[2].n_rows(), 3 * mesh.triangles.size());
    EXPECT_EQ(mesh.layers[3].n_rows(), mesh.triangles.size());
    Errors worst;
    for (uint32_t v = 0; v < mesh.positions.size(); ++v)
        worst.point = std::max(worst.point, std::abs(double(*mesh.layers[0].row(v)) - field(mesh.positions[v])));
    for (uint32_t c = 0; c < 3 * mesh.triangles.size(); ++c) {
        const double there = field(mesh.positions[mesh.triangles[c / 3][c % 3]]);
        worst.corner = std::max(worst.corner, std::abs(double(mesh.layers[1].row(c)[0]) - there));
        worst.uv = std::max(worst.uv, std::abs(double(mesh.layers[2].row(c)[0]) - there));
        worst.foreign += mesh.layers[1].row(c)[1] != float(std::bit_cast<uint32_t>(*mesh.layers[3].row(c / 3)));
    }
    return worst;
}

TEST(RepairAttributes, layers_stay_where_triangles_are_kept_turned_welded_or_united) {
    const TriMesh crossing = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    for (const TriMesh& mesh : {make_torus(), as_soup(make_torus()), flipped(make_torus()), crossing}) {
        const Errors e = errors(mesh, {.mode = RepairMode::keep});
        EXPECT_LT(e.point, 1e-6);
        EXPECT_LT(e.corner, 1e-6);
        EXPECT_LT(e.uv, 1e-6);
        EXPECT_EQ(e.foreign, 0u);
    }
}

TEST(RepairAttributes, patches_and_walls_take_over_what_is_beside_them) {
    TriMesh holes = make_torus(), sheet = make_box();
    for (const size_t t : {1900, 1000, 400, 7}) holes.triangles.erase(holes.triangles.begin() + t);
    sheet.triangles.resize(10);
    const Errors filled = errors(holes, {.mode = RepairMode::keep});
    EXPECT_LT(filled.point, 1e-6);
    EXPECT_LT(filled.corner, 1e-6);
    // Inner sides lie beside the surface by the thickness along a diagonal; the field grows by at most 6 a metre there.
    const Errors walls = errors(sheet, {.mode = RepairMode::keep, .thickness = 0.01});
    EXPECT_LT(walls.point, 0.01 * 6.1);
    EXPECT_LT(walls.corner, 0.01 * 6.1);
}

TEST(RepairAttributes, a_wrap_takes_the_nearest_and_keeps_seams) {
    const TriMesh crossing = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    const Errors e = errors(crossing, {.mode = RepairMode::wrap, .wrap_detail = 0.04});
    EXPECT_LT(e.point, 0.02);  // it lies beside the surface by a share of the detail
    EXPECT_EQ(e.foreign, 0u);  // each source triangle has a number of its own: no corner takes another's
}

}  // namespace
}  // namespace sunder
