#include "fracture_tools/fragments/prefracture.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <future>
#include <iterator>
#include <numeric>

#include "fracture_tools/cells/cell_complex.h"
#include "fracture_tools/cells/kmeans.h"
#include "fracture_tools/cells/label_repair.h"
#include "fracture_tools/cells/tetrahedralize.h"
#include "fracture_tools/fragments/fragments.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/point_grid.h"
#include "fracture_tools/mesh/sharp_edges.h"
#include "fracture_tools/voronoi/cell_parts.h"
#include "fracture_tools/voronoi/voronoi_cutter.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// N tetrahedra fill a volume V when cells have the size (kCellsPerCube V / N)^(1/3). Measured on Mesh_3: 5.1 to 6
/// above 20,000 tetrahedra; where the surface dominates there are more of them, which does no harm.
constexpr double kCellsPerCube = 5.5;
/// The new surface's distance from the mesh, as a share of the cell size and, for few pieces, of the box's diagonal.
constexpr double kSurfaceDistance = 0.07, kLargestSurfaceDistance = 0.002;
/// Cells are made smaller and meshed again when there are fewer than this share of the wanted ones, this often.
constexpr double kEnoughCells = 0.6;
constexpr int kMeshingAttempts = 3;
/// And by this factor when a part of the mesh is lost.
constexpr double kSmallerWhereLost = 0.6;
constexpr double kVolumeErrorToTell = 0.012;
/// Vertices allowed for the surface, beyond what the pieces need: the most detailed solid tried took 35,000. A surface
/// that crosses itself may ask for more and more of them.
constexpr size_t kSpareVertices = 60'000;

/// Separate parts below this share of a piece's mean volume are left out. Where surfaces cross, meshing leaves such; a
/// particle of that mass would only disturb the rest.
constexpr double kCrumb = 0.002;

std::string percent(double share) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
    return text;
}

double volume_of(const TetMesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c, d] : mesh.tets)
        sum += (mesh.vertices[b] - mesh.vertices[a])
                   .cross(mesh.vertices[c] - mesh.vertices[a])
                   .dot(mesh.vertices[d] - mesh.vertices[a]) /
               6;
    return sum;
}

/// Meshes once; where the features that were chosen for the mesh stand in the way, without them.
Result<TetMesh> mesh_cells(const TriMesh& mesh, const PrefractureSettings& settings, const std::string& where,
                           TetrahedralizeSettings cells) {
    cells.sharp_angle = settings.sharp_angle > 0 ? settings.sharp_angle : choose_sharp_angle(mesh, cells.cell_size);
    Result<TetMesh> tets = tetrahedralize(mesh, cells, where);
    const bool may_drop_features = settings.sharp_angle == 0 && cells.sharp_angle > 0;
    if (tets || !may_drop_features || tets.error().code != ErrorCode::bad_input) return tets;
    cells.sharp_angle = 0;
    return tetrahedralize(mesh, cells, where);
}

/// The same in a thread of its own, for CGAL asks nobody whether to go on.
Result<TetMesh> mesh_cells_unless_cancelled(const TriMesh& mesh, const PrefractureSettings& settings,
                                            const std::string& where, TetrahedralizeSettings cells,
                                            const Progress& progress) {
    constexpr std::chrono::milliseconds kPatience(50);
    const auto goes_on = [&] { return progress.report(0, "filling the mesh with cells"); };
    if (!goes_on()) return cancelled();
    std::atomic<bool> stop{false};
    cells.stop = &stop;
    auto meshing = std::async(std::launch::async, [&] { return mesh_cells(mesh, settings, where, cells); });
    while (meshing.wait_for(kPatience) != std::future_status::ready)
        if (!goes_on()) stop = true;
    Result<TetMesh> tets = meshing.get();
    if (stop) return cancelled();
    return tets;
}

