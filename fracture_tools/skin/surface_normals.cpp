#include "fracture_tools/skin/surface_normals.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <numbers>

#include "fracture_tools/mesh/counting_sort.h"
#include "fracture_tools/skin/four_floats.h"
#include "fracture_tools/skin/vector_clones.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kOuterCreaseCosine = 0.5;  // 60 degrees

// CornerWeights as floats.
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

// n turned the way normals go; n itself where its image vanishes.
Vec3 turned(const Mat3& linear, const Vec3& n) {
    Mat3 cofactor;
    for (int k = 0; k < 3; ++k) cofactor.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    const Vec3 image = cofactor * n;
    const double length = image.norm();
    return length > kShortestNormal ? Vec3(image / length) : n;
}

// Normals [begin, end): the sum of what faces tell, part after part. Whether some are told by none.
SUNDER_VECTOR_CLONES bool find_normals(const NormalParts& parts, std::span<const uint32_t> part_angle,
                                       std::span<const CornerWeights> corner_weights, size_t begin, size_t end,
                                       CornerNormal* out) {
    const auto leader = parts.leader(), next = parts.next(), offset = parts.offset();
    const float* weights = reinterpret_cast<const float*>(corner_weights.data());
    bool any_unsaid = false;
    for (size_t n = begin; n < end; ++n) {
        FourFloats sum = {};
        for (uint32_t p = leader[n]; p != kNone; p = next[p])
            for (uint32_t i = offset[p]; i < offset[p + 1]; ++i) {
                const uint32_t angle = part_angle[i];
                sum += weights[angle] * reinterpret_cast<const FourFloats&>(weights[angle / kFloats * kFloats]);
            }
        const FourFloats length = length_of(sum);
        const bool is_said = length[0] > 1e-6f;
        reinterpret_cast<FourFloats&>(out[leader[n]]) = is_said ? sum / length : FourFloats{0, 0, 0, 1};
        any_unsaid |= !is_said;
    }
    return any_unsaid;
}

// Of the corners of n faces, which are counted from the one that corner_normal begins with; the fourth number of each
// is written over by the next.
SUNDER_VECTOR_CLONES void list_normals(const CornerNormal* normal, const uint32_t* corner_normal, const uint32_t* face,
                                       size_t n, uint32_t first_face, Vec3f* out) {
    float* to = reinterpret_cast<float*>(out);
    const uint32_t* corner = corner_normal;
    for (size_t t = 0; t < n; ++t, to += 9) {
        corner = corner_normal + 3 * size_t{face[t] - first_face};
        std::memcpy(to, normal + corner[0], sizeof(CornerNormal));
        std::memcpy(to + 3, normal + corner[1], sizeof(CornerNormal));
        if (t + 1 < n) std::memcpy(to + 6, normal + corner[2], sizeof(CornerNormal));
    }
    if (n > 0) out[3 * n - 1] = normal[corner[2]].unit;
}

}  // namespace

