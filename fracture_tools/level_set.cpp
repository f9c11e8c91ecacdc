#include "fracture_tools/level_set.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_distance.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/repair/mesh_repair.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

using Nodes = std::array<uint32_t, 3>;

constexpr int kPadding = 3;             // voxels around the surface's bounds
constexpr float kBand = 6;              // voxels on both sides of the surface that are exact
constexpr int kMostCoarse = 24;         // nodes of the grid for what is farther away, along the longest side
constexpr double kLostVolume = 0.05;    // share of the mesh's volume, from which the loss is told
constexpr size_t kWindingSamples = 32;  // on each side of the surface

std::string text(double v) {
    char s[32];
    std::snprintf(s, sizeof s, "%.3g", v);
    return s;
}

/// Fine grids want a wider band: their far field is the coarser.
struct Bands {
    int factor;  // coarse nodes for fine ones, along each axis
    float band;  // voxels

    explicit Bands(const Nodes& nodes)
        : factor(std::max(2, int(std::ranges::max(nodes) + kMostCoarse - 1) / kMostCoarse)),
          band(std::max(kBand, 1.5f * float(factor))) {}
};

/// No node is farther from the surface than a neighbour and the way to it. OpenVDB misses the nearest triangle here and
/// there, two or three voxels away, by half a voxel and more; its neighbours know better.
void trim(const Nodes& nodes, std::vector<float>& io_distance) {
    struct Step {
        std::ptrdiff_t to;
        float length;
    };
    std::vector<Step> steps;
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            for (int k = -1; k <= 1; ++k)
                if (i || j || k)
                    steps.push_back({(std::ptrdiff_t(i) * nodes[1] + j) * std::ptrdiff_t(nodes[2]) + k,
                                     std::sqrt(float(i * i + j * j + k * k))});
    const std::vector<float> before = io_distance;
    for (size_t i = 1; i + 1 < nodes[0]; ++i)
        for (size_t j = 1; j + 1 < nodes[1]; ++j)
            for (size_t k = 1; k + 1 < nodes[2]; ++k) {
                const size_t n = (i * nodes[1] + j) * nodes[2] + k;
                const float side = before[n] < 0 ? -1.f : 1.f;
                float least = std::abs(before[n]);
                for (const Step& s : steps)
                    least = std::min(least, side * before[size_t(std::ptrdiff_t(n) + s.to)] + s.length);
                io_distance[n] = side * least;
            }
}

/// The distance far from the surface, from a grid with few nodes: at the nodes of `io_distance` (in voxels) that are
/// `band` or more away.
void add_far_field(const MeshView& mesh, const GridNodes& grid, int factor, float band,
                   std::vector<float>& io_distance) {
    const Nodes& nodes = grid.nodes;
    GridNodes few{{}, grid.origin, grid.voxel_size * factor};
    for (int i = 0; i < 3; ++i) few.nodes[i] = (nodes[i] - 1) / uint32_t(factor) + 2;
    // What is farther from the surface than the longest side keeps that: a lower bound.
    std::vector<float> far = unsigned_distances(mesh, few, float(std::ranges::max(few.nodes)));
    trim(few.nodes, far);
    const auto value = [&](size_t i, size_t j, size_t k) { return far[(i * few.nodes[1] + j) * few.nodes[2] + k]; };
    size_t n = 0;
    for (size_t i = 0; i < nodes[0]; ++i)
        for (size_t j = 0; j < nodes[1]; ++j)
            for (size_t k = 0; k < nodes[2]; ++k, ++n) {
                if (std::abs(io_distance[n]) < band) continue;
                const size_t f = size_t(factor), a = i / f, b = j / f, c = k / f;
                const float x = float(i % f) / float(f), y = float(j % f) / float(f), z = float(k % f) / float(f);
                const auto along_z = [&](size_t p, size_t q) {
                    return std::lerp(value(p, q, c), value(p, q, c + 1), z);
                };
                const float far_value = std::lerp(std::lerp(along_z(a, b), along_z(a, b + 1), y),
                                                  std::lerp(along_z(a + 1, b), along_z(a + 1, b + 1), y), x);
                io_distance[n] = std::copysign(std::max(band, far_value * float(factor)), io_distance[n]);
            }
}

/// Triangles of shells whose own volume is positive, and of those that face inwards: cavities.
struct SortedShells {
    std::vector<Triangle> outer, cavities;
};

SortedShells sort_shells(const MeshView& mesh) {
    const Shells shells = find_shells(mesh);
    const std::vector<double> volume = shell_volumes(mesh, shells);
    SortedShells sorted;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        (volume[shells.of_triangle[t]] < 0 ? sorted.cavities : sorted.outer).push_back(mesh.triangles[t]);
    return sorted;
}

