#include "fracture_tools/surface_normals.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>

#include "fracture_tools/counting_sort.h"
#include "fracture_tools/disjoint_sets.h"
#include "fracture_tools/vector_clones.h"

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

// In all four lanes.
inline FourFloats length_of(const FourFloats& v) {
    typedef int Order __attribute__((vector_size(16)));
    const FourFloats s = v * v;
    const FourFloats squared = __builtin_shuffle(s, Order{0, 0, 0, 0}) + __builtin_shuffle(s, Order{1, 1, 1, 1}) +
                               __builtin_shuffle(s, Order{2, 2, 2, 2});
    FourFloats length;
    for (int i = 0; i < 4; ++i) length[i] = std::sqrt(squared[i]);
    return length;
}

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

// Normals [begin, end): the artist's, turned by the map of their vertex; or the sum of what faces tell, part after
// part. Whether some are told by none.
SUNDER_VECTOR_CLONES bool find_normals(const NormalParts& parts, std::span<const Vec3f> part_artist,
                                       std::span<const uint32_t> part_angle, std::span<const NormalMap> normal_map,
                                       std::span<const CornerWeights> corner_weights, size_t begin, size_t end,
                                       CornerNormal* out) {
    const auto leader = parts.leader(), vertex = parts.visual_vertex(), next = parts.next(), offset = parts.offset();
    const float* weights = reinterpret_cast<const float*>(corner_weights.data());
    bool any_unsaid = false;
    for (size_t n = begin; n < end; ++n) {
        FourFloats& normal = reinterpret_cast<FourFloats&>(out[leader[n]]);
        const Vec3f& artist = part_artist[leader[n]];
        if (artist.x() != 0 || artist.y() != 0 || artist.z() != 0) {
            const FourFloats* column = reinterpret_cast<const FourFloats*>(normal_map[vertex[n]].column);
            const FourFloats image = column[0] * artist.x() + column[1] * artist.y() + column[2] * artist.z();
            const FourFloats length = length_of(image);
            normal = length[0] > kShortest ? image / length : FourFloats{artist.x(), artist.y(), artist.z(), 0};
            continue;
        }
        FourFloats sum = {};
        for (uint32_t p = leader[n]; p != NormalParts::kNone; p = next[p])
            for (uint32_t i = offset[p]; i < offset[p + 1]; ++i) {
                const uint32_t angle = part_angle[i];
                sum += weights[angle] * reinterpret_cast<const FourFloats&>(weights[angle / kFloats * kFloats]);
            }
        const FourFloats length = length_of(sum);
        const bool is_said = length[0] > 1e-6f;
        normal = is_said ? sum / length : FourFloats{0, 0, 0, 1};
        any_unsaid |= !is_said;
    }
    return any_unsaid;
}

// Of the corners of n faces; the fourth number of each is written over by the next.
SUNDER_VECTOR_CLONES void list_normals(const CornerNormal* normal, const uint32_t* corner_leader, const uint32_t* face,
                                       size_t n, Vec3f* out) {
    float* to = reinterpret_cast<float*>(out);
    const uint32_t* leader = corner_leader;
    for (size_t t = 0; t < n; ++t, to += 9) {
        leader = corner_leader + 3 * size_t{face[t]};
        std::memcpy(to, normal + leader[0], sizeof(CornerNormal));
        std::memcpy(to + 3, normal + leader[1], sizeof(CornerNormal));
        if (t + 1 < n) std::memcpy(to + 6, normal + leader[2], sizeof(CornerNormal));
    }
    if (n > 0) out[3 * n - 1] = normal[leader[2]].unit;
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
    normal_.resize(parts_->n_parts()), normal_moved_.resize(parts_->n_parts());
}

// Outer corners of one vertex with the same normal share it, whatever lies between them.
void SurfaceNormals::find_equal_corners(const FragmentFaces& faces, std::vector<uint32_t>& io_smooth) const {
    const Groups around =
        group_by(3 * faces.n_outer, faces.n_vertices, [&](uint32_t c) { return faces.triangles[c / 3][c % 3]; });
    for (uint32_t v = 0; v < faces.n_vertices; ++v)
        for (const uint32_t corner : around[v])
            io_smooth[corner] = *std::find_if(around[v].begin(), around[v].end(), [&](uint32_t first) {
                return artist_normal_[first] == artist_normal_[corner];
            });
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
    const auto low_end = [&](uint32_t corner) {  // of the edge that runs from a corner to the next of its face
        const Triangle& t = faces.triangles[corner / 3];
        return std::min(t[corner % 3], t[(corner + 1) % 3]);
    };
    const Groups edges = group_by(3 * faces.n_faces(), faces.n_vertices, low_end);
    struct Side {  // a face at one of its edges
        uint32_t high;
        uint32_t kind;  // 0 outer, else the break surface of which fragment
        uint32_t face;
        auto key() const { return std::pair(high, kind); }
    };
    std::vector<Side> sides;

    std::vector<uint32_t> smooth = disjoint_sets(3 * size_t{faces.n_faces()});
    auto corner_at = [&](uint32_t f, uint32_t v) {
        const Triangle& t = faces.triangles[f];
        return 3 * f + (t[0] == v ? 0 : t[1] == v ? 1 : 2);
    };
    auto join = [&](uint32_t f, uint32_t g, uint32_t v) { unite(smooth, corner_at(f, v), corner_at(g, v)); };
    for (uint32_t low = 0; low < faces.n_vertices; ++low) {
        sides.clear();
        for (const uint32_t corner : edges[low]) {
            const uint32_t f = corner / 3;
            const Triangle& t = faces.triangles[f];
            sides.push_back(
                {std::max(t[corner % 3], t[(corner + 1) % 3]), faces.is_outer(f) ? 0 : 1 + faces.fragment[f], f});
        }
        std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) { return x.key() < y.key(); });
        for (size_t i = 0; i < sides.size(); ++i)
            for (size_t j = i + 1; j < sides.size() && sides[j].key() == sides[i].key(); ++j) {
                const uint32_t f = sides[i].face, g = sides[j].face;
                const double limit = sides[i].kind == 0 ? kOuterCreaseCosine : interior_cosine;
                // Slivers go with what is beside them; across two interfaces they have the normals of these.
                const bool may_be_sliver = faces.interface[f] == faces.interface[g];
                if (!(may_be_sliver && (sliver_[f] || sliver_[g])) && rest_normal_[f].dot(rest_normal_[g]) < limit)
                    continue;
                join(f, g, low), join(f, g, sides[i].high);
            }
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
    chunk_changed_.assign((topology.triangle_face().size() + kChunk - 1) / kChunk, 0);
}

