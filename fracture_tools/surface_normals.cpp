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

// n turned the way normals go; n itself where its image vanishes (a flattened blend).
template <class Vector>
Vector unit_or(const Vector& turned, const Vector& n) {
    const auto length = turned.norm();
    return length > 1e-12f ? Vector(turned / length) : n;
}

Vec3f turned(const NormalMap& map, const Vec3f& n) {
    Vec3f t;
    for (int i = 0; i < 3; ++i) t[i] = map.column[0][i] * n.x() + map.column[1][i] * n.y() + map.column[2][i] * n.z();
    return unit_or(t, n);
}

Vec3 turned(const Mat3& linear, const Vec3& n) {
    Mat3 cofactor;
    for (int k = 0; k < 3; ++k) cofactor.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    return unit_or(Vec3(cofactor * n), n);
}

}  // namespace

SurfaceNormals::SurfaceNormals(const SplitTopology& topology, std::span<const Vec3> rest_vertex,
                               std::span<const Vec3> rest_normals, std::span<const Vec3> interface_normals,
                               double interior_smooth_angle) {
    const FragmentFaces& faces = topology.faces();
    find_rest_normals(faces, rest_vertex, interface_normals);
    find_smooth_corners(faces, std::cos(interior_smooth_angle * std::numbers::pi / 180));
    for (size_t c = 0; c < rest_normals.size(); ++c) {
        const double length = rest_normals[c].norm();
        artist_normal_.push_back((length > 0.1 ? Vec3(rest_normals[c] / length) : rest_normal_[c / 3]).cast<float>());
    }
    if (!artist_normal_.empty()) find_equal_corners(faces);
    number_parts(topology);
}

