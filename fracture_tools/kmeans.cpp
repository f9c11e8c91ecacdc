#include "fracture_tools/kmeans.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>

#include "fracture_tools/point_grid.h"

namespace sunder {
namespace {

constexpr int kMaxIterations = 50;

/// Weights that can be changed and drawn from, both in O(log n) (a binary indexed tree of sums).
class WeightedDraw {
public:
    explicit WeightedDraw(size_t n) : weight_(n, 0), sum_(n + 1, 0) {
        while (2 * top_ <= n) top_ *= 2;
    }
    void set(size_t i, double weight) {
        const double change = weight - weight_[i];
        weight_[i] = weight;
        for (size_t k = i + 1; k < sum_.size(); k += k & -k) sum_[k] += change;
    }
    /// The item at `share` in [0, 1) of the total; never one of weight 0 while another has some. `size()` if all are 0.
    size_t draw(double share) const {
        double total = 0;
        for (size_t k = weight_.size(); k > 0; k -= k & -k) total += sum_[k];
        double rest = share * total;
        size_t at = 0;
        for (size_t step = top_; step > 0; step /= 2)
            if (at + step < sum_.size() && sum_[at + step] <= rest) rest -= sum_[at += step];
        // Sums have rounding in them: go on to the next item that has a weight.
        for (size_t k = 0; k < weight_.size(); ++k)
            if (const size_t i = (at + k) % weight_.size(); weight_[i] > 0) return i;
        return weight_.size();
    }

private:
    std::vector<double> weight_, sum_;
    size_t top_ = 1;
};

/// k-means++: each next centre is drawn with probability weight * (distance to the nearest centre so far)^2.
std::vector<Vec3> seed_centers(std::span<const Vec3> points, std::span<const double> weights, uint32_t n,
                               uint64_t seed) {
    std::mt19937_64 random(seed);
    auto share = [&] { return double(random() >> 11) * 0x1p-53; };
    const PointGrid grid(points);
    std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());  // squared
    std::vector<uint8_t> is_center(points.size(), 0);
    WeightedDraw draw(points.size());
    for (size_t i = 0; i < points.size(); ++i) draw.set(i, weights[i]);

    std::vector<Vec3> centers;
    double farthest = std::numeric_limits<double>::max();  // no squared distance is above it
    while (centers.size() < n) {
        size_t i = draw.draw(share());
        if (i == points.size()) i = size_t(std::find(is_center.begin(), is_center.end(), 0) - is_center.begin());
        is_center[i] = 1;
        centers.push_back(points[i]);
        grid.visit_near(points[i], std::sqrt(farthest), [&](uint32_t j) {
            const double d = (points[j] - points[i]).squaredNorm();
            if (d < distance[j]) distance[j] = d, draw.set(j, weights[j] * d);
        });
        const bool doubled = (centers.size() & (centers.size() - 1)) == 0;
        if (doubled) farthest = *std::max_element(distance.begin(), distance.end());
    }
    return centers;
}

size_t assign_nearest(std::span<const Vec3> points, const std::vector<Vec3>& centers, std::vector<uint32_t>& io_label) {
    const PointGrid grid(centers);
    size_t changed = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        const uint32_t c = grid.nearest(points[i]);
        changed += c != io_label[i];
        io_label[i] = c;
    }
    return changed;
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
                                              uint32_t n_clusters, uint64_t seed, const Progress& progress) {
    assert(n_clusters >= 1 && n_clusters <= points.size() && weights.size() == points.size());
    std::vector<Vec3> centers = seed_centers(points, weights, n_clusters, seed);
    std::vector<uint32_t> label(points.size(), n_clusters);
    for (int k = 0; k < kMaxIterations; ++k) {
        if (!progress.report(double(k) / kMaxIterations, "clustering cells")) return cancelled();
        if (assign_nearest(points, centers, label) * 1000 <= points.size()) break;
        move_centers(points, weights, label, centers);
    }
    return label;
}

}  // namespace sunder
