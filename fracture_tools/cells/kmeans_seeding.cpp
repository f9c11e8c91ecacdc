#include "fracture_tools/cells/kmeans_seeding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

namespace sunder {
namespace {

/// Sums of weights that change, to draw from; both in O(log n): a binary indexed tree over blocks of weights. Within a
/// block the weights themselves are asked, so that a change writes to little memory.
class WeightSums {
public:
    explicit WeightSums(std::span<const double> weights) : n_(weights.size()), sum_((n_ + kBlock - 1) / kBlock + 1, 0) {
        while (2 * top_ < sum_.size()) top_ *= 2;
        for (size_t i = 0; i < n_; ++i) add(i, weights[i]);
    }
    void add(size_t i, double change) {
        for (size_t k = i / kBlock + 1; k < sum_.size(); k += k & -k) sum_[k] += change;
    }
    /// The item at `share` in [0, 1) of the total of weight_of(0 .. n - 1); the last one where all are 0.
    template <class Weight>
    size_t draw(double share, Weight weight_of) const {
        double total = 0;
        for (size_t k = sum_.size() - 1; k > 0; k -= k & -k) total += sum_[k];
        double rest = share * total;
        size_t block = 0;
        for (size_t step = top_; step > 0; step /= 2)
            if (block + step < sum_.size() && sum_[block + step] <= rest) rest -= sum_[block += step];
        size_t i = std::min(block * kBlock, n_ - 1);
        for (; i + 1 < n_ && weight_of(i) <= rest; ++i) rest -= weight_of(i);
        return i;
    }

private:
    static constexpr size_t kBlock = 64;

    size_t n_;
    std::vector<double> sum_;
    size_t top_ = 1;
};

/// Squared distances to the nearest centre so far, in blocks of points that lie side by side in the grid: most blocks
/// near a new centre are too far from it to have any point that it is the nearest of.
class NearestSoFar {
public:
    explicit NearestSoFar(const PointGrid& points)
        : points_(points),
          distance_(points.places().size(), std::numeric_limits<double>::infinity()),
          blocks_((distance_.size() + kBlock - 1) / kBlock) {
        for (size_t s = 0; s < distance_.size(); ++s) blocks_[s / kBlock].box.extend(points.places()[s]);
    }
    double distance(uint32_t place) const { return distance_[place]; }

    /// Calls nearer(place, squared distance before, now) for each point that `center` is nearer to than all before.
    template <class Nearer>
    void add(const Vec3& center, Nearer nearer) {
        points_.visit_runs_near(center, std::sqrt(farthest_), [&](uint32_t begin, uint32_t end) {
            for (uint32_t b = begin / kBlock; b * kBlock < end; ++b) {
                // Rounded as the points' own distances are: none of them is below it.
                if (distance_to(blocks_[b].box, center) >= blocks_[b].farthest) continue;
                for (uint32_t s = std::max(begin, b * kBlock); s < std::min(end, (b + 1) * kBlock); ++s) {
                    const double d = (points_.places()[s] - center).squaredNorm();
                    if (d < distance_[s]) nearer(s, std::exchange(distance_[s], d), d);
                }
                blocks_[b].farthest = *std::max_element(distance_.begin() + b * kBlock, end_of(b));
            }
        });
        if (4 * ++n_added_ >= 5 * n_measured_) measure_farthest();
    }

private:
    static constexpr uint32_t kBlock = 16;

    struct Block {
        Aabb box;
        double farthest = std::numeric_limits<double>::infinity();  // squared, of its points
    };

    static double distance_to(const Aabb& box, const Vec3& p) {
        return (box.min - p).cwiseMax(p - box.max).cwiseMax(0).squaredNorm();
    }
    std::vector<double>::iterator end_of(uint32_t block) {
        return distance_.begin() + std::min<size_t>((block + 1) * size_t{kBlock}, distance_.size());
    }
    void measure_farthest() {
        n_measured_ = n_added_;
        farthest_ = std::ranges::max_element(blocks_, {}, &Block::farthest)->farthest;
    }

    const PointGrid& points_;
    std::vector<double> distance_;  // of places()
    std::vector<Block> blocks_;
    double farthest_ = std::numeric_limits<double>::max();  // no squared distance is above it
    size_t n_added_ = 0, n_measured_ = 0;
};

}  // namespace

std::vector<Vec3> seed_centers(const PointGrid& points, std::span<const double> weights, uint32_t n, uint64_t seed) {
    const size_t n_points = weights.size();
    std::mt19937_64 random(seed);
    auto share = [&] { return double(random() >> 11) * 0x1p-53; };
    std::vector<double> weight(n_points);  // of places
    std::vector<uint32_t> place_of(n_points);
    for (uint32_t s = 0; s < n_points; ++s) {
        weight[s] = weights[points.indices()[s]];
        place_of[points.indices()[s]] = s;
    }
    std::vector<uint8_t> is_center(n_points, 0);
    WeightSums sums(weights);
    NearestSoFar nearest(points);
    // Before the first centre distances are infinite, and the weights themselves are drawn from.
    auto drawn = [&](uint32_t s, double distance) {
        return distance == std::numeric_limits<double>::infinity() ? weight[s] : weight[s] * distance;
    };
    auto weight_of = [&](size_t i) { return drawn(place_of[i], nearest.distance(place_of[i])); };
    // Sums have rounding in them: the next one from there on that has a weight; where none has, that is no centre yet.
    auto draw = [&] {
        const size_t at = sums.draw(share(), weight_of);
        for (size_t k = 0; k < n_points; ++k)
            if (const size_t i = (at + k) % n_points; weight_of(i) > 0) return i;
        return size_t(std::find(is_center.begin(), is_center.end(), 0) - is_center.begin());
    };

    std::vector<Vec3> centers;
    while (centers.size() < n) {
        const size_t i = draw();
        is_center[i] = 1;
        centers.push_back(points.places()[place_of[i]]);
        nearest.add(centers.back(), [&](uint32_t s, double before, double now) {
            sums.add(points.indices()[s], drawn(s, now) - drawn(s, before));
        });
    }
    return centers;
}

}  // namespace sunder
