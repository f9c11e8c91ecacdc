#include "tests/fracture_tools/ugly_meshes.h"

#include "fracture_tools/mesh/mesh_checks.h"

namespace sunder::testing {
namespace {

constexpr RepairSettings kWalls{.thickness = 0.03, .wrap_detail = 0.04};
/// A wrap follows the surface within some thousandths of the diagonal.
constexpr double kWrap = 0.02;
constexpr const char* kAnew = "the surface was made anew";

TriMesh every_20th(const std::function<void(TriMesh&, size_t)>& change) {
    TriMesh mesh = make_torus();
    for (size_t t = 0, n = mesh.triangles.size(); t < n; t += 20) change(mesh, t);
    return mesh;
}

/// Two boxes in one mesh that share the vertices that are at the same place.
TriMesh welded_boxes(const Vec3& shift) {
    TriMesh mesh = joined(make_box(), make_box(), shift);
    for (Triangle& t : mesh.triangles)
        for (uint32_t& v : t)
            for (uint32_t w = 0; w < v; ++w)
                if (mesh.positions[w] == mesh.positions[v]) v = w;
    return mesh;
}

TriMesh box_and(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
    TriMesh mesh = make_box();
    mesh.positions.insert(mesh.positions.end(), points.begin(), points.end());
    mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
    return mesh;
}

TriMesh with_coordinate(double x) {
    TriMesh mesh = make_torus();
    mesh.positions[77].y() = x;
    return mesh;
}

/// A sphere of unequal triangles, some vertices pulled through the other side.
TriMesh spikes() {
    TriMesh mesh = make_torus(0.35, 0.15, 24, 12);
    for (size_t v : {5, 60, 111, 200}) mesh.positions[v] *= -1.1;
    return mesh;
}

TriMesh many_crumbs() {
    TriMesh mesh = make_torus();
    for (int k = 0; k < 200; ++k)
        mesh = joined(mesh, scaled(make_box(), 0.004), Vec3(0.01 * (k % 20), 0.01 * (k / 20), 0.5));
    return mesh;
}

TriMesh with_index(uint32_t v) {
    TriMesh mesh = make_box();
    mesh.triangles[4][1] = v;
    return mesh;
}

std::vector<UglyMesh> make_list() {
    const double torus = mesh_volume(make_torus());
    const Vec3 quarter = Vec3::Constant(0.25);
    const TriMesh half_box = make_box(Vec3::Constant(0.5));
    std::vector<UglyMesh> list;
    auto add = [&](UglyMesh mesh) { list.push_back(std::move(mesh)); };
    // Orientation and identity.
    add({"flipped", "every 20th triangle flipped",
         [] { return every_20th([](TriMesh& m, size_t t) { flip(m.triangles[t]); }); }, "triangles turned outward",
         true, torus});
    add({"inside_out", "all triangles face inward", [] { return flipped(make_torus()); }, "triangles turned outward",
         true, torus});
    add({"soup", "no two triangles share a vertex", [] { return as_soup(make_torus()); }, "", true, torus});
    add({"duplicates", "every 20th triangle twice",
         [] { return every_20th([](TriMesh& m, size_t t) { m.triangles.push_back(Triangle(m.triangles[t])); }); },
         "duplicate", true, torus});
    add({"duplicates_flipped", "every 20th triangle again, the other way round",
         [] {
             return every_20th([](TriMesh& m, size_t t) {
                 m.triangles.push_back({m.triangles[t][0], m.triangles[t][2], m.triangles[t][1]});
             });
         },
         "duplicate", true, torus});
    add({"degenerate", "triangles with a vertex twice",
         [] {
             return every_20th([](TriMesh& m, size_t t) {
                 m.triangles.push_back({m.triangles[t][0], m.triangles[t][0], m.triangles[t][1]});
             });
         },
         "degenerate", true, torus});
    add({"t_junction", "a vertex on an edge that the other side does not have", with_t_junction,
         "1 edge split where a vertex lies on it", true, 1});
    add({"loose_vertices", "vertices without a triangle",
         [] {
             return box_and({Vec3(3, 3, 3), Vec3(-5, 0, 0)}, {});
         },
         "", true, 1});
    add({"no_such_vertex", "a triangle names a vertex that is not there", [] { return with_index(99); },
         "triangle 4 has vertex 99 of 8", false});
    // Openings.
    add({"small_holes", "four triangles are missing",
         [] {
             return without(make_torus(), {1900, 1000, 400, 7});
         },
         "4 holes closed", true, torus});
    add({"rounded_seams", "a soup whose corners differ by 1e-9", [] { return shaken(as_soup(make_torus()), 1e-9, 1); },
         "welded", true, torus, 1e-6});
    add({"loose_seams", "a soup whose corners differ by 1e-5", [] { return shaken(as_soup(make_torus()), 1e-5, 1); },
         "(weld_distance, found)", true, torus, 1e-3});
    add({"no_lid", "a box without its lid",
         [] {
             return without(make_box(), {3, 2});
         },
         "the mesh is open: 4 boundary edges", false});
    add({"no_lid_walls", "the same, with thickness 0.03",
         [] {
             return without(make_box(), {3, 2});
         },
         "1 sheet given walls of 0.03 m", true, 0, 0, kWalls});
    add({"half_torus", "half of a torus is missing",
         [] {
             TriMesh mesh = make_torus();
             mesh.triangles.resize(mesh.triangles.size() / 2);
             return mesh;
         },
         "2 holes closed, the largest", true, torus / 2});
    add({"sheet", "a wavy open sheet", make_waves, "the mesh is open: 48 boundary edges", false});
    add({"sheet_walls", "the same, with thickness 0.03", make_waves, "1 sheet given walls of 0.03 m", true, 0, 0,
         kWalls});
    add({"sheet_wrapped",
         "the same, with repair wrap",
         make_waves,
         kAnew,
         true,
         0,
         0,
         {.mode = RepairMode::wrap, .wrap_detail = 0.04}});
    add({"moebius", "a band with one side, with thickness 0.03", [] { return make_moebius(); }, "given walls", true, 0,
         0, kWalls});
    add({"tight_fold",
         "a sheet folded more tightly than its thickness of 0.2",
         [] { return make_sheet(24, [](double x, double) { return 0.05 * std::sin(40 * x); }); },
         kAnew,
         true,
         0,
         0,
         {.thickness = 0.2, .wrap_detail = 0.04}});
    add({"one_triangle", "a single triangle", [] { return random_triangles(1); }, "the mesh is open: 3 boundary edges",
         false});
    add({"random_triangles", "a hundred triangles anywhere", [] { return random_triangles(100); },
         "the mesh is open: 300 boundary edges", false});
    // Edges and vertices with too much on them.
    add({"shared_edge", "two boxes that share an edge", [] { return welded_boxes(Vec3(1, 1, 0)); },
         "parted where it touched itself", true, 2});
    add({"shared_vertex", "two boxes that share a vertex", [] { return welded_boxes(Vec3(1, 1, 1)); },
         "parted where it touched itself", true, 2});
    add({"shared_face", "two boxes back to back, with a wall between", [] { return welded_boxes(Vec3(1, 0, 0)); }, "",
         true, 2});
    add({"inner_wall", "a box with a wall across its inside",
         [] {
             return box_and({}, {{0, 1, 7}, {0, 7, 6}});
         },
         "of walls and fins dropped", true, 1});
    add({"fin", "a triangle that stands on an edge",
         [] {
             return box_and({Vec3(0.5, -0.5, -0.5)}, {{0, 1, 8}});
         },
         "of walls and fins dropped", true, 1});
    add({"buried_sheet", "a box with an open sheet inside",
         [] { return joined(make_box(), scaled(make_waves(), 0.5), Vec3(0.25, 0.25, 0.5)); },
         "1 open sheet within solid matter dropped", true, 1});
    // Shells.
    add({"cavity", "a box in a box, facing inward", [=] { return joined(make_box(), flipped(half_box), quarter); }, "",
         true, 0.875});
    add({"buried", "a box in a box, facing outward", [=] { return joined(make_box(), half_box, quarter); },
         "within solid matter dropped", true, 1});
    add({"solid_in_cavity", "a box in a cavity in a box",
         [=] {
             return joined(joined(make_box(), flipped(half_box), quarter), scaled(half_box, 0.5),
                           Vec3::Constant(0.375));
         },
         "", true, 0.875 + 1.0 / 64});
    add({"part_inside_out", "one of two boxes inside out",
         [] { return joined(make_box(), flipped(make_box()), Vec3(2, 0, 0)); }, "triangles turned outward", true, 2});
    add({"twice", "a torus twice in one place", [] { return joined(make_torus(), make_torus()); }, "duplicate", true,
         torus});
    add({"coincident", "a box twice in one place, with other diagonals",
         [] {
             TriMesh other = make_box();
             other.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
             return joined(make_box(), other);
         },
         kAnew, true, 1, kWrap});
    add({"many_shells", "a torus and 200 crumbs", many_crumbs, "", true, torus + 200 * 6.4e-8});
    // Crossings.
    const double both = 2 - 0.5 * 0.75 * 0.9;
    const auto overlap = [] { return joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1)); };
    add({"overlap", "two boxes that overlap", overlap, "2 shells that cross or touch united", true, both});
    add({"overlap_wrapped",
         "the same, with repair wrap",
         overlap,
         kAnew,
         true,
         both,
         kWrap,
         {.mode = RepairMode::wrap, .wrap_detail = 0.04}});
    add({"touching", "two boxes that touch in part of a face",
         [] { return joined(make_box(), make_box(), Vec3(1, 0.3, 0.2)); }, "2 shells that cross or touch united", true,
         2});
    add({"chain", "three rings through one another, crossing",
         [] {
             TriMesh mesh = make_torus();
             for (double x : {0.55, 1.1}) mesh = joined(mesh, make_torus(), Vec3(x, 0.01, 0.02));
             return mesh;
         },
         "3 shells that cross or touch united", true});
    add({"spikes", "vertices pulled through the other side", spikes, "crosses or touches itself", true});
    add({"far_vertex", "a vertex a hundred sizes away",
         [] {
             TriMesh mesh = make_torus();
             mesh.positions[77].x() += 100;
             return mesh;
         },
         "", true});
    add({"shaken", "a torus shaken until it crosses itself",
         [] { return shaken(make_torus(0.35, 0.15, 32, 16), 0.03, 4); }, "", true});
    add({"klein_bottle", "closed, but with one side", [] { return make_klein_bottle(); }, kAnew, true});
    // Numbers.
    add({"nan", "a coordinate is not a number", [] { return with_coordinate(std::nan("")); },
         "vertex 77 has a coordinate that is no finite number", false});
    add({"infinite", "a coordinate is infinite", [] { return with_coordinate(-HUGE_VAL); },
         "vertex 77 has a coordinate that is no finite number", false});
    add({"overflow", "a coordinate of 1e300", [] { return with_coordinate(1e300); }, "too small or large", false});
    add({"tiny", "coordinates of 1e-6", [] { return scaled(make_torus(), 1e-6); }, "", true, torus * 1e-18});
    add({"huge", "coordinates of 1e6", [] { return scaled(make_torus(), 1e6); }, "", true, torus * 1e18});
    add({"tiny_overlap", "overlapping boxes of 1e-6", [=] { return scaled(overlap(), 1e-6); },
         "2 shells that cross or touch united", true, both * 1e-18});
    add({"far_away", "a torus of size 1, 1e6 from the origin",
         [] { return shifted(make_torus(), Vec3(1e6, -1e6, 1e6)); }, "", true, torus, 1e-8});
    add({"thin", "a plate a hundred thousand times wider than thick", [] { return make_box(Vec3(1, 1, 1e-5)); }, "",
         true, 1e-5});
    add({"needles", "a torus stretched a thousandfold",
         [] {
             TriMesh mesh = make_torus();
             for (Vec3& p : mesh.positions) p.x() *= 1000;
             return mesh;
         },
         "", true, 1000 * torus});
    // Nothing there.
    add({"empty", "no triangles", [] { return TriMesh(); }, "no triangles", false});
    add({"point", "all vertices in one place", [] { return scaled(make_box(), 0); }, "area", false});
    add({"line", "all vertices on a line", [] { return make_box(Vec3(1, 0, 0)); }, "area", false});
    add({"flat", "a box without height", [] { return make_box(Vec3(1, 1, 0)); }, "", false});
    return list;
}

}  // namespace

const std::vector<UglyMesh>& ugly_meshes() {
    static const std::vector<UglyMesh> list = make_list();
    return list;
}

}  // namespace sunder::testing
