#include "fracture_tools/surface_normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "fracture_tools/disjoint_sets.h"

namespace sunder {
namespace {

constexpr double kOuterCreaseCosine = 0.5;  // 60 degrees
// Twice the area over the longest edge squared: below this, rounding and tessellation decide the normal of a triangle.
constexpr double kSliver = 1e-4;

struct FaceNormal {
    Vec3 normal;  // of length twice the area
    bool sliver;
};

FaceNormal face_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a;
    const Vec3 n = ab.cross(ac);
    const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
    return {n, !(n.norm() > kSliver * longest)};
}

double angle_between(const Vec3& u, const Vec3& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); }

// cof(linear) n, the way normals go; n itself where that vanishes (a flattened blend).
Vec3 turned(const Affine& skin, const Vec3& n) {
    const Mat3& A = skin.linear;
    Mat3 cofactor;
    cofactor.col(0) = A.col(1).cross(A.col(2));
    cofactor.col(1) = A.col(2).cross(A.col(0));
    cofactor.col(2) = A.col(0).cross(A.col(1));
    const Vec3 t = cofactor * n;
    const double length = t.norm();
    return length > 1e-12 ? Vec3(t / length) : n;
}

}  // namespace

SurfaceNormals::SurfaceNormals(const FragmentFaces& faces, std::span<const Vec3> rest_vertex,
                               std::vector<Vec3> rest_normals, std::span<const Vec3> interface_normals,
                               double interior_smooth_angle)
    : artist_normal_(std::move(rest_normals)) {
    find_rest_normals(faces, rest_vertex, interface_normals);
    find_smooth_corners(faces, std::cos(interior_smooth_angle * std::numbers::pi / 180));
    for (size_t c = 0; c < artist_normal_.size(); ++c) {
        const double length = artist_normal_[c].norm();
        artist_normal_[c] = length > 0.1 ? Vec3(artist_normal_[c] / length) : rest_normal_[c / 3];
    }
}

void SurfaceNormals::find_rest_normals(const FragmentFaces& faces, std::span<const Vec3> rest_vertex,
                                       std::span<const Vec3> interface_normals) {
    rest_normal_.resize(faces.n_faces());
    sliver_.resize(faces.n_faces());
    for (uint32_t f = 0; f < faces.n_faces(); ++f) {
        const Triangle& t = faces.triangles[f];
        const FaceNormal n = face_normal(rest_vertex[t[0]], rest_vertex[t[1]], rest_vertex[t[2]]);
        sliver_[f] = n.sliver;
        Vec3 fallback = Vec3::UnitZ();
        if (!faces.is_outer(f)) {
            const Vec3& mean = interface_normals[faces.interface[f]];
            if (mean.norm() > 0.1) fallback = faces.is_side_b(f) ? Vec3(-mean.normalized()) : mean.normalized();
        }
        rest_normal_[f] = n.sliver && (!faces.is_outer(f) || n.normal.norm() == 0) ? fallback : n.normal.normalized();
    }
}

void SurfaceNormals::find_smooth_corners(const FragmentFaces& faces, double interior_cosine) {
    struct Side {  // a face at one of its edges
        uint32_t low, high;
        uint32_t kind;  // 0 outer, else the break surface of which fragment
        uint32_t face;
    };
    std::vector<Side> sides;
    sides.reserve(3 * size_t{faces.n_faces()});
    for (uint32_t f = 0; f < faces.n_faces(); ++f)
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = faces.triangles[f][c], w = faces.triangles[f][(c + 1) % 3];
            const uint32_t kind = faces.is_outer(f) ? 0 : 1 + faces.fragment[f];
            sides.push_back({std::min(v, w), std::max(v, w), kind, f});
        }
    auto key = [](const Side& s) { return std::tuple(s.low, s.high, s.kind); };
    std::sort(sides.begin(), sides.end(), [&](const Side& x, const Side& y) {
        return std::tuple_cat(key(x), std::tuple(x.face)) < std::tuple_cat(key(y), std::tuple(y.face));
    });

    smooth_ = disjoint_sets(3 * size_t{faces.n_faces()});
    auto corner_at = [&](uint32_t f, uint32_t v) {
        const Triangle& t = faces.triangles[f];
        return 3 * f + (t[0] == v ? 0 : t[1] == v ? 1 : 2);
    };
    auto join = [&](uint32_t f, uint32_t g, uint32_t v) { unite(smooth_, corner_at(f, v), corner_at(g, v)); };
    for (size_t i = 0; i < sides.size(); ++i)
        for (size_t j = i + 1; j < sides.size() && key(sides[j]) == key(sides[i]); ++j) {
            const uint32_t f = sides[i].face, g = sides[j].face;
            const double limit = sides[i].kind == 0 ? kOuterCreaseCosine : interior_cosine;
            // Slivers go with what is beside them; across two interfaces they have the normals of these.
            const bool may_be_sliver = faces.interface[f] == faces.interface[g];
            if (!(may_be_sliver && (sliver_[f] || sliver_[g])) && rest_normal_[f].dot(rest_normal_[g]) < limit)
                continue;
            join(f, g, sides[i].low), join(f, g, sides[i].high);
        }
    for (uint32_t c = 0; c < smooth_.size(); ++c) smooth_[c] = lowest(smooth_, c);
}

