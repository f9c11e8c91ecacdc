#include "fracture_tools/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "fracture_tools/disjoint_sets.h"

namespace sunder {
namespace {

std::string place(const Vec3& p) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.6g %.6g %.6g)", p.x(), p.y(), p.z());
    return text;
}

/// "12 open edges, first near (x y z)".
std::string fault(size_t n, const char* one, const char* many, const Vec3& first) {
    return std::to_string(n) + " " + (n == 1 ? one : many) + ", " + (n == 1 ? "" : "first ") + "near " + place(first);
}

/// One side of a triangle: from corner `corner` to the next one.
struct Side {
    uint32_t low, high, corner;
    bool ascends;  // runs from low to high
};

bool has_three_vertices(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

Vec3 area_vector(const MeshView& m, const Triangle& t) {
    return 0.5 * (m.positions[t[1]] - m.positions[t[0]]).cross(m.positions[t[2]] - m.positions[t[0]]);
}

bool find_bad_numbers(const MeshView& mesh, MeshReport& io_report) {
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (uint32_t v : mesh.triangles[t])
            if (v >= mesh.positions.size()) {
                io_report.faults.push_back("triangle " + std::to_string(t) + " has vertex " + std::to_string(v) +
                                           " of " + std::to_string(mesh.positions.size()));
                return true;
            }
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        if (!mesh.positions[v].allFinite()) {
            io_report.faults.push_back("vertex " + std::to_string(v) + " has a coordinate that is no finite number");
            return true;
        }
    return false;
}

void check_edges(const MeshView& mesh, const std::vector<Side>& sides, MeshReport& io_report) {
    Vec3 first_open, first_crowded, first_inconsistent;
    auto middle = [&](const Side& s) { return Vec3(0.5 * (mesh.positions[s.low] + mesh.positions[s.high])); };
    auto count = [&](size_t& io_n, Vec3& io_first, const Side& s) {
        if (io_n++ == 0) io_first = middle(s);
    };
    for (size_t i = 0, j; i < sides.size(); i = j) {
        for (j = i; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;) ++j;
        if (j - i == 1)
            count(io_report.open_edges, first_open, sides[i]);
        else if (j - i > 2)
            count(io_report.non_manifold_edges, first_crowded, sides[i]);
        else if (sides[i].ascends == sides[i + 1].ascends)
            count(io_report.inconsistent_edges, first_inconsistent, sides[i]);
    }
    MeshReport& r = io_report;
    if (r.open_edges) r.faults.push_back(fault(r.open_edges, "open edge", "open edges", first_open));
    if (r.non_manifold_edges)
        r.faults.push_back(fault(r.non_manifold_edges, "edge with more than two triangles",
                                 "edges with more than two triangles", first_crowded));
    if (r.inconsistent_edges)
        r.faults.push_back(fault(r.inconsistent_edges, "edge between triangles that face opposite ways",
                                 "edges between triangles that face opposite ways", first_inconsistent));
}

/// Counts vertices whose triangles form more than one fan, and the parts of the surface.
void check_vertices(const MeshView& mesh, const std::vector<Side>& sides, MeshReport& io_report) {
    const uint32_t n_corners = static_cast<uint32_t>(3 * mesh.triangles.size());
    auto vertex_of = [&](uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
    std::vector<uint32_t> fan = disjoint_sets(n_corners), part = disjoint_sets(mesh.positions.size());
    for (size_t i = 1; i < sides.size(); ++i) {
        if (sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high) continue;
        auto ends = [&](const Side& s) {  // corners at low and at high
            const uint32_t next = s.corner - s.corner % 3 + (s.corner + 1) % 3;
            return s.ascends ? std::pair(s.corner, next) : std::pair(next, s.corner);
        };
        const auto [low_a, high_a] = ends(sides[i - 1]);
        const auto [low_b, high_b] = ends(sides[i]);
        unite(fan, low_a, low_b);
        unite(fan, high_a, high_b);
    }
    std::vector<uint8_t> fans_at(mesh.positions.size(), 0);
    for (uint32_t c = 0; c < n_corners; ++c) {
        if (!has_three_vertices(mesh.triangles[c / 3])) continue;
        unite(part, vertex_of(c), vertex_of(c - c % 3));
        if (lowest(fan, c) == c && fans_at[vertex_of(c)] < 2) ++fans_at[vertex_of(c)];
    }
    Vec3 first_pinch, first_alone;
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (fans_at[v] == 0) {
            if (io_report.isolated_vertices++ == 0) first_alone = mesh.positions[v];
        } else {
            if (lowest(part, v) == v) ++io_report.n_components;
            if (fans_at[v] > 1 && io_report.non_manifold_vertices++ == 0) first_pinch = mesh.positions[v];
        }
    }
    if (io_report.non_manifold_vertices)
        io_report.faults.push_back(fault(io_report.non_manifold_vertices, "vertex where the surface touches itself",
                                         "vertices where the surface touches itself", first_pinch));
    if (io_report.isolated_vertices)
        io_report.faults.push_back(
            fault(io_report.isolated_vertices, "vertex without triangle", "vertices without triangle", first_alone));
}

void check_triangles(const MeshView& mesh, MeshReport& io_report) {
    Vec3 first_flat, first_double;
    std::vector<std::pair<Triangle, uint32_t>> by_vertices;
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        if (!has_three_vertices(t) || area_vector(mesh, t).squaredNorm() == 0) {
            if (io_report.degenerate_triangles++ == 0) first_flat = mesh.positions[t[0]];
        }
        Triangle sorted = t;
        std::sort(sorted.begin(), sorted.end());
        by_vertices.emplace_back(sorted, i);
    }
    std::sort(by_vertices.begin(), by_vertices.end());
    for (size_t i = 1; i < by_vertices.size(); ++i)
        if (by_vertices[i].first == by_vertices[i - 1].first && io_report.duplicate_triangles++ == 0)
            first_double = mesh.positions[by_vertices[i].first[0]];
    if (io_report.degenerate_triangles)
        io_report.faults.push_back(
            fault(io_report.degenerate_triangles, "triangle without area", "triangles without area", first_flat));
    if (io_report.duplicate_triangles)
        io_report.faults.push_back(
            fault(io_report.duplicate_triangles, "duplicate triangle", "duplicate triangles", first_double));
}

