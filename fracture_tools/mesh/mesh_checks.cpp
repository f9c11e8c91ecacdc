#include "fracture_tools/mesh/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "solver/data/disjoint_sets.h"

namespace sunder {
namespace {

/// What one and what several of a kind are called.
std::pair<const char*, const char*> names_of(MeshFaultKind kind) {
    switch (kind) {
        case MeshFaultKind::open_edge:
            return {"open edge", "open edges"};
        case MeshFaultKind::non_manifold_edge:
            return {"edge with more than two triangles", "edges with more than two triangles"};
        case MeshFaultKind::inconsistent_edge:
            return {"edge between triangles that face opposite ways",
                    "edges between triangles that face opposite ways"};
        case MeshFaultKind::non_manifold_vertex:
            return {"vertex where the surface touches itself", "vertices where the surface touches itself"};
        case MeshFaultKind::isolated_vertex:
            return {"vertex without triangle", "vertices without triangle"};
        case MeshFaultKind::degenerate_triangle:
            return {"triangle without area", "triangles without area"};
        case MeshFaultKind::duplicate_triangle:
            return {"duplicate triangle", "duplicate triangles"};
        case MeshFaultKind::crossing:
            return {"triangle that crosses others", "triangles that cross others"};
        case MeshFaultKind::bad_number:
            return {"number that means nothing", "numbers that mean nothing"};
        case MeshFaultKind::no_triangles:
            return {"no triangles", ""};
        case MeshFaultKind::no_volume:
            return {"no volume", ""};
        case MeshFaultKind::inward:
            return {"the triangles face inward", ""};
    }
    return {"", ""};
}

/// Gathers faults of one kind in the order in which they are met.
class FaultCounter {
public:
    explicit FaultCounter(MeshFaultKind kind) : fault_{kind, 0, Vec3::Zero(), {}} {}

    void count(const Vec3& place) {
        if (fault_.count++ == 0) fault_.first = place;
    }
    void triangle(uint32_t t) { fault_.triangles.push_back(t); }
    size_t n() const { return fault_.count; }

    /// Into the report, if there are any.
    void report(MeshReport& io_report) {
        if (fault_.count == 0) return;
        auto& t = fault_.triangles;
        std::sort(t.begin(), t.end());
        t.erase(std::unique(t.begin(), t.end()), t.end());
        io_report.faults.push_back(fault_text(fault_));
        io_report.found.push_back(std::move(fault_));
    }

private:
    MeshFault fault_;
};

void report_whole(MeshFaultKind kind, MeshReport& io_report) {
    FaultCounter counter(kind);
    counter.count(Vec3::Zero());
    counter.report(io_report);
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
    auto tell = [&](std::string sentence) {
        io_report.found.push_back({MeshFaultKind::bad_number, 1, Vec3::Zero(), {}});
        io_report.faults.push_back(std::move(sentence));
        return true;
    };
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (uint32_t v : mesh.triangles[t])
            if (v >= mesh.positions.size())
                return tell("triangle " + std::to_string(t) + " has vertex " + std::to_string(v) + " of " +
                            std::to_string(mesh.positions.size()));
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        if (!mesh.positions[v].allFinite())
            return tell("vertex " + std::to_string(v) + " has a coordinate that is no finite number");
    return false;
}

void check_edges(const MeshView& mesh, const std::vector<Side>& sides, MeshReport& io_report) {
    FaultCounter open(MeshFaultKind::open_edge), crowded(MeshFaultKind::non_manifold_edge),
        inconsistent(MeshFaultKind::inconsistent_edge);
    for (size_t i = 0, j; i < sides.size(); i = j) {
        for (j = i; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;) ++j;
        FaultCounter* counter = nullptr;
        if (j - i == 1)
            counter = &open;
        else if (j - i > 2)
            counter = &crowded;
        else if (sides[i].ascends == sides[i + 1].ascends)
            counter = &inconsistent;
        if (!counter) continue;
        counter->count(0.5 * (mesh.positions[sides[i].low] + mesh.positions[sides[i].high]));
        for (size_t k = i; k < j; ++k) counter->triangle(sides[k].corner / 3);
    }
    io_report.open_edges = open.n(), io_report.non_manifold_edges = crowded.n();
    io_report.inconsistent_edges = inconsistent.n();
    for (FaultCounter* counter : {&open, &crowded, &inconsistent}) counter->report(io_report);
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
    FaultCounter pinched(MeshFaultKind::non_manifold_vertex), alone(MeshFaultKind::isolated_vertex);
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (fans_at[v] == 0) alone.count(mesh.positions[v]);
        if (fans_at[v] > 0 && lowest(part, v) == v) ++io_report.n_components;
        if (fans_at[v] > 1) pinched.count(mesh.positions[v]);
    }
    for (uint32_t c = 0; c < n_corners && pinched.n() > 0; ++c)
        if (fans_at[vertex_of(c)] > 1) pinched.triangle(c / 3);
    io_report.non_manifold_vertices = pinched.n(), io_report.isolated_vertices = alone.n();
    pinched.report(io_report), alone.report(io_report);
}

void check_triangles(const MeshView& mesh, MeshReport& io_report) {
    FaultCounter flat(MeshFaultKind::degenerate_triangle), doubled(MeshFaultKind::duplicate_triangle);
    std::vector<std::pair<Triangle, uint32_t>> by_vertices;
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        if (!has_three_vertices(t) || area_vector(mesh, t).squaredNorm() == 0) {
            flat.count(mesh.positions[t[0]]);
            flat.triangle(i);
        }
        Triangle sorted = t;
        std::sort(sorted.begin(), sorted.end());
        by_vertices.emplace_back(sorted, i);
    }
    std::sort(by_vertices.begin(), by_vertices.end());
    for (size_t i = 1; i < by_vertices.size(); ++i)
        if (by_vertices[i].first == by_vertices[i - 1].first) {
            doubled.count(mesh.positions[by_vertices[i].first[0]]);
            doubled.triangle(by_vertices[i].second);
        }
    io_report.degenerate_triangles = flat.n(), io_report.duplicate_triangles = doubled.n();
    flat.report(io_report), doubled.report(io_report);
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
    if (mesh.triangles.empty()) report_whole(MeshFaultKind::no_triangles, report);
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
        report_whole(MeshFaultKind::no_volume, report);
    else if (report.volume < 0)
        report_whole(MeshFaultKind::inward, report);
    return report;
}

std::string fault_text(const MeshFault& fault) {
    const auto [one, many] = names_of(fault.kind);
    if (!*many) return one;
    return std::to_string(fault.count) + " " + (fault.count == 1 ? one : many) + ", " +
           (fault.count == 1 ? "" : "first ") + "near " + place_text(fault.first);
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

std::string place_text(const Vec3& place) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.6g %.6g %.6g)", place.x(), place.y(), place.z());
    return text;
}

double mesh_volume(const MeshView& mesh) { return volume_and_area(mesh, bounds_of_triangles(mesh)).first; }
double mesh_area(const MeshView& mesh) { return volume_and_area(mesh, bounds_of_triangles(mesh)).second; }

}  // namespace sunder