void SurfaceNormals::bind(const SplitTopology& topology) {
    const auto face = topology.triangle_face();
    const auto triangles = topology.triangles();
    struct Corner {
        uint32_t vertex, smooth, index;
    };
    std::vector<Corner> corners(3 * triangles.size()), sorted(corners.size());
    // By visual vertex with a counting sort, then by smooth group among the few corners of one vertex.
    std::vector<uint32_t> offset(topology.n_vertices() + 1, 0);
    for (uint32_t t = 0; t < triangles.size(); ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            corners[3 * t + c] = {triangles[t][c], smooth_[3 * face[t] + c], 3 * t + c};
            ++offset[triangles[t][c] + 1];
        }
    std::partial_sum(offset.begin(), offset.end(), offset.begin());
    std::vector<uint32_t> next(offset.begin(), offset.end() - 1);
    for (const Corner& c : corners) sorted[next[c.vertex]++] = c;
    for (size_t v = 0; v + 1 < offset.size(); ++v)
        std::sort(sorted.begin() + offset[v], sorted.begin() + offset[v + 1], [](const Corner& x, const Corner& y) {
            return std::pair(x.smooth, x.index) < std::pair(y.smooth, y.index);
        });
    slot_.resize(corners.size());
    uint32_t n_slots = 0;
    for (size_t i = 0; i < sorted.size(); ++i) {
        if (i == 0 || sorted[i].vertex != sorted[i - 1].vertex || sorted[i].smooth != sorted[i - 1].smooth) ++n_slots;
        slot_[sorted[i].index] = n_slots - 1;
    }
    slot_normal_.resize(n_slots);
}

void SurfaceNormals::evaluate(const SplitTopology& topology, std::span<const Vec3> positions,
                              std::span<const Affine> skin, std::vector<Vec3f>& out) {
    const auto face = topology.triangle_face();
    const auto triangles = topology.triangles();
    std::fill(slot_normal_.begin(), slot_normal_.end(), Vec3::Zero());
    auto has_artist_normal = [&](uint32_t t) { return !artist_normal_.empty() && topology.faces().is_outer(face[t]); };

    for (size_t t = 0; t < triangles.size(); ++t) {
        // What is hidden has no say in how its neighbours at a rim are shaded.
        if (has_artist_normal(t) || sliver_[face[t]] || topology.triangle_hidden()[t]) continue;
        const auto [i, j, k] = triangles[t];
        const Vec3 &a = positions[i], &b = positions[j], &c = positions[k];
        const FaceNormal n = face_normal(a, b, c);
        if (n.sliver) continue;
        const Vec3 unit = n.normal.normalized();
        const double at_a = angle_between(b - a, c - a), at_b = angle_between(c - b, a - b);
        slot_normal_[slot_[3 * t]] += at_a * unit;
        slot_normal_[slot_[3 * t + 1]] += at_b * unit;
        slot_normal_[slot_[3 * t + 2]] += (std::numbers::pi - at_a - at_b) * unit;
    }
    for (Vec3& n : slot_normal_) {
        const double length = n.norm();
        n = length > 1e-6 ? Vec3(n / length) : Vec3::Zero();
    }

    out.resize(3 * triangles.size());
    for (size_t t = 0; t < triangles.size(); ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3& shared = slot_normal_[slot_[3 * t + c]];
            const uint32_t vertex = triangles[t][c];
            if (has_artist_normal(t))
                out[3 * t + c] = turned(skin[vertex], artist_normal_[3 * face[t] + c]).cast<float>();
            else if (shared.isZero(0))
                out[3 * t + c] = turned(skin[vertex], rest_normal_[face[t]]).cast<float>();
            else
                out[3 * t + c] = shared.cast<float>();
        }
}

}  // namespace sunder