/// Tetrahedra enough for the pieces, with the mesh's volume and all of its parts; cells shrink until that holds.
/// `out_crumbs`: where parts were that are too small to be missed.
Result<TetMesh> fill(const TriMesh& mesh, const PrefractureSettings& settings, const std::string& where,
                     std::vector<std::string>& io_warnings, const Progress& progress, std::vector<Vec3>& out_crumbs) {
    const MeshReport report = check_mesh(mesh);
    const double wanted = settings.pieces * settings.cells_per_piece;
    TetrahedralizeSettings cells;
    cells.cell_size = math::cbrt(kCellsPerCube * report.volume / wanted);
    cells.surface_distance =
        std::min(kSurfaceDistance * cells.cell_size, kLargestSurfaceDistance * report.bounds.diagonal());
    cells.max_vertices = static_cast<size_t>(2 * wanted) + kSpareVertices;
    for (int attempt = 1;; ++attempt) {
        const double share = double(attempt - 1) / kMeshingAttempts;
        out_crumbs.clear();
        Result<TetMesh> tets = mesh_cells_unless_cancelled(mesh, settings, where, cells, progress.part(share, share));
        if (!tets) return tets;
        const double error = std::abs(volume_of(*tets) - report.volume) / report.volume;
        const double found = double(tets->tets.size()) / wanted;
        std::vector<LostShell> lost = find_lost_shells(mesh, *tets);
        std::erase_if(lost, [&](const LostShell& shell) {
            if (shell.volume >= kCrumb * report.volume / settings.pieces) return false;
            out_crumbs.push_back(shell.place);
            return true;
        });
        if (attempt < kMeshingAttempts && (found < kEnoughCells || error > kVolumeErrorToTell || !lost.empty())) {
            if (!lost.empty()) cells.cell_size *= kSmallerWhereLost;
            if (found < kEnoughCells) cells.cell_size *= math::cbrt(std::max(found, 0.05));
            cells.surface_distance = std::min(0.6 * cells.surface_distance, kSurfaceDistance * cells.cell_size);
            continue;
        }
        if (!lost.empty())
            return bad_input(where, "a part near " + place_text(lost[0].place) + " is lost in tetrahedra of this size",
                             "use more cells per piece, or set source to voronoi");
        if (error > kMaxVolumeError)
            return bad_input(where, "the cells' volume is " + percent(error) + " off the mesh's",
                             "remove self-intersections, or use more cells per piece");
        if (tets->tets.size() < size_t(settings.pieces))
            return bad_input(where,
                             "there are " + std::to_string(tets->tets.size()) + " cells for " +
                                 std::to_string(settings.pieces) + " pieces",
                             "ask for fewer pieces");
        if (error > kVolumeErrorToTell)
            io_warnings.push_back(where + ": the cells' volume is " + percent(error) +
                                  " off the mesh's (use more cells per piece)");
        return tets;
    }
}

/// A complex whose cells have labels 0 .. n_labels - 1, one for each fragment.
struct LabelledCells {
    CellComplex complex;
    std::vector<uint32_t> label;
    uint32_t n_labels = 0;
};

Result<LabelledCells> cut_by_kmeans(const TriMesh& solid, const PrefractureSettings& settings, const std::string& where,
                                    std::vector<std::string>& io_warnings, const Progress& progress) {
    std::vector<Vec3> crumbs;
    Result<TetMesh> tets = fill(solid, settings, where, io_warnings, progress.part(0, 0.7), crumbs);
    if (!tets) return tets.error();
    const double mean_piece = volume_of(*tets) / settings.pieces;
    std::ranges::copy(drop_crumbs(*tets, kCrumb * mean_piece), std::back_inserter(crumbs));
    if (!crumbs.empty())
        io_warnings.push_back(where + ": " + std::to_string(crumbs.size()) +
                              " separate parts much smaller than a piece were left out, first near " +
                              place_text(crumbs[0]) + " (source voronoi keeps them)");
    LabelledCells cut{make_cell_complex(*tets), {}, 0};
    find_source_triangles(solid, cut.complex);
    Result<std::vector<uint32_t>> label =
        kmeans_clusters(cut.complex.cell_centroid, cut.complex.cell_volume, settings.pieces, settings.seed,
                        settings.threads, progress.part(0.7, 0.9));
    if (!label) return label.error();
    if (!progress.report(0.9, "joining cells")) return cancelled();
    cut.label = label.take();
    cut.n_labels = repair_labels(cut.complex, settings.pieces, cut.label).n_labels;
    return cut;
}