/// How often the surface winds around a point: 1 inside, 0 outside (van Oosterom and Strackee 1983).
double winding_number(const MeshView& mesh, const Vec3& x) {
    double angle = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t[0]] - x, b = mesh.positions[t[1]] - x, c = mesh.positions[t[2]] - x;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle += math::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (2 * std::numbers::pi);
}

/// Compares signs with winding numbers at nodes clear of the surface; how many differ, and where the first.
struct SignCheck {
    size_t n_samples = 0, n_wrong = 0;
    Vec3 first = Vec3::Zero();
};

SignCheck check_signs(const MeshView& mesh, const SignedDistanceGrid& grid) {
    SignCheck check;
    for (const bool inside : {true, false}) {
        const auto is_clear = [&](size_t n) {
            const double d = inside ? -double(grid.distance[n]) : double(grid.distance[n]);
            return d > 1.5 * grid.voxel_size && d < 1e3 * grid.voxel_size;
        };
        size_t n_clear = 0;
        for (size_t n = 0; n < grid.distance.size(); ++n) n_clear += is_clear(n);
        const size_t stride = n_clear / kWindingSamples + 1;
        size_t seen = 0;
        for (size_t n = 0; n < grid.distance.size(); ++n) {
            if (!is_clear(n) || seen++ % stride != stride / 2) continue;
            const size_t k = n % grid.nodes[2], j = n / grid.nodes[2] % grid.nodes[1];
            const Vec3 x = grid.node(n / grid.nodes[2] / grid.nodes[1], j, k);
            ++check.n_samples;
            if ((winding_number(mesh, x) > 0.5) != inside && check.n_wrong++ == 0) check.first = x;
        }
    }
    return check;
}

Nodes nodes_for(const Vec3& side, double voxel_size) {
    Nodes nodes;
    for (int i = 0; i < 3; ++i)
        nodes[i] = static_cast<uint32_t>(std::min(std::ceil(side[i] / voxel_size), 1e6)) + 1 + 2 * kPadding;
    return nodes;
}
double bytes_of(const Nodes& nodes) { return double(nodes[0]) * nodes[1] * nodes[2] * sizeof(float); }

/// The next voxel size of two figures that keeps the grid below the limit, m.
double fitting_voxel_size(const Vec3& side, double voxel_size) {
    while (bytes_of(nodes_for(side, voxel_size)) > double(kMostLevelSetBytes)) voxel_size *= 1.02;
    const double unit = math::pow(10, std::floor(math::log10(voxel_size)) - 1);
    return std::ceil(voxel_size / unit) * unit;
}

/// The mesh as one that bounds a solid.
Result<TriMesh> solid(const TriMesh& mesh, const std::string& where, std::vector<std::string>& io_warnings) {
    Result<RepairedMesh> mended = repair_mesh(mesh, RepairSettings(), where, io_warnings);
    if (mended) return std::move(mended->mesh);
    Error error = mended.error();
    error.mend += (error.mend.empty() ? "" : "; ") + std::string("an open sheet collides if it is given a thickness");
    return error;
}

void fill(SignedDistanceGrid& io_grid, const MeshView& mesh, double thickness) {
    const GridNodes nodes{io_grid.nodes, io_grid.origin, io_grid.voxel_size};
    const Bands bands(nodes.nodes);
    const auto distances = [&](const std::vector<Triangle>& part) {
        const MeshView shells(mesh.positions, part);
        std::vector<float> distance = signed_distances(shells, nodes, bands.band);
        add_far_field(shells, nodes, bands.factor, bands.band, distance);
        trim(nodes.nodes, distance);
        return distance;
    };
    std::vector<float>& distance = io_grid.distance;
    if (thickness > 0) {
        const float half = float(0.5 * thickness / io_grid.voxel_size), band = bands.band + half;
        distance = unsigned_distances(mesh, nodes, band);
        add_far_field(mesh, nodes, bands.factor, band, distance);
        trim(nodes.nodes, distance);
        for (float& d : distance) d -= half;
    } else {
        const SortedShells shells = sort_shells(mesh);
        distance = distances(shells.outer);
        if (!shells.cavities.empty()) {
            const std::vector<float> cavity = distances(shells.cavities);
            for (size_t n = 0; n < cavity.size(); ++n) distance[n] = std::max(distance[n], -cavity[n]);
        }
    }
    for (float& d : distance) d *= float(io_grid.voxel_size);
}