/// Signed volume about the middle of the box, and area.
std::pair<double, double> volume_and_area(const MeshView& mesh, const Aabb& bounds) {
    const Vec3 middle = 0.5 * (bounds.min + bounds.max);
    double volume = 0, area = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 n = area_vector(mesh, t);
        volume += (mesh.positions[t[0]] - middle).dot(n) / 3;
        area += n.norm();
    }
    return {volume, area};
}

Aabb bounds_of_triangles(const MeshView& mesh) {
    Aabb box;
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) box.extend(mesh.positions[v]);
    return box;
}

}  // namespace

MeshReport check_mesh(const MeshView& mesh) {
    MeshReport report;
    report.n_vertices = mesh.positions.size();
    report.n_triangles = mesh.triangles.size();
    report.has_bad_numbers = find_bad_numbers(mesh, report);
    if (mesh.triangles.empty()) report.faults.push_back("no triangles");
    if (!report.is_usable()) return report;

    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!has_three_vertices(mesh.triangles[t])) continue;
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t a = mesh.triangles[t][c], b = mesh.triangles[t][(c + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), 3 * t + c, a < b});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.corner) < std::tie(y.low, y.high, y.corner);
    });
    check_edges(mesh, sides, report);
    check_vertices(mesh, sides, report);
    check_triangles(mesh, report);
    report.bounds = bounds_of_triangles(mesh);
    std::tie(report.volume, report.area) = volume_and_area(mesh, report.bounds);
    if (report.volume == 0)
        report.faults.push_back("no volume");
    else if (report.volume < 0)
        report.faults.push_back("the triangles face inward");
    return report;
}

Status require_solid(const MeshView& mesh, const std::string& where) {
    const MeshReport r = check_mesh(mesh);
    if (r.is_solid()) return {};
    if (!r.is_usable()) return bad_input(where, "the mesh cannot be used: " + r.faults.front());
    if (r.open_edges > 0) return bad_input(where, "the mesh is open: " + r.faults.front(), "close it");
    // Faults of topology come first in the list, those of orientation and volume last, harmless ones between.
    const bool is_torn = r.non_manifold_edges + r.inconsistent_edges + r.non_manifold_vertices > 0;
    return bad_input(where, "the mesh bounds no solid: " + (is_torn ? r.faults.front() : r.faults.back()));
}

double mesh_volume(const MeshView& mesh) { return volume_and_area(mesh, bounds_of_triangles(mesh)).first; }
double mesh_area(const MeshView& mesh) { return volume_and_area(mesh, bounds_of_triangles(mesh)).second; }

}  // namespace sunder
