#include "fracture_tools/surface_normals.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <numeric>
#include <tuple>

#include "fracture_tools/disjoint_sets.h"

namespace sunder {
namespace {

constexpr double kOuterCreaseCosine = 0.5;  // 60 degrees

// CornerWeights as floats.
typedef float FourFloats __attribute__((vector_size(16), may_alias));
constexpr uint32_t kFloats = sizeof(CornerWeights) / sizeof(float);
constexpr uint32_t kAngle = offsetof(CornerWeights, angle) / sizeof(float);
static_assert(offsetof(CornerWeights, normal) == 0);

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

float length_of(const FourFloats& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// Shorter ones have vanished (a flattened blend).
constexpr float kShortest = 1e-12f;

// n turned the way normals go; n itself where its image vanishes.
Vec3 turned(const Mat3& linear, const Vec3& n) {
    Mat3 cofactor;
    for (int k = 0; k < 3; ++k) cofactor.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    const Vec3 image = cofactor * n;
    const double length = image.norm();
    return length > kShortest ? Vec3(image / length) : n;
}

}  // namespace

SurfaceNormals::SurfaceNormals(const SplitTopology& topology, std::span<const Vec3> rest_vertex,
                               std::span<const Vec3> rest_normals, std::span<const Vec3> interface_normals,
                               double interior_smooth_angle) {
    const FragmentFaces& faces = topology.faces();
    find_rest_normals(faces, rest_vertex, interface_normals);
    std::vector<uint32_t> smooth = find_smooth_corners(faces, std::cos(interior_smooth_angle * std::numbers::pi / 180));
    for (size_t c = 0; c < rest_normals.size(); ++c) {
        const double length = rest_normals[c].norm();
        artist_normal_.push_back((length > 0.1 ? Vec3(rest_normals[c] / length) : rest_normal_[c / 3]).cast<float>());
    }
    if (!artist_normal_.empty()) first_teller_ = faces.n_outer, find_equal_corners(faces, smooth);
    silent_ = sliver_;

    parts_.emplace(topology, smooth);
    for (uint32_t part = 0; part < parts_->n_parts(); ++part)
        part_artist_.push_back(parts_->smooth(part) < artist_normal_.size() ? artist_normal_[parts_->smooth(part)]
                                                                            : Vec3f::Zero());
    for (const uint32_t c : parts_->corners())
        part_angle_.push_back(c < 3 * first_teller_ ? 0 : kFloats * (c / 3 - first_teller_) + kAngle + c % 3);
    weights_.assign(faces.n_faces() - first_teller_, {}), teller_moved_.resize(weights_.size());
    slot_.reserve(3 * size_t{faces.n_faces()}), normal_.reserve(parts_->n_parts());
    normal_moved_.reserve(parts_->n_parts());
}

// Outer corners of one vertex with the same normal share it, whatever lies between them.
void SurfaceNormals::find_equal_corners(const FragmentFaces& faces, std::vector<uint32_t>& io_smooth) const {
    std::vector<uint32_t> offset(faces.n_vertices + 1, 0), corner(3 * size_t{faces.n_outer});
    for (uint32_t c = 0; c < corner.size(); ++c) ++offset[faces.triangles[c / 3][c % 3] + 1];
    std::partial_sum(offset.begin(), offset.end(), offset.begin());
    std::vector<uint32_t> next(offset.begin(), offset.end() - 1);
    for (uint32_t c = 0; c < corner.size(); ++c) corner[next[faces.triangles[c / 3][c % 3]]++] = c;
    for (uint32_t v = 0; v < faces.n_vertices; ++v)
        for (uint32_t i = offset[v]; i < offset[v + 1]; ++i) {
            uint32_t first = offset[v];
            while (artist_normal_[corner[first]] != artist_normal_[corner[i]]) ++first;
            io_smooth[corner[i]] = corner[first];
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

std::vector<uint32_t> SurfaceNormals::find_smooth_corners(const FragmentFaces& faces, double interior_cosine) const {
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

    std::vector<uint32_t> smooth = disjoint_sets(3 * size_t{faces.n_faces()});
    auto corner_at = [&](uint32_t f, uint32_t v) {
        const Triangle& t = faces.triangles[f];
        return 3 * f + (t[0] == v ? 0 : t[1] == v ? 1 : 2);
    };
    auto join = [&](uint32_t f, uint32_t g, uint32_t v) { unite(smooth, corner_at(f, v), corner_at(g, v)); };
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
    for (uint32_t c = 0; c < smooth.size(); ++c) smooth[c] = lowest(smooth, c);
    return smooth;
}

void SurfaceNormals::bind(const SplitTopology& topology, const RangeRunner& run) {
    parts_->update(topology, run);
    for (const uint32_t f : topology.flipped_faces()) {
        silent_[f] = sliver_[f] | topology.face_hidden()[f];
        if (f >= first_teller_) weights_[f - first_teller_] = {};
    }
    const auto face = topology.triangle_face();
    slot_.resize(3 * face.size()), normal_.resize(parts_->n_normals()), normal_moved_.resize(parts_->n_normals());
    run(face.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t t = begin; t < end; ++t)
            for (uint32_t c = 0; c < 3; ++c) slot_[3 * t + c] = parts_->normal_of(3 * face[t] + c);
    });
    chunk_changed_.assign((slot_.size() + kChunk - 1) / kChunk, 0);
}

SharedArray<Vec3f> SurfaceNormals::evaluate(const SplitTopology& topology, const SkinBinding& binding,
                                            const SkinMotion& motion, const RangeRunner& run) {
    const size_t n_triangles = topology.triangles().size();
    const size_t first = first_teller_;  // faces below it are all listed
    run(n_triangles - first, kGrain,
        [&](size_t begin, size_t end) { weigh_moved(topology, motion, first + begin, first + end); });
    run(normal_.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) {
            normal_moved_[n] = motion.all_moved() || touches_moved(n, motion);
            if (normal_moved_[n]) find_normal(n, motion);
        }
    });
    auto& slot = recycler_.take(slot_.size(), slot_.capacity());
    run(chunk_changed_.size(), 4, [&](size_t begin, size_t end) {
        for (size_t chunk = begin; chunk < end; ++chunk) {
            if (motion.all_moved() || any_moved(chunk)) chunk_changed_[chunk] = motion.frame();
            if (chunk_changed_[chunk] > slot.written) list(chunk, topology, binding, motion, slot.object->data());
        }
    });
    slot.written = motion.frame();
    return recycler_.share(slot);
}