/// Voronoi cells of like size, gathered into pieces as tetrahedra are.
Result<LabelledCells> cut_cells_by_kmeans(const TriMesh& solid, const PrefractureSettings& settings,
                                          const std::string& where, std::vector<std::string>& io_warnings,
                                          const Progress& progress) {
    SiteSettings site_settings;
    site_settings.sheets = settings.sites.sheets;
    site_settings.kind = SiteKind::poisson;
    site_settings.count = static_cast<int>(settings.pieces * settings.cells_per_piece);
    site_settings.seed = settings.seed;
    const Result<std::vector<Vec3>> sites =
        choose_sites(solid, site_settings, settings.threads, where, progress.part(0, 0.2));
    if (!sites) return sites.error();
    Result<CellComplex> complex =
        cut_by_sites(solid, *sites, settings.seed, settings.threads, where, io_warnings, progress.part(0.2, 0.8));
    if (!complex) return complex.error();
    LabelledCells cut{complex.take(), {}, 0};
    if (cut.complex.n_cells() < size_t(settings.pieces))
        return bad_input(where, "there are fewer cells than pieces", "ask for fewer pieces");
    std::vector<double> weight;  // rounding may have made a flat cell's volume negative
    for (double v : cut.complex.cell_volume) weight.push_back(std::max(v, 0.0));
    Result<std::vector<uint32_t>> label = kmeans_clusters(cut.complex.cell_centroid, weight, settings.pieces,
                                                          settings.seed, settings.threads, progress.part(0.8, 0.95));
    if (!label) return label.error();
    cut.label = label.take();
    cut.n_labels = repair_labels(cut.complex, settings.pieces, cut.label).n_labels;
    return cut;
}

/// Cells of the site nearest to their middle, in one part each.
void gather_around(const std::vector<Vec3>& sites, LabelledCells& io_cut) {
    const PointGrid grid(sites);
    std::vector<uint32_t> number(sites.size(), 0);
    for (const Vec3& middle : io_cut.complex.cell_centroid) {
        io_cut.label.push_back(grid.nearest(middle));
        number[io_cut.label.back()] = 1;
    }
    std::exclusive_scan(number.begin(), number.end(), number.begin(), 0u);
    for (uint32_t& l : io_cut.label) l = number[l];
    const uint32_t wanted = *std::max_element(io_cut.label.begin(), io_cut.label.end()) + 1;
    io_cut.n_labels = repair_labels(io_cut.complex, wanted, io_cut.label).n_labels;
}

/// Flat break surfaces: a cell a piece. Rough ones: several times as many cells, and a piece is what is near its site.
Result<LabelledCells> cut_by_voronoi(const TriMesh& solid, const PrefractureSettings& settings,
                                     const std::string& where, std::vector<std::string>& io_warnings,
                                     const Progress& progress) {
    SiteSettings site_settings = settings.sites;
    site_settings.count = settings.pieces;
    site_settings.seed = settings.seed;
    const Result<std::vector<Vec3>> sites =
        choose_sites(solid, site_settings, settings.threads, where, progress.part(0, 0.3));
    if (!sites) return sites.error();
    std::vector<Vec3> cell_sites = *sites;
    if (settings.roughness > 1) {
        // As dense as the pieces, where their kind tells it; else like sizes, as cheaply as may be.
        const SiteKind kind = site_settings.kind;
        if (kind == SiteKind::points || kind == SiteKind::grid || kind == SiteKind::kmeans)
            site_settings.kind = SiteKind::poisson;
        site_settings.count = settings.roughness * static_cast<int>(sites->size());
        site_settings.seed = ~settings.seed;
        Result<std::vector<Vec3>> fine =
            choose_sites(solid, site_settings, settings.threads, where, progress.part(0.3, 0.4));
        if (!fine) return fine.error();
        cell_sites = fine.take();
    }
    Result<CellComplex> complex =
        cut_by_sites(solid, cell_sites, settings.seed, settings.threads, where, io_warnings, progress.part(0.4, 0.9));
    if (!complex) return complex.error();
    if (!progress.report(0.9, "joining cells")) return cancelled();
    LabelledCells cut{complex.take(), {}, 0};
    if (settings.roughness > 1)
        gather_around(*sites, cut);
    else
        cut.n_labels = merge_small_cells(cut.complex, settings.least_piece, cut.label);
    // Of a grid most lie outside a thin mesh; a few of the others are merged with their neighbours.
    const bool is_given = site_settings.kind == SiteKind::points;
    const size_t wanted = is_given ? sites->size() : static_cast<size_t>(settings.pieces);
    if (site_settings.kind != SiteKind::grid && cut.n_labels < (is_given ? wanted : wanted / 2))
        io_warnings.push_back(where + ": " + std::to_string(cut.n_labels) + " pieces were made instead of " +
                              std::to_string(wanted) + ": sites coincide, lie outside the mesh, or are too near");
    return cut;
}

