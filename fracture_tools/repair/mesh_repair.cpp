#include "fracture_tools/repair/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/repair/repair_attributes.h"
#include "fracture_tools/repair/repair_holes.h"
#include "fracture_tools/repair/repair_seams.h"
#include "fracture_tools/repair/repair_shells.h"
#include "fracture_tools/repair/repair_surface.h"
#include "fracture_tools/repair/repair_thickness.h"
#include "fracture_tools/repair/repair_union.h"
#include "fracture_tools/repair/repair_walls.h"
#include "fracture_tools/repair/repair_wrap.h"

namespace sunder {
namespace {

/// A border longer than this share of its shell's diagonal, with more than kLargestPatch of its shell's area within it,
/// is no hole in a solid but the rim of a sheet. (A box without its lid lacks a fifth; the neck of a bust, a tenth; a
/// seam that came apart, nothing.)
constexpr double kLargestHole = 0.5, kLargestPatch = 0.15;
/// Borders closer than this share of the mesh's diagonal are one: what rounding in files makes of a seam.
constexpr double kWeld = 1e-6;
/// A gap that is found is at most this share of the diagonal. It is looked for this often, as long as borders remain,
/// and taken twice: ends of edges that run side by side may be farther apart than the edges.
constexpr double kLargestGap = 2e-3, kGapMargin = 2;
constexpr int kGapRounds = 3;
/// What leaves borders no shorter than this share of what they were closed no seams.
constexpr double kShorter = 0.999;
/// Vertices lie on an edge within so many roundings of the farthest coordinate where no distance is allowed.
constexpr double kOnEdge = 16 * 0x1p-52;
/// Squares and cubes of lengths must be numbers, m.
constexpr double kLeastSize = 1e-50, kLargestSize = 1e50;

std::string counted(size_t n, const char* one, const char* many) {
    return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

double area_of(const Vec3& a, const Vec3& b, const Vec3& c) { return 0.5 * (b - a).cross(c - a).norm(); }

double length_of(const std::vector<Border>& borders) {
    double sum = 0;
    for (const Border& b : borders) sum += b.length;
    return sum;
}

/// Of the triangles that would close a border.
double area_within(const TriMesh& mesh, const Border& border) {
    std::vector<Vec3> outline;
    for (uint32_t v : border.vertices) outline.push_back(mesh.positions[v]);
    double area = 0;
    for (const auto& [a, b, c] : fill_hole(outline)) area += area_of(outline[a], outline[b], outline[c]);
    return area;
}

/// Equal positions are one vertex, and no triangle has a vertex twice: what is closed by index is all there is to know.
bool is_welded(const TriMesh& mesh) {
    for (const auto& [a, b, c] : mesh.triangles)
        if (a == b || b == c || c == a) return false;
    std::vector<std::array<double, 3>> sorted;
    for (const Vec3& p : mesh.positions) sorted.push_back({p.x(), p.y(), p.z()});
    std::sort(sorted.begin(), sorted.end());
    return std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
}

/// What is far from the surface would enlarge its box.
TriMesh without_loose_vertices(TriMesh mesh) {
    keep_marked(mesh, std::vector<uint8_t>(mesh.triangles.size(), 1));
    return mesh;
}

/// The chain that keeps the artist's triangles.
class KeepChain {
public:
    KeepChain(const TriMesh& source, const RepairSettings& settings, const std::string& where)
        : source_(source), settings_(settings), where_(where), before_(check_mesh(source)) {}

    Result<RepairedMesh> run(const Progress& progress) {
        if (!before_.is_usable()) return bad_input(where_, "the mesh cannot be used: " + before_.faults.front());
        if (before_.area == 0) return bad_input(where_, "no triangle of the mesh has an area");
        const double farthest = before_.bounds.max.cwiseAbs().cwiseMax(before_.bounds.min.cwiseAbs()).maxCoeff();
        if (!(before_.bounds.diagonal() > kLeastSize && farthest < kLargestSize))
            return bad_input(where_,
                             "coordinates of up to " + number(farthest) + " m are too small or large to compute with",
                             "check its scale");
        if (!progress.report(0, "checking the mesh")) return cancelled();
        mesh_ = without_loose_vertices(source_);
        is_changed_ = !before_.is_solid() || before_.duplicate_triangles > 0 || !is_welded(source_);
        if (is_changed_) {
            if (Status s = make_closed(progress.part(0.1, 0.6)); !s) return s.error();
            const MeshReport closed = check_mesh(mesh_);
            if (closed.open_edges + closed.non_manifold_edges + closed.inconsistent_edges > 0)
                return require_solid(mesh_, where_).error();
        }
        if (!progress.report(0.6, "looking for crossings")) return cancelled();
        wrap_may_help_ = true;
        std::vector<std::array<uint32_t, 2>> crossing = crossing_triangles(mesh_);
        if (!progress.report(0.8, "orienting shells")) return cancelled();
        const ShellReport shells = arrange_shells(mesh_, sense_, crossing);
        is_changed_ |= shells.turned + shells.buried + shells.flat > 0;
        if (shells.flat == shells.n_shells) {
            wrap_may_help_ = false;
            return bad_input(where_, "the mesh bounds no solid: no volume", "give a solid, or a sheet and a thickness");
        }
        if (!progress.report(0.9, "uniting shells")) return cancelled();
        if (shells.buried + shells.flat > 0) crossing = crossing_triangles(mesh_);
        const UnionReport in_one = unite_shells(mesh_, crossing);
        if (in_one.left > 0)
            return bad_input(where_,
                             std::to_string(in_one.left) + " shells overlap and cannot be united, first near " +
                                 place_text(in_one.first_left),
                             "unite them in a modelling program, or set repair to wrap");
        if (in_one.united > 0) {
            told.push_back(std::to_string(in_one.united) + " shells that cross or touch united");
            crossing = crossing_triangles(mesh_);
        }
        if (is_changed_)
            if (Status s = require_solid(mesh_, where_); !s) return s.error();
        tell(shells, crossing);
        return RepairedMesh{std::move(mesh_), crossing.size(), false};
    }

    std::vector<std::string> told;  // what was done
    bool wrap_may_help() const { return wrap_may_help_; }

private:
    struct State {
        TriMesh mesh;
        std::vector<Sense> sense;
        std::vector<std::string> told;
    };

    void join() {
        Result<TriMesh> joined = join_triangles(mesh_, where_);
        if (!joined) {
            failure_ = joined.error();
            return;
        }
        TriMesh next = joined.take();
        std::vector<Sense> sense;
        for (const Origin& o : carry_attributes(mesh_, next)) {
            const Sense before = sense_.empty() ? Sense::same : sense_[o.triangle];
            sense.push_back(Sense(int(o.sense) * int(before)));
        }
        sense_ = std::move(sense);
        mesh_ = std::move(next);
    }

    Status make_closed(const Progress& progress) {
        wrap_may_help_ = true;
        n_dropped_ = weld_positions(mesh_);
        welded_ = check_mesh(mesh_);
        if (welded_.non_manifold_edges > 0)
            if (const size_t n = drop_walls(mesh_); n > 0) tell_walls(n);
        join();
        if (failure_) return *failure_;
        std::vector<Border> borders = find_borders(mesh_);
        if (Status s = close_seams(borders); !s) return s;
        if (borders.empty()) return {};
        if (Status s = make_walls(borders); !s) return s;
        if (Status s = close_borders(mesh_, borders, progress); !s) return s;
        sense_.resize(mesh_.triangles.size(), Sense::none);
        if (borders.empty()) return {};
        const Border& largest = *std::ranges::max_element(borders, {}, &Border::length);
        told.push_back(counted(borders.size(), "hole", "holes") + " closed, the largest " + number(largest.length) +
                       " m around, near " + place_text(mesh_.positions[largest.vertices[0]]));
        return {};
    }

    /// Borders that are the two sides of one seam become one.
    Status close_seams(std::vector<Border>& io_borders) {
        if (settings_.weld_distance) {
            const std::string told_as = "borders up to " + number(*settings_.weld_distance) + " m apart welded";
            return weld_and_split(*settings_.weld_distance, told_as + " (weld_distance)", io_borders);
        }
        const double diagonal = before_.bounds.diagonal();
        double reached = 0;  // m
        for (int round = 0; round < kGapRounds && !io_borders.empty(); ++round) {
            const double gap = seam_gap(mesh_, find_open_edges(mesh_), reached, kLargestGap * diagonal);
            if (round > 0 && gap == 0) break;
            reached = std::max(kWeld * diagonal, kGapMargin * gap);
            if (reached > kWeld * diagonal) {
                const State before = {mesh_, sense_, told};
                const double length = length_of(io_borders);
                const std::string told_as = "seams up to " + number(gap) + " m apart welded";
                if (Status s = weld_and_split(reached, told_as + " (weld_distance, found)", io_borders); !s) return s;
                if (length_of(io_borders) < kShorter * length) continue;
                mesh_ = before.mesh, sense_ = before.sense, told = before.told;  // they were no seams
                io_borders = find_borders(mesh_);
                reached = kWeld * diagonal;
            }
            if (round > 0) break;
            if (Status s = weld_and_split(reached, "borders closer than rounding welded", io_borders); !s) return s;
        }
        return {};
    }

    /// Welds borders within `distance` (m) of one another and splits edges at vertices on them.
    Status weld_and_split(double distance, const std::string& told_as, std::vector<Border>& io_borders) {
        const size_t n_before = io_borders.size();
        if (weld_borders(mesh_, io_borders, distance) > 0) {
            join();
            if (failure_) return *failure_;
            io_borders = find_borders(mesh_);
            if (io_borders.size() != n_before) told.push_back(told_as);
        }
        const double least = kOnEdge * before_.bounds.min.cwiseAbs().cwiseMax(before_.bounds.max.cwiseAbs()).maxCoeff();
        const SplitEdges split = split_open_edges(mesh_, find_open_edges(mesh_), std::max(distance, least));
        if (split.n == 0) return {};
        for (uint32_t source : split.source) sense_.push_back(Sense{sense_[source]});
        told.push_back((split.n == 1
                            ? "1 edge split where a vertex lies on it, near "
                            : std::to_string(split.n) + " edges split where vertices lie on them, first near ") +
                       place_text(split.first));
        join();
        if (failure_) return *failure_;
        io_borders = find_borders(mesh_);
        return {};
    }

    void tell_walls(size_t n_dropped) {
        const auto edge = std::ranges::find(welded_.found, MeshFaultKind::non_manifold_edge, &MeshFault::kind);
        told.push_back(counted(n_dropped, "triangle", "triangles") + " of walls and fins dropped, first edge near " +
                       place_text(edge->first));
        welded_ = check_mesh(mesh_);
    }

    /// Sheets get their thickness; leaves the borders that are holes.
    Status make_walls(std::vector<Border>& io_borders) {
        const Shells shells = find_shells(mesh_);
        std::vector<uint32_t> shell_at(mesh_.positions.size(), 0);
        std::vector<Aabb> box(shells.n);
        std::vector<double> area(shells.n, 0.0);  // m2
        for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            const auto& [a, b, c] = mesh_.triangles[t];
            area[shells.of_triangle[t]] += area_of(mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]);
            for (uint32_t v : mesh_.triangles[t]) {
                shell_at[v] = shells.of_triangle[t];
                box[shell_at[v]].extend(mesh_.positions[v]);
            }
        }
        std::vector<uint8_t> is_sheet(shells.n, 0);
        size_t n_open = 0;
        const Border* rim = nullptr;
        for (const Border& b : io_borders) {
            const uint32_t shell = shell_at[b.vertices[0]];
            n_open += b.vertices.size();
            if (b.length <= kLargestHole * box[shell].diagonal()) continue;
            if (area_within(mesh_, b) <= kLargestPatch * area[shell]) continue;
            is_sheet[shell] = 1;
            if (!rim) rim = &b;
        }
        if (!rim) return {};
        if (drop_buried_sheets(shells, is_sheet)) {
            io_borders = find_borders(mesh_);
            return make_walls(io_borders);
        }
        if (welded_.open_edges == 0) {  // it came apart where it was made manifold
            if (welded_.non_manifold_edges == 0)
                return bad_input(where_, "the surface has one side only, hence no inside");
            return bad_input(where_, "the mesh bounds no solid: " + welded_.faults.front(), "set repair to wrap");
        }
        if (settings_.thickness == 0) {
            wrap_may_help_ = false;
            Error e = bad_input(where_,
                                "the mesh is open: " + std::to_string(n_open) + " boundary edges, first near " +
                                    place_text(mesh_.positions[rim->vertices[0]]),
                                "close it, set weld_distance to weld seams that are farther apart, thickness to give a "
                                "sheet walls, or repair to wrap");
            e.parameter = "thickness";
            return e;
        }
        std::vector<uint8_t> marked;
        for (uint32_t shell : shells.of_triangle) marked.push_back(is_sheet[shell]);
        thicken(mesh_, marked, settings_.thickness);
        std::erase_if(io_borders, [&](const Border& b) { return is_sheet[shell_at[b.vertices[0]]]; });
        const auto n = static_cast<size_t>(std::count(is_sheet.begin(), is_sheet.end(), 1));
        told.push_back(counted(n, "sheet", "sheets") + " given walls of " + number(settings_.thickness) + " m");
        return {};
    }

