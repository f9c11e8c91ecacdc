// A strip one fragment thick that is bent as told: what the skin makes of it, against the bend itself.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "fracture_tools/skin/skinning.h"
#include "tests/fracture_tools/voronoi/voronoi_body.h"

namespace sunder::testing {

constexpr double kStripLength = 16;  // m; fragments are about 1 m wide
constexpr int kPerMetre = 8;         // vertices of the skin

/// A closed strip around the x axis, length x width x thickness, its two faces alike.
inline TriMesh strip_mesh(int width, double thickness) {
    TriMesh mesh;
    const int n = int(kStripLength) * kPerMetre, m = width * kPerMetre;
    for (const double side : {0.5, -0.5})
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= n; ++i)
                mesh.positions.push_back(
                    {(double(i) / n - 0.5) * kStripLength, (double(j) / m - 0.5) * width, side * thickness});
    const auto v = [&](int i, int j, int side) { return uint32_t((side * (m + 1) + j) * (n + 1) + i); };
    const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
    };
    for (int j = 0; j < m; ++j)
        for (int i = 0; i < n; ++i) {
            quad(v(i, j, 0), v(i + 1, j, 0), v(i + 1, j + 1, 0), v(i, j + 1, 0));
            quad(v(i, j, 1), v(i, j + 1, 1), v(i + 1, j + 1, 1), v(i + 1, j, 1));
        }
    for (int i = 0; i < n; ++i) {
        quad(v(i, 0, 1), v(i + 1, 0, 1), v(i + 1, 0, 0), v(i, 0, 0));
        quad(v(i + 1, m, 1), v(i, m, 1), v(i, m, 0), v(i + 1, m, 0));
    }
    for (int j = 0; j < m; ++j) {
        quad(v(0, j + 1, 1), v(0, j, 1), v(0, j, 0), v(0, j + 1, 0));
        quad(v(n, j, 1), v(n, j + 1, 1), v(n, j + 1, 0), v(n, j, 0));
    }
    return mesh;
}

/// `width` in metres. Cells of one metre, whose walls lie halfway between vertices, or as many Voronoi cells.
inline VoronoiBody strip_body(int width, double thickness, bool is_lattice) {
    PrefractureSettings s;
    s.seed = 3;
    if (is_lattice) {
        s.sites.kind = SiteKind::points;
        const double first = 0.5 + 0.5 / kPerMetre;
        for (double x = first - kStripLength / 2; x < kStripLength / 2; ++x)
            for (int y = 0; y < width; ++y)
                s.sites.points.push_back({x, y + (width > 1 ? first : 0.5) - 0.5 * width, 0});
    }
    VoronoiBody body(strip_mesh(width, thickness), int(kStripLength) * width, s);
    if (is_lattice) {  // a cube has no principal axes of its own
        std::ranges::fill(body.rest.rest_orientation, Quat::Identity());
        std::ranges::fill(body.rest.radii, Vec3(0.5, 0.5, thickness / 2));
        body.orientation = body.rest.rest_orientation;
    }
    return body;
}

/// A middle line that turns evenly by `angle` (rad) over `length` (m) about x = `middle`, and is straight elsewhere.
struct Bend {
    double angle, length, middle = 0;

    double turn(double x) const { return angle * std::clamp((x - middle) / length + 0.5, 0.0, 1.0); }
    double curvature() const { return angle / length; }
    Vec3 axis_at(double x) const {  // of the middle line
        const double s = std::clamp(x - middle + length / 2, 0.0, length), k = curvature();
        const double before = std::min(x - middle + length / 2, 0.0), after = std::max(x - middle - length / 2, 0.0);
        return {before + std::sin(k * s) / k + after * std::cos(angle), 0,
                (1 - std::cos(k * s)) / k + after * std::sin(angle)};
    }
    Quat rotation(double x) const { return Quat(Eigen::AngleAxisd(turn(x), -Vec3::UnitY())); }
    Vec3 place(const Vec3& rest) const {
        return axis_at(rest.x()) + Vec3(0, rest.y(), 0) + rotation(rest.x()) * Vec3(0, 0, rest.z());
    }
};