Status check_result(const MeshView& mesh, const SignedDistanceGrid& grid, double thickness, const std::string& where,
                    std::vector<std::string>& io_warnings) {
    const std::string voxels = "at a voxel size of " + text(grid.voxel_size) + " m ";
    if (std::ranges::min(grid.distance) >= 0)
        return bad_input(where, voxels + "nothing of the mesh is left: all of it is thinner than that",
                         "give smaller voxels");
    if (thickness > 0) return {};
    const SignCheck signs = check_signs(mesh, grid);
    if (signs.n_wrong > 0) {
        char place[96];
        std::snprintf(place, sizeof place, "(%.6g %.6g %.6g)", signs.first.x(), signs.first.y(), signs.first.z());
        const std::string found = "inside and outside cannot be told apart at " + std::to_string(signs.n_wrong) +
                                  " of " + std::to_string(signs.n_samples) + " places, first near " + place;
        if (10 * signs.n_wrong > signs.n_samples)
            return bad_input(where, found,
                             "join parts that cross one another, and turn all faces outwards (of cavities: into them)");
        io_warnings.push_back(where + ": " + found);
    }
    const double volume = mesh_volume(mesh), kept = level_set_volume(grid) / volume;
    if (std::abs(kept - 1) > kLostVolume)
        io_warnings.push_back(where + ": " + voxels + "the collider has " + text(100 * kept) +
                              " % of the mesh's volume: what is thinner than two voxels is lost, smaller ones keep it");
    return {};
}

}  // namespace

Status LevelSetSettings::check(const std::string& where) const {
    if (!(voxel_size >= 0 && std::isfinite(voxel_size)))
        return bad_input(where, "voxel_size is " + text(voxel_size) + " m", "0: by resolution; else above 0");
    if (resolution < 8 || resolution > 1000)
        return bad_input(where, "resolution is " + std::to_string(resolution), "permitted: 8 to 1000");
    if (!(thickness >= 0 && std::isfinite(thickness)))
        return bad_input(where, "thickness is " + text(thickness) + " m", "0: the mesh bounds a solid; else above 0");
    return {};
}

Result<SignedDistanceGrid> make_level_set(const TriMesh& mesh, const LevelSetSettings& settings,
                                          const std::string& where, std::vector<std::string>& io_warnings) {
    if (Status ok = settings.check(where); !ok) return ok.error();
    const MeshReport report = check_mesh(mesh);
    if (!report.is_usable())
        return bad_input(where, report.faults.empty() ? "the mesh has no triangles" : report.faults.front());
    std::optional<TriMesh> mended;
    if (settings.thickness == 0 && !report.is_solid()) {
        Result<TriMesh> made = solid(mesh, where, io_warnings);
        if (!made) return made.error();
        mended = made.take();
    }
    const MeshView view = mended ? *mended : mesh;

    SignedDistanceGrid grid;
    for (const Triangle& t : view.triangles)
        for (const uint32_t v : t) grid.bounds.extend(view.positions[v]);
    grid.bounds.min.array() -= 0.5 * settings.thickness;
    grid.bounds.max.array() += 0.5 * settings.thickness;
    const Vec3 side = grid.bounds.max - grid.bounds.min;
    grid.voxel_size = settings.voxel_size > 0 ? settings.voxel_size : side.maxCoeff() / settings.resolution;
    if (settings.thickness > 0 && settings.thickness < 2 * grid.voxel_size)
        return bad_input(where,
                         "a thickness of " + text(settings.thickness) + " m is less than two voxels of " +
                             text(grid.voxel_size) + " m",
                         "a voxel size of " + text(settings.thickness / 2) + " m fits");
    grid.nodes = nodes_for(side, grid.voxel_size);
    if (bytes_of(grid.nodes) > double(kMostLevelSetBytes))
        return bad_input(where,
                         "voxels of " + text(grid.voxel_size) + " m take " + text(bytes_of(grid.nodes) / 1048576) +
                             " MiB, " + std::to_string(kMostLevelSetBytes >> 20) + " MiB are permitted",
                         "a voxel size of " + text(fitting_voxel_size(side, grid.voxel_size)) + " m fits");
    for (int i = 0; i < 3; ++i)
        grid.origin[i] = 0.5 * (grid.bounds.min[i] + grid.bounds.max[i] - (grid.nodes[i] - 1) * grid.voxel_size);
    try {
        fill(grid, view, settings.thickness);
    } catch (const std::bad_alloc&) {
        return bad_input(where, "there is not enough memory for the collider", "larger voxels need less");
    } catch (const std::exception& e) {
        return bad_input(where, std::string("the mesh became no level set: ") + e.what());
    }
    if (Status ok = check_result(view, grid, settings.thickness, where, io_warnings); !ok) return ok.error();
    return grid;
}

double level_set_volume(const SignedDistanceGrid& grid) {
    const double h = grid.voxel_size;
    double voxels = 0;
    for (const float d : grid.distance) voxels += std::clamp(0.5 - d / h, 0.0, 1.0);
    return voxels * h * h * h;
}

}  // namespace sunder