    /// Sheets within the solid that the rest of the mesh bounds. False: there are none.
    bool drop_buried_sheets(const Shells& shells, std::span<const uint8_t> is_sheet) {
        const std::vector<uint8_t> is_buried = find_buried_sheets(mesh_, sense_, is_sheet);
        const auto n = static_cast<size_t>(std::count(is_buried.begin(), is_buried.end(), 1));
        if (n == 0) return false;
        std::vector<uint8_t> mark;
        std::vector<Sense> sense;
        std::optional<Vec3> first;
        for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            mark.push_back(!is_buried[shells.of_triangle[t]]);
            if (mark.back())
                sense.push_back(sense_[t]);
            else if (!first)
                first = mesh_.positions[mesh_.triangles[t][0]];
        }
        keep_marked(mesh_, mark);
        sense_ = std::move(sense);
        told.push_back(counted(n, "open sheet", "open sheets") + " within solid matter dropped, first near " +
                       place_text(*first));
        return true;
    }

    void tell(const ShellReport& shells, std::span<const std::array<uint32_t, 2>> crossing) {
        if (n_dropped_ > 0)
            told.push_back(
                counted(n_dropped_, "degenerate or duplicate triangle", "degenerate or duplicate triangles") +
                " dropped");
        if (before_.inconsistent_edges > 0 || shells.turned > 0) told.push_back("triangles turned outward");
        if (welded_.non_manifold_edges + welded_.non_manifold_vertices > 0)
            told.push_back("the surface was parted where it touched itself");
        if (shells.buried > 0)
            told.push_back(counted(shells.buried, "shell", "shells") + " within solid matter dropped, first near " +
                           place_text(shells.first_buried) + " (turned round it would be a cavity)");
        if (shells.flat > 0)
            told.push_back(counted(shells.flat, "shell", "shells") + " without volume dropped, first near " +
                           place_text(shells.first_flat));
        if (!crossing.empty())
            told.push_back("the surface crosses or touches itself at " +
                           counted(crossing.size(), "pair of triangles", "pairs of triangles") + ", first near " +
                           place_text(mesh_.positions[mesh_.triangles[crossing[0][0]][0]]));
    }