Result<FragmentSet> cut_solid(const TriMesh& solid, const PrefractureSettings& settings, const std::string& where,
                              std::vector<std::string>& io_warnings, const Progress& progress) {
    const auto cut_by = settings.method == CutMethod::voronoi    ? cut_by_voronoi
                        : settings.source == CellSource::voronoi ? cut_cells_by_kmeans
                                                                 : cut_by_kmeans;
    Result<LabelledCells> cut = cut_by(solid, settings, where, io_warnings, progress.part(0, 0.9));
    if (!cut) return cut.error();
    const bool counts_pieces = settings.method == CutMethod::kmeans;
    if (counts_pieces && cut->n_labels != uint32_t(settings.pieces))
        io_warnings.push_back(where + ": " + std::to_string(cut->n_labels) + " pieces were made instead of " +
                              std::to_string(settings.pieces) + ": the mesh has separate parts");

    if (!progress.report(0.9, "making fragments")) return cancelled();
    FragmentSet set = make_fragments(cut->complex, cut->label, cut->n_labels, solid);
    cut->complex = {};  // its memory is wanted for the checks
    if (Status s = shape_interior(settings.interior, settings.threads, progress.part(0.9, 1), set); !s)
        return s.error();
    if (Status s = check_fragments(set, settings.threads); !s) {
        const MeshReport r = check_mesh(solid);
        const double rounding = 0x1p-52 * r.bounds.diagonal() * r.area;  // m3
        if (rounding * double(set.fragments.size()) < kMeasureError * r.volume) return s.error();
        char text[160];
        std::snprintf(text, sizeof text,
                      "volumes of its pieces are lost in rounding: it reaches over %.3g m, around a volume of %.3g m3",
                      r.bounds.diagonal(), r.volume);
        return bad_input(where, text, "look for vertices far out");
    }
    return set;
}

}  // namespace

Status PrefractureSettings::check(const std::string& where) const {
    auto refuse = [&](const char* parameter, std::string what) {
        Error e = bad_input(where, std::move(what));
        e.parameter = parameter;
        return e;
    };
    if (pieces < 1 || pieces > 100'000)
        return refuse("pieces", "pieces must be 1 to 100000, not " + std::to_string(pieces));
    if (threads < 0) return refuse("threads", "threads must be 0 or more");
    if (roughness < 1 || roughness > 64) return refuse("roughness", "roughness must be 1 to 64");
    if (!(least_piece >= 0 && least_piece <= 1)) return refuse("least_piece", "the least piece must be 0 to 1");
    if (!(cells_per_piece >= 4 && cells_per_piece <= 1000))
        return refuse("cells_per_piece", "cells per piece must be 4 to 1000");
    if (!(sharp_angle >= 0 && sharp_angle <= 180))
        return refuse("sharp_angle", "the sharp angle must be 0 to 180 degrees");
    if (clusters < 0 || clusters > pieces) return refuse("clusters", "clusters must be 0 to the number of pieces");
    if (!(cluster_toughness >= 1 && cluster_toughness <= kMostFactor))
        return refuse("cluster_toughness", "the toughness within clusters must be 1 to 1000");
    if (!(weak_interface_share >= 0 && weak_interface_share <= 1))
        return refuse("weak_interface_share", "the share of weak interfaces must be 0 to 1");
    if (Status s = interior.check(where); !s) return s;
    return {};
}

Result<FragmentSet> prefracture(const TriMesh& mesh, const PrefractureSettings& settings, const std::string& where,
                                const Progress& progress) {
    if (Status s = settings.check(where); !s) return s.error();
    std::vector<std::string> warnings;
    Result<RepairedMesh> solid = repair_mesh(mesh, settings.repair, where, warnings, progress.part(0, 0.1));
    if (!solid) return solid.error();
    const size_t n_warnings = warnings.size();
    Result<FragmentSet> set = cut_solid(solid->mesh, settings, where, warnings, progress.part(0.1, 0.95));
    if (!set && set.error().code == ErrorCode::bad_input && solid->n_crossings > 0 &&
        settings.repair.mode == RepairMode::automatic) {
        warnings.resize(n_warnings);
        const std::string reason = "as it was, " + set.error().what;
        solid = wrap_mesh(solid->mesh, settings.repair, reason, where, warnings, progress.part(0.95, 0.96));
        if (!solid) return solid.error();
        set = cut_solid(solid->mesh, settings, where, warnings, progress.part(0.96, 1));
    }
    if (!set) return set;
    set->warnings = std::move(warnings);
    if (Status s = apply_maps(mesh, settings.maps, where, *set); !s) return s.error();
    if (settings.clusters > 0) gather_clusters(settings.clusters, settings.cluster_toughness, settings.seed, *set);
    if (settings.weak_interface_share > 0) leave_out_weak_interfaces(settings.weak_interface_share, *set);
    if (!progress.report(1, "fragments are ready")) return cancelled();
    return set;
}

}  // namespace sunder