void SurfaceNormals::weigh_moved(const SplitTopology& topology, const SkinMotion& motion, size_t begin, size_t end) {
    const std::span<const Triangle> triangles = topology.triangles();
    const auto face = topology.triangle_face();
    const auto weigh = [&](size_t from, size_t to) {
        if (from < to)
            weigh_corners(triangles, face, silent_, motion.positions(), from, to, first_teller_, weights_.data());
    };
    if (motion.all_moved()) return weigh(begin, end);
    const auto moved = motion.moved();
    size_t still = begin;  // those before it are done
    for (size_t t = begin; t < end; ++t) {
        const auto& [i, j, l] = triangles[t];
        uint8_t& is_moved = teller_moved_[face[t] - first_teller_];
        is_moved = moved[i] | moved[j] | moved[l];
        if (is_moved) continue;
        weigh(still, t);
        still = t + 1;
    }
    weigh(still, end);
}

bool SurfaceNormals::touches_moved(size_t normal, const SkinMotion& motion) const {
    const uint32_t leader = parts_->leader(normal);
    if (motion.moved()[parts_->visual_vertex(normal)]) return true;
    if (!part_artist_[leader].isZero(0)) return false;
    for (uint32_t p = leader; p != NormalParts::kNone; p = parts_->next(p))
        for (const uint32_t angle : angles_of(p))
            if (teller_moved_[angle / kFloats]) return true;
    return false;
}

void SurfaceNormals::find_normal(size_t normal, const SkinMotion& motion) {
    const uint32_t leader = parts_->leader(normal);
    const Vec3f& artist = part_artist_[leader];
    FourFloats& out = reinterpret_cast<FourFloats&>(normal_[normal]);
    if (!artist.isZero(0)) {
        const NormalMap& map = motion.normal_maps()[parts_->visual_vertex(normal)];
        const auto column = [&](int k) { return *reinterpret_cast<const FourFloats*>(map.column[k]); };
        const FourFloats n = column(0) * artist.x() + column(1) * artist.y() + column(2) * artist.z();
        const float length = length_of(n);
        out = length > kShortest ? n / length : FourFloats{artist.x(), artist.y(), artist.z(), 0};
        out[3] = 0;
        return;
    }
    const float* weights = reinterpret_cast<const float*>(weights_.data());
    FourFloats sum = {};
    for (uint32_t p = leader; p != NormalParts::kNone; p = parts_->next(p))
        for (const uint32_t angle : angles_of(p)) {
            const float* of_face = weights + angle / kFloats * kFloats;
            sum += weights[angle] * *reinterpret_cast<const FourFloats*>(of_face);
        }
    const float length = length_of(sum);
    out = length > 1e-6f ? sum / length : FourFloats{0, 0, 0, 1};
}

bool SurfaceNormals::any_moved(size_t chunk) const {
    const size_t end = std::min(slot_.size(), (chunk + 1) * kChunk);
    for (size_t c = chunk * kChunk; c < end; ++c)
        if (normal_moved_[slot_[c]]) return true;
    return false;
}

void SurfaceNormals::list(size_t chunk, const SplitTopology& topology, const SkinBinding& binding,
                          const SkinMotion& motion, Vec3f* out) const {
    const size_t begin = chunk * kChunk, end = std::min(slot_.size(), begin + kChunk);
    FourFloats sum = {};
    for (size_t c = begin; c + 1 < end; ++c) {  // the fourth number is written over by the next corner
        const FourFloats n = reinterpret_cast<const FourFloats&>(normal_[slot_[c]]);
        std::memcpy(out[c].data(), &n, sizeof(n));
        sum += n;
    }
    const Normal& last = normal_[slot_[end - 1]];
    out[end - 1] = last.unit;
    if (sum[3] + last.unsaid == 0) return;
    for (size_t c = begin; c < end; ++c) {
        if (normal_[slot_[c]].unsaid == 0) continue;
        const Mat3 linear = motion.linear_at(binding, topology.triangles()[c / 3][c % 3]);
        out[c] = turned(linear, rest_normal_[topology.triangle_face()[c / 3]]).cast<float>();
    }
}

}  // namespace sunder