    const TriMesh& source_;
    const RepairSettings& settings_;
    const std::string& where_;
    const MeshReport before_;
    MeshReport welded_;
    TriMesh mesh_;
    std::vector<Sense> sense_;  // of each triangle against the artist's; empty: all the same
    std::optional<Error> failure_;
    size_t n_dropped_ = 0;
    bool is_changed_ = false, wrap_may_help_ = false;
};

}  // namespace

Status RepairSettings::check(const std::string& where) const {
    auto refuse = [&](const char* parameter, const char* what) {
        Error e = bad_input(where, what);
        e.parameter = parameter;
        return e;
    };
    if (!(thickness >= 0 && std::isfinite(thickness))) return refuse("thickness", "the thickness must be 0 or more");
    if (weld_distance && !(*weld_distance >= 0 && std::isfinite(*weld_distance)))
        return refuse("weld_distance", "the weld distance must be 0 or more");
    if (!(wrap_detail >= 0.002 && wrap_detail <= 0.2))
        return refuse("wrap_detail", "the detail of a wrap must be 0.002 to 0.2");
    return {};
}

Result<RepairedMesh> repair_mesh(const TriMesh& mesh, const RepairSettings& settings, const std::string& where,
                                 std::vector<std::string>& io_warnings, const Progress& progress) {
    if (Status s = settings.check(where); !s) return s.error();
    if (settings.mode == RepairMode::refuse) {
        if (Status s = require_solid(mesh, where); !s) return s.error();
        return RepairedMesh{without_loose_vertices(mesh), 0, false};
    }
    if (settings.mode == RepairMode::wrap && settings.thickness == 0)
        return wrap_mesh(mesh, settings, "repair is set to wrap", where, io_warnings, progress);
    KeepChain chain(mesh, settings, where);
    Result<RepairedMesh> kept = chain.run(progress.part(0, 0.5));
    if (!kept) {
        const bool may_wrap = settings.mode != RepairMode::keep && chain.wrap_may_help();
        if (!may_wrap || kept.error().code != ErrorCode::bad_input) return kept;
        return wrap_mesh(mesh, settings, kept.error().what, where, io_warnings, progress.part(0.5, 1));
    }
    for (const std::string& sentence : chain.told) io_warnings.push_back(where + ": " + sentence);
    if (settings.mode == RepairMode::wrap)
        return wrap_mesh(kept->mesh, settings, "repair is set to wrap", where, io_warnings, progress.part(0.5, 1));
    return kept;
}

