#include "fracture_tools/point_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace sunder {

PointGrid::PointGrid(std::span<const Vec3> points) : points_(points) {
    Aabb box;
    for (const Vec3& p : points) box.extend(p);
    if (!points.empty()) {
        origin_ = box.min;
        const Vec3 size = box.max - box.min;
        // Flat and thin sets have cells of their longest side's share, so that the number of cells stays near n.
        const double floor_side = std::max(size.maxCoeff() / 128, std::numeric_limits<double>::min());
        const Vec3 thick = size.cwiseMax(floor_side);
        cell_ = std::max(std::cbrt(thick.prod() / double(points.size())), floor_side);
        for (int k = 0; k < 3; ++k) cells_[k] = std::clamp(int(size[k] / cell_) + 1, 1, 256);
    }
    offset_.assign(size_t(cells_[0]) * cells_[1] * cells_[2] + 1, 0);
    point_.resize(points.size());
    std::vector<size_t> cell(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        const auto [x, y, z] = cell_of(points[i]);
        ++offset_[(cell[i] = number(x, y, z)) + 1];
    }
    std::partial_sum(offset_.begin(), offset_.end(), offset_.begin());
    std::vector<uint32_t> next(offset_.begin(), offset_.end() - 1);
    for (size_t i = 0; i < points.size(); ++i) point_[next[cell[i]]++] = static_cast<uint32_t>(i);
}

std::array<int, 3> PointGrid::cell_of(const Vec3& p) const {
    std::array<int, 3> c;
    for (int k = 0; k < 3; ++k)
        c[k] = int(std::clamp(std::floor((p[k] - origin_[k]) / cell_), 0.0, double(cells_[k] - 1)));
    return c;
}

uint32_t PointGrid::nearest(const Vec3& query) const {
    assert(!points_.empty());
    const std::array<int, 3> home = cell_of(query);
    double best_distance = std::numeric_limits<double>::infinity();
    uint32_t best = 0;
    auto look = [&](int x, int y, int z) {
        const size_t c = number(x, y, z);
        for (uint32_t s = offset_[c]; s < offset_[c + 1]; ++s) {
            const double d = (points_[point_[s]] - query).squaredNorm();
            if (d < best_distance || (d == best_distance && point_[s] < best)) best_distance = d, best = point_[s];
        }
    };
    // Shell after shell of cells around the home cell, until all further ones are farther than the best.
    const int farthest = std::max({cells_[0], cells_[1], cells_[2]});
    for (int ring = 0; ring <= farthest; ++ring) {
        // Cells of this ring lie at least ring - 1 whole cells beyond the query, or beyond its place in the grid.
        const double reach = std::max(0, ring - 1) * cell_;
        if (reach * reach > best_distance) break;
        for (int z = std::max(0, home[2] - ring); z <= std::min(cells_[2] - 1, home[2] + ring); ++z)
            for (int y = std::max(0, home[1] - ring); y <= std::min(cells_[1] - 1, home[1] + ring); ++y) {
                const bool is_side = std::abs(z - home[2]) == ring || std::abs(y - home[1]) == ring;
                const int step = is_side || ring == 0 ? 1 : 2 * ring;
                for (int x = home[0] - ring; x <= home[0] + ring; x += step)
                    if (x >= 0 && x < cells_[0]) look(x, y, z);
            }
    }
    return best;
}

}  // namespace sunder
