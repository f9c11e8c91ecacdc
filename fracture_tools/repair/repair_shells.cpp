#include "fracture_tools/repair/repair_shells.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/shells.h"
#include "fracture_tools/repair/repair_holes.h"
#include "fracture_tools/repair/repair_surface.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// A shell has a volume if it is more than this share of its area to the power of 1.5.
constexpr double kFlat = 1e-12;
/// An artist wound a shell if more than this share of its area faces one way.
constexpr double kAgreement = 0.75;
/// Winding numbers are whole but for points on the surface.
constexpr double kNearWhole = 0.1;

struct Shell {
    std::vector<uint32_t> triangles;
    Aabb box;
    double volume = 0, area = 0;   // signed as it is now, m3; m2
    int facing = 0;                // as the artist has it: 1 outward, -1 inward, 0 this way and that
    std::vector<uint32_t> around;  // shells that it is within without crossing them
    bool is_flat() const { return std::abs(volume) <= kFlat * area * std::sqrt(area); }
};

std::vector<Shell> measure_shells(const TriMesh& mesh, std::span<const Sense> sense) {
    const Shells parts = find_shells(mesh);
    std::vector<Shell> shells(parts.n);
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) shells[parts.of_triangle[t]].triangles.push_back(t);
    for (Shell& s : shells) {
        double same = 0, judged = 0;
        for (uint32_t t : s.triangles)
            for (uint32_t v : mesh.triangles[t]) s.box.extend(mesh.positions[v]);
        const Vec3 middle = 0.5 * (s.box.min + s.box.max);
        for (uint32_t t : s.triangles) {
            const auto& [a, b, c] = mesh.triangles[t];
            const Vec3 n = 0.5 * (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
            s.volume += (mesh.positions[a] - middle).dot(n) / 3;
            s.area += n.norm();
            const Sense facing = sense.empty() ? Sense::same : sense[t];
            if (facing != Sense::none) judged += n.norm();
            if (facing == Sense::same) same += n.norm();
        }
        const int outward = s.volume > 0 ? 1 : -1;
        if (same > kAgreement * judged) s.facing = outward;
        if (judged - same > kAgreement * judged) s.facing = -outward;
    }
    return shells;
}

/// How often a shell goes round a point (van Oosterom & Strackee 1983), or nothing for a point on it.
std::optional<int> winding(const TriMesh& mesh, const Shell& shell, const Vec3& p) {
    double sum = 0;
    for (uint32_t t : shell.triangles) {
        const Vec3 a = mesh.positions[mesh.triangles[t][0]] - p, b = mesh.positions[mesh.triangles[t][1]] - p,
                   c = mesh.positions[mesh.triangles[t][2]] - p;
        const double x = a.norm(), y = b.norm(), z = c.norm();
        sum += 2 * math::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
    }
    const double turns = sum / (4 * std::numbers::pi), whole = std::round(turns);
    return std::abs(turns - whole) < kNearWhole ? std::optional(int(whole)) : std::nullopt;
}

bool is_within(const TriMesh& mesh, const Shell& inner, const Shell& outer) {
    if ((inner.box.min.array() < outer.box.min.array()).any() || (inner.box.max.array() > outer.box.max.array()).any())
        return false;
    constexpr size_t kMostTries = 16;  // shells that touch share points, but not all of them
    const size_t stride = std::max<size_t>(1, inner.triangles.size() / kMostTries);
    for (size_t k = 0; k < inner.triangles.size(); k += stride) {
        const auto& [a, b, c] = mesh.triangles[inner.triangles[k]];
        const Vec3 middle = (mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3;
        if (const auto turns = winding(mesh, outer, middle)) return *turns != 0;
    }
    return false;
}

std::set<std::array<uint32_t, 2>> crossing_shells(const Shells& parts,
                                                  std::span<const std::array<uint32_t, 2>> crossing) {
    std::set<std::array<uint32_t, 2>> pairs;
    for (const auto& [t, u] : crossing) {
        const auto [a, b] = std::minmax(parts.of_triangle[t], parts.of_triangle[u]);
        if (a != b) pairs.insert({a, b});
    }
    return pairs;
}

/// Fills what is around each shell, the smallest first. Gives the order from the largest to the smallest.
std::vector<uint32_t> find_surroundings(const TriMesh& mesh, const std::set<std::array<uint32_t, 2>>& crossing,
                                        std::vector<Shell>& io_shells) {
    std::vector<uint32_t> order(io_shells.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t x, uint32_t y) {
        return std::abs(io_shells[x].volume) > std::abs(io_shells[y].volume);
    });
    for (size_t i = 0; i < order.size(); ++i)
        for (size_t j = i; j-- > 0;) {
            const uint32_t inner = order[i], outer = order[j];
            if (crossing.contains({std::min(inner, outer), std::max(inner, outer)})) continue;
            if (is_within(mesh, io_shells[inner], io_shells[outer])) io_shells[inner].around.push_back(outer);
        }
    return order;
}

}  // namespace