SharedArray<Vec3f> SurfaceNormals::evaluate(const SplitTopology& topology, const SkinBinding& binding,
                                            const SkinMotion& motion, const RangeRunner& run) {
    const size_t n_triangles = topology.triangles().size();
    const size_t first = first_teller_;  // faces below it are all listed
    run_by_turns(run, n_triangles - first, kGrain,
                 [&](size_t begin, size_t end) { weigh_moved(topology, motion, first + begin, first + end); });
    if (motion.all_moved()) any_unsaid_ = false;
    run_by_turns(run, parts_->n_normals(), kGrain, [&](size_t begin, size_t end) { find_moved(motion, begin, end); });
    const std::span<const uint32_t> face = topology.triangle_face();
    auto& slot = recycler_.take(3 * face.size(), 3 * size_t{topology.faces().n_faces()});
    run_by_turns(run, chunk_changed_.size(), 4, [&](size_t begin, size_t end) {
        for (size_t chunk = begin; chunk < end; ++chunk) {
            const size_t t = chunk * kChunk, n = std::min(kChunk, face.size() - t);
            if (motion.all_moved() || any_moved(face.subspan(t, n))) chunk_changed_[chunk] = motion.frame();
            if (chunk_changed_[chunk] <= slot.written) continue;
            Vec3f* out = slot.object->data();
            list_normals(normal_.data(), parts_->corner_leader().data(), &face[t], n, out + 3 * t);
            if (any_unsaid_) turn_unsaid(topology, binding, motion, t, t + n, out);
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
    const uint32_t leader = parts_->leader()[normal];
    if (motion.moved()[parts_->visual_vertex()[normal]]) return true;
    if (!part_artist_[leader].isZero(0)) return false;
    for (uint32_t p = leader; p != NormalParts::kNone; p = parts_->next()[p])
        for (uint32_t i = parts_->offset()[p]; i < parts_->offset()[p + 1]; ++i)
            if (teller_moved_[part_angle_[i] / kFloats]) return true;
    return false;
}

void SurfaceNormals::find_moved(const SkinMotion& motion, size_t begin, size_t end) {
    const auto find = [&](size_t from, size_t to) {
        if (from < to &&
            find_normals(*parts_, part_artist_, part_angle_, motion.normal_maps(), weights_, from, to, normal_.data()))
            any_unsaid_ = true;
    };
    if (motion.all_moved()) return find(begin, end);
    size_t still = begin;  // those before it are done
    for (size_t n = begin; n < end; ++n) {
        uint8_t& is_moved = normal_moved_[parts_->leader()[n]];
        is_moved = touches_moved(n, motion);
        if (is_moved) continue;
        find(still, n);
        still = n + 1;
    }
    find(still, end);
}

bool SurfaceNormals::any_moved(std::span<const uint32_t> faces) const {
    const auto leader = parts_->corner_leader();
    return std::any_of(faces.begin(), faces.end(), [&](uint32_t f) {
        return normal_moved_[leader[3 * f]] || normal_moved_[leader[3 * f + 1]] || normal_moved_[leader[3 * f + 2]];
    });
}

void SurfaceNormals::turn_unsaid(const SplitTopology& topology, const SkinBinding& binding, const SkinMotion& motion,
                                 size_t begin, size_t end, Vec3f* out) const {
    const auto leader = parts_->corner_leader();
    for (size_t t = begin; t < end; ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t f = topology.triangle_face()[t];
            if (normal_[leader[3 * f + c]].unsaid == 0) continue;
            const Mat3 linear = motion.linear_at(binding, topology.triangles()[t][c]);
            out[3 * t + c] = turned(linear, rest_normal_[f]).cast<float>();
        }
}

}  // namespace sunder
