#include "fracture_tools/mesh/point_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"

namespace sunder {

PointGrid::PointGrid(std::span<const Vec3> points) {
    Aabb box;
    for (const Vec3& p : points) box.extend(p);
    if (!points.empty()) {
        origin_ = box.min;
        const Vec3 size = box.max - box.min;
        // Flat and thin sets have cells of their longest side's share, so that the number of cells stays near n.
        const double floor_side = std::max(size.maxCoeff() / 128, std::numeric_limits<double>::min());
        const Vec3 thick = size.cwiseMax(floor_side);
        cell_ = std::max(math::cbrt(thick.prod() / double(points.size())), floor_side);
        cells_a_metre_ = 1 / cell_;
        for (int k = 0; k < 3; ++k) cells_[k] = std::clamp(int(size[k] / cell_) + 1, 1, 256);
    }
    offset_.assign(size_t(cells_[0]) * cells_[1] * cells_[2] + 1, 0);
    std::vector<size_t> cell(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        const auto [x, y, z] = cell_of(points[i]);
        ++offset_[(cell[i] = number(x, y, z)) + 1];
    }
    std::partial_sum(offset_.begin(), offset_.end(), offset_.begin());
    place_.resize(points.size());
    index_.resize(points.size());
    std::vector<uint32_t> next(offset_.begin(), offset_.end() - 1);
    for (size_t i = 0; i < points.size(); ++i) {
        const uint32_t s = next[cell[i]]++;
        place_[s] = points[i];
        index_[s] = static_cast<uint32_t>(i);
    }
}

std::array<int, 3> PointGrid::cell_of(const Vec3& p) const {
    std::array<int, 3> c;
    for (int k = 0; k < 3; ++k)
        c[k] = int(std::clamp((p[k] - origin_[k]) * cells_a_metre_, 0.0, double(cells_[k] - 1)));
    return c;
}

uint32_t PointGrid::nearest(const Vec3& query) const {
    SUNDER_ASSERT(!place_.empty());
    // Any point of the nearest cells that have one; the ball through it holds all that are nearer.
    const std::array<int, 3> home = cell_of(query);
    for (int ring = 0;; ++ring)
        for (int z = std::max(0, home[2] - ring); z <= std::min(cells_[2] - 1, home[2] + ring); ++z)
            for (int y = std::max(0, home[1] - ring); y <= std::min(cells_[1] - 1, home[1] + ring); ++y) {
                const int low = std::max(0, home[0] - ring), high = std::min(cells_[0] - 1, home[0] + ring);
                const uint32_t s = offset_[number(low, y, z)];
                if (s < offset_[number(high, y, z) + 1])
                    return nearest(query, {index_[s], (place_[s] - query).squaredNorm()}).index;
            }
}

PointGrid::Near PointGrid::nearest(const Vec3& query, Near known) const {
    Near best = known;
    // Distances are rounded, so that a point at exactly the known one may be a little farther.
    const double radius = std::sqrt(known.squared_distance) * (1 + 1e-12);
    visit_runs_near(query, radius, [&](uint32_t begin, uint32_t end) {
        for (uint32_t s = begin; s < end; ++s) {
            const double d = (place_[s] - query).squaredNorm();
            if (d < best.squared_distance || (d == best.squared_distance && index_[s] < best.index))
                best = {index_[s], d};
        }
    });
    return best;
}

}  // namespace sunder