ShellReport arrange_shells(TriMesh& io_mesh, std::span<const Sense> sense,
                           std::span<const std::array<uint32_t, 2>> crossing) {
    std::vector<Shell> shells = measure_shells(io_mesh, sense);
    const std::set<std::array<uint32_t, 2>> pairs = crossing_shells(find_shells(io_mesh), crossing);
    const std::vector<uint32_t> order = find_surroundings(io_mesh, pairs, shells);
    std::vector<uint32_t> group = disjoint_sets(shells.size());
    for (const auto& [a, b] : pairs) unite(group, a, b);

    std::vector<int> facing(shells.size(), 0);             // 1 outward, -1 inward, 0 without volume
    std::vector<uint8_t> is_inside_out(shells.size(), 0);  // it and what is in it
    std::vector<int> n_inward(shells.size(), 0);           // of each group
    for (uint32_t s : order) {                             // what is around a shell comes before it
        const Shell& shell = shells[s];
        if (!shell.around.empty()) is_inside_out[s] = is_inside_out[shell.around.front()];
        if (shell.is_flat()) continue;
        int filled = 0;
        for (uint32_t outer : shell.around) filled += facing[outer];
        facing[s] = is_inside_out[s] ? -shell.facing : shell.facing;
        if (facing[s] < 0 && filled <= 0) {
            is_inside_out[s] = !is_inside_out[s];
            facing[s] = 1;
        }
        if (facing[s] == 0) facing[s] = filled > 0 ? -1 : 1;
        n_inward[lowest(group, s)] += facing[s] < 0;
    }

    std::vector<uint8_t> mark(io_mesh.triangles.size(), 1);
    ShellReport report{.n_shells = shells.size()};
    for (uint32_t s : order) {
        const Shell& shell = shells[s];
        const Vec3 at = io_mesh.positions[io_mesh.triangles[shell.triangles[0]][0]];
        auto drop = [&] {
            for (uint32_t t : shell.triangles) mark[t] = 0;
        };
        if (shell.is_flat()) {
            if (report.flat++ == 0) report.first_flat = at;
            drop();
            continue;
        }
        // What goes round a group goes round each of its shells; within, space is emptied at most as often as shells
        // of the group face inward.
        int filled = 0;
        for (uint32_t outer : shell.around)
            if (lowest(group, outer) != lowest(group, s)) filled += facing[outer];
        if (filled > n_inward[lowest(group, s)]) {
            if (report.buried++ == 0) report.first_buried = at;
            drop();
            continue;
        }
        report.cavities += facing[s] < 0;
        report.turned += facing[s] != shell.facing;
        if ((shell.volume > 0) != (facing[s] > 0))
            for (uint32_t t : shell.triangles) turn_triangle(io_mesh, t);
    }
    if (report.buried + report.flat > 0) keep_marked(io_mesh, mark);
    return report;
}

std::vector<std::vector<uint32_t>> surrounding_shells(const TriMesh& mesh,
                                                      std::span<const std::array<uint32_t, 2>> crossing) {
    std::vector<Shell> shells = measure_shells(mesh, {});
    find_surroundings(mesh, crossing_shells(find_shells(mesh), crossing), shells);
    std::vector<std::vector<uint32_t>> around;
    for (Shell& s : shells) around.push_back(std::move(s.around));
    return around;
}

std::vector<uint8_t> find_buried_sheets(const TriMesh& mesh, std::span<const Sense> sense,
                                        std::span<const uint8_t> is_sheet) {
    std::vector<uint8_t> is_buried(is_sheet.size(), 0), mark;
    const Shells parts = find_shells(mesh);
    std::vector<std::vector<uint32_t>> sheets(is_sheet.size());
    TriMesh solid = mesh;
    std::vector<Sense> solid_sense;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        mark.push_back(!is_sheet[parts.of_triangle[t]]);
        if (mark.back())
            solid_sense.push_back(sense[t]);
        else
            sheets[parts.of_triangle[t]].push_back(t);
    }
    if (solid_sense.empty()) return is_buried;
    keep_marked(solid, mark);
    if (!close_borders(solid, find_borders(solid), {})) return is_buried;
    solid_sense.resize(solid.triangles.size(), Sense::none);
    arrange_shells(solid, solid_sense, crossing_triangles(solid));
    const std::vector<Shell> shells = measure_shells(solid, {});
    /// Above 0 in solid matter; nothing on its surface.
    const auto filled = [&](const Vec3& p) {
        std::optional<int> sum = 0;
        for (const Shell& shell : shells) {
            if (((p - shell.box.min).array() < 0).any() || ((shell.box.max - p).array() < 0).any()) continue;
            const std::optional<int> turns = winding(solid, shell, p);
            sum = sum && turns ? std::optional(*sum + *turns) : std::nullopt;
        }
        return sum;
    };
    const size_t most = std::max<size_t>(16, kMostWindings / solid.triangles.size());
    for (uint32_t s = 0; s < sheets.size(); ++s) {
        const size_t stride = sheets[s].size() / most + 1;
        size_t n_in = 0, n_out = 0;
        for (size_t k = 0; k < sheets[s].size(); k += stride) {
            const auto& [a, b, c] = mesh.triangles[sheets[s][k]];
            const auto depth = filled((mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3);
            n_in += depth && *depth > 0, n_out += depth && *depth <= 0;
        }
        is_buried[s] = n_in > 0 && n_out == 0;
    }
    return is_buried;
}

}  // namespace sunder