// Outer corners of one vertex with the same normal share it, whatever lies between them.
void SurfaceNormals::find_equal_corners(const FragmentFaces& faces) {
    std::vector<uint32_t> offset(faces.n_vertices + 1, 0), corner(3 * size_t{faces.n_outer});
    for (uint32_t c = 0; c < corner.size(); ++c) ++offset[faces.triangles[c / 3][c % 3] + 1];
    std::partial_sum(offset.begin(), offset.end(), offset.begin());
    std::vector<uint32_t> next(offset.begin(), offset.end() - 1);
    for (uint32_t c = 0; c < corner.size(); ++c) corner[next[faces.triangles[c / 3][c % 3]]++] = c;
    for (uint32_t v = 0; v < faces.n_vertices; ++v)
        for (uint32_t i = offset[v]; i < offset[v + 1]; ++i) {
            uint32_t first = offset[v];
            while (artist_normal_[corner[first]] != artist_normal_[corner[i]]) ++first;
            smooth_[corner[i]] = corner[first];
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

void SurfaceNormals::number_parts(const SplitTopology& topology) {
    const uint32_t n_corners = static_cast<uint32_t>(smooth_.size());
    const auto key = [&](uint32_t c) { return std::pair(topology.corner_fan(c), smooth_[c]); };
    part_corner_.resize(n_corners);  // by fan with a counting sort, then among the few corners of one fan
    std::vector<uint32_t> fan_offset(topology.n_fans() + 1, 0);
    for (uint32_t c = 0; c < n_corners; ++c) ++fan_offset[topology.corner_fan(c) + 1];
    std::partial_sum(fan_offset.begin(), fan_offset.end(), fan_offset.begin());
    std::vector<uint32_t> next(fan_offset.begin(), fan_offset.end() - 1);
    for (uint32_t c = 0; c < n_corners; ++c) part_corner_[next[topology.corner_fan(c)]++] = c;
    for (size_t f = 0; f + 1 < fan_offset.size(); ++f)
        std::sort(part_corner_.begin() + fan_offset[f], part_corner_.begin() + fan_offset[f + 1],
                  [&](uint32_t x, uint32_t y) { return std::pair(smooth_[x], x) < std::pair(smooth_[y], y); });
    corner_part_.resize(n_corners);
    vertex_part_.assign(topology.faces().n_vertices + 1, 0);
    for (uint32_t i = 0; i < n_corners; ++i) {
        const uint32_t c = part_corner_[i], fan = topology.corner_fan(c);
        if (i == 0 || key(c) != key(part_corner_[i - 1])) {
            part_fan_.push_back(fan), part_offset_.push_back(i);
            part_artist_.push_back(c < artist_normal_.size() ? artist_normal_[smooth_[c]] : Vec3f::Zero());
            ++vertex_part_[topology.fan_pool_vertex(fan) + 1];
        }
        corner_part_[c] = static_cast<uint32_t>(part_fan_.size() - 1);
    }
    part_offset_.push_back(n_corners);
    std::partial_sum(vertex_part_.begin(), vertex_part_.end(), vertex_part_.begin());
    const size_t n_parts = part_fan_.size();
    leader_.resize(n_parts), next_.resize(n_parts), part_vertex_.resize(n_parts);
    part_normal_.assign(n_parts, Vec3f::Zero()), part_moved_.assign(n_parts, 0);
}

void SurfaceNormals::join_parts_around(uint32_t pool_vertex, const SplitTopology& topology) {
    const auto smooth = [&](uint32_t part) { return smooth_[part_corner_[part_offset_[part]]]; };
    const uint32_t begin = vertex_part_[pool_vertex], end = vertex_part_[pool_vertex + 1];
    for (uint32_t part = begin; part < end; ++part) {
        leader_[part] = part, next_[part] = SplitTopology::kNone;
        for (uint32_t before = part; before-- > begin;)
            if (smooth(before) == smooth(part) &&
                topology.fan_class(part_fan_[before]) == topology.fan_class(part_fan_[part])) {
                leader_[part] = leader_[before], next_[before] = part;
                break;
            }
    }
}

void SurfaceNormals::bind(const SplitTopology& topology, const RangeRunner& run) {
    for (const uint32_t v : topology.changed_vertices()) join_parts_around(v, topology);
    const auto face = topology.triangle_face();
    const auto hidden = topology.triangle_hidden();
    // What is hidden has no say in how its neighbours at a rim are shaded.
    face_teller_.assign(topology.faces().n_faces(), SplitTopology::kNone);
    teller_.clear();
    for (uint32_t t = 0; t < face.size(); ++t) {
        if (sliver_[face[t]] || hidden[t] || (!artist_normal_.empty() && topology.faces().is_outer(face[t]))) continue;
        face_teller_[face[t]] = static_cast<uint32_t>(teller_.size());
        teller_.push_back(t);
    }
    weights_.resize(teller_.size()), teller_moved_.resize(teller_.size());

    slot_.resize(3 * face.size());
    run(face.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t t = begin; t < end; ++t)
            for (uint32_t c = 0; c < 3; ++c) slot_[3 * t + c] = leader_[corner_part_[3 * face[t] + c]];
    });
    run(part_fan_.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t p = begin; p < end; ++p)
            part_vertex_[p] = leader_[p] == p ? topology.vertex_of_fan(part_fan_[p]) : SplitTopology::kNone;
    });
    chunk_changed_.assign((slot_.size() + kChunk - 1) / kChunk, 0);
}

