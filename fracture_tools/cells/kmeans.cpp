#include "fracture_tools/cells/kmeans.h"

#include <atomic>

#include "fracture_tools/cells/kmeans_seeding.h"
#include "fracture_tools/mesh/parallel_chunks.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr int kMaxIterations = 50;
constexpr size_t kPointsAChunk = 4096;

/// The centre of each point, by its index and by its place in the grid: points are gone through as they lie in space,
/// so that what is looked at is in the caches, and summed by index, so that sums do not depend on the grid.
struct Assignment {
    std::vector<uint32_t> of_point, of_place;  // number of centres: none yet  (n_points each)
};

/// Gives the number of points that change their centre. Where they were says where to look.
size_t assign_nearest(const PointGrid& points, const std::vector<Vec3>& centers, int threads, Assignment& io_labels) {
    const PointGrid grid(centers);
    std::atomic<size_t> n_changed = 0;
    for_chunks(points.places().size(), kPointsAChunk, threads, {}, "", [&](size_t, size_t begin, size_t end) {
        size_t changed = 0;
        for (size_t s = begin; s < end; ++s) {
            const Vec3& p = points.places()[s];
            const uint32_t last = io_labels.of_place[s];
            const uint32_t c = last < centers.size() ? grid.nearest(p, {last, (centers[last] - p).squaredNorm()}).index
                                                     : grid.nearest(p);
            if (c == last) continue;
            ++changed;
            io_labels.of_place[s] = io_labels.of_point[points.indices()[s]] = c;
        }
        n_changed += changed;
    });
    return n_changed;
}

/// Centres to the mean of their points; a centre without points stays.
void move_centers(std::span<const Vec3> points, std::span<const double> weights, const std::vector<uint32_t>& label,
                  std::vector<Vec3>& io_centers) {
    std::vector<Vec3> sum(io_centers.size(), Vec3::Zero());
    std::vector<double> total(io_centers.size(), 0);
    for (size_t i = 0; i < points.size(); ++i) {
        sum[label[i]] += weights[i] * points[i];
        total[label[i]] += weights[i];
    }
    for (size_t c = 0; c < io_centers.size(); ++c)
        if (total[c] > 0) io_centers[c] = sum[c] / total[c];
}

}  // namespace

Result<std::vector<uint32_t>> kmeans_clusters(std::span<const Vec3> points, std::span<const double> weights,
                                              uint32_t n_clusters, uint64_t seed, int threads,
                                              const Progress& progress) {
    SUNDER_ASSERT(n_clusters >= 1 && n_clusters <= points.size() && weights.size() == points.size());
    const PointGrid grid(points);
    std::vector<Vec3> centers = seed_centers(grid, weights, n_clusters, seed);
    Assignment labels;
    labels.of_point.assign(points.size(), n_clusters);
    labels.of_place = labels.of_point;
    for (int k = 0; k < kMaxIterations; ++k) {
        if (!progress.report(double(k) / kMaxIterations, "clustering cells")) return cancelled();
        if (assign_nearest(grid, centers, threads, labels) * 1000 <= points.size()) break;
        move_centers(points, weights, labels.of_point, centers);
    }
    return std::move(labels.of_point);
}

}  // namespace sunder