inline void pose(VoronoiBody& io_body, const Bend& bend) {
    for (size_t i = 0; i < io_body.position.size(); ++i) {
        io_body.position[i] = bend.place(io_body.rest.rest_position[i]);
        io_body.orientation[i] = bend.rotation(io_body.rest.rest_position[i].x()) * io_body.rest.rest_orientation[i];
    }
}

/// What is seen of a strip.
struct StripLooks {
    double least_gap = 1, most_gap = 1;  // of a vertex from the one across, over the thickness
    double least_thickness = 1;          // the same along the normal there
    int n_pairs = 0, n_over = 0, n_faces = 0;
    double worst_fold = 0, rms_fold = 0;  // of neighbouring faces beyond those of the bend, degrees
    double worst_place = 0;               // of a vertex from where the bend takes it, m
};

inline StripLooks look_at(const VisualMesh& mesh, const Bend& bend, double thickness) {
    StripLooks looks;
    const size_t n = mesh.positions.size();
    std::vector<Vec3> x(n), rest(n), normal(n, Vec3::Zero());
    std::map<std::array<long, 2>, std::array<uint32_t, 2>> pairs;
    for (uint32_t v = 0; v < n; ++v) {
        x[v] = mesh.positions[v].cast<double>();
        rest[v] = mesh.skin->rest_position(v);
        looks.worst_place = std::max(looks.worst_place, (x[v] - bend.place(rest[v])).norm());
        const std::array<long, 2> key = {std::lround(rest[v].x() * 1e5), std::lround(rest[v].y() * 1e5)};
        if (std::abs(std::abs(rest[v].z()) - thickness / 2) < 1e-9)
            pairs.try_emplace(key, std::array{kNone, kNone}).first->second[rest[v].z() > 0] = v;
    }
    const auto face_normal = [](const std::vector<Vec3>& p, const Triangle& t) {
        return Vec3((p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]));
    };
    std::map<std::array<uint32_t, 2>, size_t> sides;
    double sum = 0;
    int n_folds = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& f = mesh.triangles[t];
        if (std::abs(face_normal(rest, f).normalized().z()) < 0.9) continue;
        const Vec3 now = face_normal(x, f), was = face_normal(rest, f);
        const double at = (rest[f[0]].x() + rest[f[1]].x() + rest[f[2]].x()) / 3;
        if (was.norm() < 0.3 / (kPerMetre * kPerMetre)) continue;  // cut smaller by a wall
        ++looks.n_faces;
        looks.n_over += now.dot(bend.rotation(at) * was) <= 0;
        for (uint32_t c = 0; c < 3; ++c) {
            normal[f[c]] += now * (was.z() > 0 ? 1 : -1);
            const uint32_t a = f[c], b = f[(c + 1) % 3];
            const auto [other, fresh] = sides.try_emplace({std::min(a, b), std::max(a, b)}, t);
            if (fresh) continue;
            const Triangle& g = mesh.triangles[other->second];
            const double there = (rest[g[0]].x() + rest[g[1]].x() + rest[g[2]].x()) / 3;
            const Vec3 m = bend.rotation(at).conjugate() * now.normalized();
            const Vec3 o = bend.rotation(there).conjugate() * face_normal(x, g).normalized();
            const double fold = std::atan2(m.cross(o).norm(), m.dot(o)) * 180 / std::numbers::pi;
            looks.worst_fold = std::max(looks.worst_fold, fold), sum += fold * fold, ++n_folds;
        }
    }
    looks.rms_fold = std::sqrt(sum / n_folds);
    for (const auto& [key, pair] : pairs) {
        if (pair[0] == kNone || pair[1] == kNone) continue;
        const Vec3 gap = x[pair[1]] - x[pair[0]];
        ++looks.n_pairs;
        looks.least_gap = std::min(looks.least_gap, gap.norm() / thickness);
        looks.most_gap = std::max(looks.most_gap, gap.norm() / thickness);
        if (normal[pair[0]].isZero() || normal[pair[1]].isZero()) continue;
        const Vec3 across = (normal[pair[0]] + normal[pair[1]]).normalized();
        looks.least_thickness = std::min(looks.least_thickness, gap.dot(across) / thickness);
    }
    return looks;
}

}  // namespace sunder::testing