SharedArray<Vec3f> SurfaceNormals::evaluate(const SplitTopology& topology, const SkinBinding& binding,
                                            const SkinMotion& motion, const RangeRunner& run) {
    const auto triangles = topology.triangles();
    const std::span<const uint8_t> moved = motion.moved();
    run(teller_.size(), kGrain, [&](size_t begin, size_t end) {
        if (motion.all_moved()) {
            std::fill(teller_moved_.begin() + begin, teller_moved_.begin() + end, 1);
            weigh_corners(triangles, teller_, motion.positions(), begin, end, weights_.data());
            return;
        }
        for (size_t k = begin; k < end; ++k) {
            const auto& [i, j, l] = triangles[teller_[k]];
            teller_moved_[k] = moved[i] | moved[j] | moved[l];
        }
        for (size_t k = begin; k < end;) {  // runs of moved ones
            size_t stop = k;
            while (stop < end && teller_moved_[stop]) ++stop;
            if (stop > k) weigh_corners(triangles, teller_, motion.positions(), k, stop, weights_.data());
            k = stop + 1;
        }
    });
    run(part_fan_.size(), kGrain, [&](size_t begin, size_t end) {
        for (uint32_t p = static_cast<uint32_t>(begin); p < end; ++p) {
            if (part_vertex_[p] == SplitTopology::kNone) continue;
            part_moved_[p] = motion.all_moved() || touches_moved(p, motion);
            if (part_moved_[p]) find_normal(p, motion);
        }
    });
    auto& slot = recycler_.take(slot_.size());
    run(chunk_changed_.size(), 4, [&](size_t begin, size_t end) {
        for (size_t chunk = begin; chunk < end; ++chunk) {
            if (motion.all_moved() || any_moved(chunk)) chunk_changed_[chunk] = motion.frame();
            if (chunk_changed_[chunk] > slot.written) list(chunk, topology, binding, motion, slot.object->data());
        }
    });
    slot.written = motion.frame();
    return recycler_.share(slot);
}

bool SurfaceNormals::touches_moved(uint32_t leader, const SkinMotion& motion) const {
    if (motion.moved()[part_vertex_[leader]]) return true;
    if (!part_artist_[leader].isZero(0)) return false;
    for (uint32_t p = leader; p != SplitTopology::kNone; p = next_[p])
        for (uint32_t i = part_offset_[p]; i < part_offset_[p + 1]; ++i) {
            const uint32_t teller = face_teller_[part_corner_[i] / 3];
            if (teller != SplitTopology::kNone && teller_moved_[teller]) return true;
        }
    return false;
}

void SurfaceNormals::find_normal(uint32_t leader, const SkinMotion& motion) {
    if (const Vec3f& artist = part_artist_[leader]; !artist.isZero(0)) {
        part_normal_[leader] = turned(motion.normal_maps()[part_vertex_[leader]], artist);
        return;
    }
    Vec3f sum = Vec3f::Zero();
    for (uint32_t p = leader; p != SplitTopology::kNone; p = next_[p])
        for (uint32_t i = part_offset_[p]; i < part_offset_[p + 1]; ++i) {
            const uint32_t c = part_corner_[i], teller = face_teller_[c / 3];
            if (teller != SplitTopology::kNone) sum += weights_[teller].angle[c % 3] * weights_[teller].normal;
        }
    const float length = sum.norm();
    part_normal_[leader] = length > 1e-6f ? Vec3f(sum / length) : Vec3f::Zero();
}

bool SurfaceNormals::any_moved(size_t chunk) const {
    const size_t end = std::min(slot_.size(), (chunk + 1) * kChunk);
    for (size_t c = chunk * kChunk; c < end; ++c)
        if (part_moved_[slot_[c]]) return true;
    return false;
}

void SurfaceNormals::list(size_t chunk, const SplitTopology& topology, const SkinBinding& binding,
                          const SkinMotion& motion, Vec3f* out) const {
    const size_t end = std::min(slot_.size(), (chunk + 1) * kChunk);
    for (size_t c = chunk * kChunk; c < end; ++c) {
        const Vec3f& shared = part_normal_[slot_[c]];
        out[c] = shared;
        if (!shared.isZero(0)) continue;
        const Mat3 linear = motion.linear_at(binding, topology.triangles()[c / 3][c % 3]);
        out[c] = turned(linear, rest_normal_[topology.triangle_face()[c / 3]]).cast<float>();
    }
}

}  // namespace sunder
