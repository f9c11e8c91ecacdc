// Uneven break surfaces (interior.h: displace_interfaces).
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fracture_tools/fragments/interior.h"
#include "fracture_tools/fragments/solid_noise.h"
#include "fracture_tools/mesh/parallel_chunks.h"
#include "fracture_tools/mesh/self_intersections.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// A vertex moves by less than this share of its distance from the outer surface; beyond kRamp amplitudes freely.
constexpr double kMostApproach = 0.45, kRamp = 2;
/// After so many halvings a vertex stays where it was cut.
constexpr int kMostHalvings = 5;
/// Rounds in which only what intersects is moved back; then all of the fragment's.
constexpr int kCarefulRounds = 16;
constexpr size_t kMovedAChunk = 4;

/// Directions that a vertex may move in: the normals of the interfaces that it is on, as a matrix that keeps a vector
/// along a single one of them and all of it where they span space.
std::vector<Mat3> directions(const FragmentSet& set) {
    std::vector<Mat3> sum(set.vertices.size(), Mat3::Zero());
    std::vector<Vec3> normal(set.vertices.size(), Vec3::Zero());
    for (const Interface& i : set.interfaces) {
        std::vector<uint32_t> vertices;
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t) {
            const auto& [a, b, c] = set.interface_triangles[t];
            const Vec3 n = (set.vertices[b] - set.vertices[a]).cross(set.vertices[c] - set.vertices[a]);
            for (uint32_t v : {a, b, c}) normal[v] += n, vertices.push_back(v);
        }
        for (uint32_t v : vertices) {
            if (normal[v].isZero(0)) continue;
            const Vec3 n = normal[v].normalized();
            sum[v] += n * n.transpose();
            normal[v].setZero();
        }
    }
    for (Mat3& m : sum) {
        const double largest = Eigen::SelfAdjointEigenSolver<Mat3>(m, Eigen::EigenvaluesOnly).eigenvalues()[2];
        if (largest > 0) m /= largest;
    }
    return sum;
}

class Displacement {
public:
    explicit Displacement(FragmentSet& io_set)
        : set_(io_set),
          rest_(io_set.vertices),
          full_(rest_.size(), Vec3::Zero()),
          halvings_(rest_.size(), kMostHalvings + 1),
          triangles_(io_set.fragments.size()),
          is_dirty_(io_set.fragments.size(), 1) {
        for (size_t f = 0; f < set_.fragments.size(); ++f)
            triangles_[f].assign(set_.outer_triangles.begin() + set_.fragments[f].outer_begin,
                                 set_.outer_triangles.begin() + set_.fragments[f].outer_end);
        for (const Interface& i : set_.interfaces)
            for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t)
                for (const FragmentId f : {i.a, i.b}) triangles_[f.index()].push_back(set_.interface_triangles[t]);
    }

    void choose(double amplitude, double scale, uint32_t seed) {
        std::vector<uint8_t> is_free(rest_.size(), 0);
        for (const Triangle& t : set_.interface_triangles)
            for (uint32_t v : t) is_free[v] = 1;
        for (const Triangle& t : set_.outer_triangles)
            for (uint32_t v : t) is_free[v] = 0;
        const std::vector<Mat3> along = directions(set_);
        const SurfaceLookup outer(MeshView(rest_, set_.outer_triangles));
        for (uint32_t v = 0; v < rest_.size(); ++v) {
            if (!is_free[v]) continue;
            const double distance = outer.nearest(rest_[v]).distance;
            const double ramp = std::min(1.0, distance / (kRamp * amplitude));
            Vec3 d = amplitude * ramp * (along[v] * solid_noise(rest_[v] / scale, seed));
            if (const double most = kMostApproach * distance; d.norm() > most) d *= most / d.norm();
            full_[v] = d;
            halvings_[v] = 0;
        }
        for (size_t f = 0; f < triangles_.size(); ++f)  // what stays as it was cut is not looked at
            is_dirty_[f] = std::any_of(triangles_[f].begin(), triangles_[f].end(), [&](const Triangle& t) {
                return !is_at_rest(t[0]) || !is_at_rest(t[1]) || !is_at_rest(t[2]);
            });
    }

    void place() {
        for (uint32_t v = 0; v < rest_.size(); ++v)
            set_.vertices[v] = is_at_rest(v) ? rest_[v] : Vec3(rest_[v] + std::ldexp(1.0, -halvings_[v]) * full_[v]);
    }

    /// Looks for intersections in the fragments that changed; false when cancelled.
    bool look(int threads, const Progress& progress) {
        found_.assign(triangles_.size(), {});
        return for_chunks(triangles_.size(), kMovedAChunk, threads, progress, "moving break surfaces",
                          [&](size_t, size_t begin, size_t end) {
                              for (size_t f = begin; f < end; ++f)
                                  if (is_dirty_[f]) found_[f] = self_intersections(set_.vertices, triangles_[f]);
                          });
    }

    /// Moves back what intersects, with all of its fragment if `whole`; false when there is nothing to move.
    bool retreat(bool whole) {
        std::vector<uint8_t> retreats(rest_.size(), 0);
        bool any = false;
        auto mark = [&](const Triangle& t) {
            for (uint32_t v : t) retreats[v] |= !is_at_rest(v), any |= !is_at_rest(v);
        };
        for (size_t f = 0; f < found_.size(); ++f) {
            for (const auto& [s, t] : found_[f]) mark(triangles_[f][s]), mark(triangles_[f][t]);
            if (whole && !found_[f].empty())
                for (const Triangle& t : triangles_[f]) mark(t);
        }
        for (uint32_t v = 0; v < rest_.size(); ++v)
            if (retreats[v]) halvings_[v] = whole ? kMostHalvings + 1 : halvings_[v] + 1;
        for (size_t f = 0; f < triangles_.size(); ++f)
            is_dirty_[f] = std::any_of(triangles_[f].begin(), triangles_[f].end(), [&](const Triangle& t) {
                return retreats[t[0]] || retreats[t[1]] || retreats[t[2]];
            });
        return any;
    }

private:
    bool is_at_rest(uint32_t v) const { return halvings_[v] > kMostHalvings; }

    FragmentSet& set_;
    const std::vector<Vec3> rest_;
    std::vector<Vec3> full_;                        // displacement that was asked for, m
    std::vector<int> halvings_;                     // of it
    std::vector<std::vector<Triangle>> triangles_;  // of each fragment, either way round
    std::vector<uint8_t> is_dirty_;
    std::vector<std::vector<std::pair<uint32_t, uint32_t>>> found_;
};

}  // namespace

Status displace_interfaces(double amplitude, double scale, uint32_t seed, int threads, const Progress& progress,
                           FragmentSet& io_set) {
    Displacement displacement(io_set);
    displacement.choose(amplitude, scale, seed);
    for (int round = 0;; ++round) {
        displacement.place();
        if (!displacement.look(threads, progress.part(1 - math::exp2(-round), 1 - math::exp2(-round - 1))))
            return cancelled();
        if (!displacement.retreat(round >= kCarefulRounds)) return {};
    }
}

}  // namespace sunder