SurfaceNormals::SurfaceNormals(const SplitTopology& topology, std::span<const Vec3> rest_vertex,
                               std::span<const Vec3> rest_normals, std::span<const Vec3> interface_normals,
                               double interior_smooth_angle) {
    const FragmentFaces& faces = topology.faces();
    first_teller_ = rest_normals.empty() ? 0 : faces.n_outer;
    find_rest_normals(faces, rest_vertex, interface_normals);
    silent_ = sliver_;
    std::vector<Vec3f> unit;
    for (size_t c = 0; c < rest_normals.size(); ++c) {
        const double length = rest_normals[c].norm();
        unit.push_back((length > 0.1 ? Vec3(rest_normals[c] / length) : rest_normal_[c / 3]).cast<float>());
    }
    artist_.emplace(topology, unit);
    parts_.emplace(topology, first_teller_,
                   find_smooth_corners(faces, math::cos(interior_smooth_angle * std::numbers::pi / 180)));
    for (const uint32_t c : parts_->corners()) part_angle_.push_back(kFloats * (c / 3) + kAngle + c % 3);
    weights_.assign(faces.n_faces() - first_teller_, {}), teller_moved_.resize(weights_.size());
    normal_.resize(artist_->size() + parts_->n_parts()), normal_moved_.resize(normal_.size());
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
    const uint32_t first = 3 * first_teller_, n_corners = 3 * faces.n_faces() - first;
    const Groups edges = group_by(n_corners, faces.n_vertices, [&](uint32_t c) { return low_end(first + c); });
    struct Side {  // a face at one of its edges
        uint32_t high;
        uint32_t kind;  // 0 outer, else the break surface of which fragment
        uint32_t face;
        auto key() const { return std::pair(high, kind); }
    };
    std::vector<Side> sides;

    std::vector<uint32_t> smooth = disjoint_sets(n_corners);
    auto corner_at = [&](uint32_t f, uint32_t v) {
        const Triangle& t = faces.triangles[f];
        return 3 * (f - first_teller_) + (t[0] == v ? 0 : t[1] == v ? 1 : 2);
    };
    auto join = [&](uint32_t f, uint32_t g, uint32_t v) { unite(smooth, corner_at(f, v), corner_at(g, v)); };
    for (uint32_t low = 0; low < faces.n_vertices; ++low) {
        sides.clear();
        for (const uint32_t corner : edges[low]) {
            const uint32_t f = (first + corner) / 3, c = corner % 3;
            const Triangle& t = faces.triangles[f];
            sides.push_back({std::max(t[c], t[(c + 1) % 3]), faces.is_outer(f) ? 0 : 1 + faces.fragment[f], f});
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
    chunk_changed_.assign((topology.triangle_face().size() + kTriangles - 1) / kTriangles, 0);
}

void SurfaceNormals::place_chunk(const SplitTopology& topology, const SkinMotion& motion, size_t chunk,
                                 std::span<const NormalMap> normal_map) {
    artist_->turn(topology, chunk, normal_map, motion.moved().subspan(topology.chunk_vertex(chunk)), normal_,
                  normal_moved_);
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
            const size_t t = chunk * kTriangles, n = std::min(kTriangles, face.size() - t);
            if (motion.all_moved() || any_moved(face.subspan(t, n))) chunk_changed_[chunk] = motion.frame();
            if (chunk_changed_[chunk] <= slot.written) continue;
            const size_t n_artist = t < first_teller_ ? std::min(n, first_teller_ - t) : 0;
            Vec3f* out = slot.object->data();
            list_normals(normal_.data(), artist_->of_corner().data(), &face[t], n_artist, 0, out + 3 * t);
            list_normals(normal_.data() + artist_->size(), parts_->corner_leader().data(), face.data() + t + n_artist,
                         n - n_artist, first_teller_, out + 3 * (t + n_artist));
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
    if (motion.moved()[parts_->visual_vertex()[normal]]) return true;
    for (uint32_t p = parts_->leader()[normal]; p != kNone; p = parts_->next()[p])
        for (uint32_t i = parts_->offset()[p]; i < parts_->offset()[p + 1]; ++i)
            if (teller_moved_[part_angle_[i] / kFloats]) return true;
    return false;
}

void SurfaceNormals::find_moved(const SkinMotion& motion, size_t begin, size_t end) {
    const auto find = [&](size_t from, size_t to) {
        if (from < to && find_normals(*parts_, part_angle_, weights_, from, to, normal_.data() + artist_->size()))
            any_unsaid_ = true;
    };
    if (motion.all_moved()) return find(begin, end);
    size_t still = begin;  // those before it are done
    for (size_t n = begin; n < end; ++n) {
        uint8_t& is_moved = normal_moved_[artist_->size() + parts_->leader()[n]];
        is_moved = touches_moved(n, motion);
        if (is_moved) continue;
        find(still, n);
        still = n + 1;
    }
    find(still, end);
}

size_t SurfaceNormals::normal_of(uint32_t face, uint32_t corner) const {
    if (face < first_teller_) return artist_->of_corner()[3 * face + corner];
    return artist_->size() + parts_->corner_leader()[3 * (face - first_teller_) + corner];
}

bool SurfaceNormals::any_moved(std::span<const uint32_t> faces) const {
    return std::any_of(faces.begin(), faces.end(), [&](uint32_t f) {
        return normal_moved_[normal_of(f, 0)] || normal_moved_[normal_of(f, 1)] || normal_moved_[normal_of(f, 2)];
    });
}

void SurfaceNormals::turn_unsaid(const SplitTopology& topology, const SkinBinding& binding, const SkinMotion& motion,
                                 size_t begin, size_t end, Vec3f* out) const {
    for (size_t t = begin; t < end; ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t f = topology.triangle_face()[t];
            if (normal_[normal_of(f, c)].unsaid == 0) continue;
            const Mat3 linear = motion.linear_at(binding, topology.triangles()[t][c]);
            out[3 * t + c] = turned(linear, rest_normal_[f]).cast<float>();
        }
}

}  // namespace sunder