Result<RepairedMesh> wrap_mesh(const TriMesh& mesh, const RepairSettings& settings, const std::string& reason,
                               const std::string& where, std::vector<std::string>& io_warnings,
                               const Progress& progress) {
    const MeshReport before = check_mesh(mesh);
    if (!before.is_usable()) return bad_input(where, "the mesh cannot be used: " + before.faults.front());
    if (before.area == 0) return bad_input(where, "no triangle of the mesh has an area");
    const double detail = settings.wrap_detail * before.bounds.diagonal();
    Result<TriMesh> wrap = wrap_surface(mesh, detail, where, progress);
    if (!wrap) return wrap.error();
    if (Status s = require_solid(*wrap, where); !s) return s.error();
    resample_attributes(mesh, *wrap);
    const MeshReport after = check_mesh(*wrap);
    io_warnings.push_back(
        where + ": the surface was made anew (" + reason +
        "): UVs, materials and groups are those of the nearest triangle, normals are lost, detail and "
        "gaps below " +
        number(detail) + " m too, cavities are filled; volume " + number(before.volume) + " -> " +
        number(after.volume) + " m3, area " + number(before.area) + " -> " + number(after.area) + " m2");
    return RepairedMesh{wrap.take(), 0, true};
}

}  // namespace sunder
