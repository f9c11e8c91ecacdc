// Nearest and near points, by a uniform grid.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Looks at a fixed set of points, which must outlive it; about one point a grid cell.
class PointGrid {
public:
    explicit PointGrid(std::span<const Vec3> points);

    /// Index of the nearest point, the lowest of those equally near. Needs at least one point.
    uint32_t nearest(const Vec3& query) const;

    /// Calls visit(index) for points in cells that meet the ball: all within `radius` and some beyond. Order is fixed.
    template <class Visit>
    void visit_near(const Vec3& center, double radius, Visit visit) const {
        const std::array<int, 3> low = cell_of(center - Vec3::Constant(radius)),
                                 high = cell_of(center + Vec3::Constant(radius));
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x) {
                    const size_t c = number(x, y, z);
                    for (uint32_t s = offset_[c]; s < offset_[c + 1]; ++s) visit(point_[s]);
                }
    }

private:
    std::array<int, 3> cell_of(const Vec3& p) const;  // clamped to the grid
    size_t number(int x, int y, int z) const { return (size_t(z) * cells_[1] + y) * cells_[0] + x; }

    std::span<const Vec3> points_;
    Vec3 origin_ = Vec3::Zero();
    double cell_ = 1;  // side of a grid cell, m
    std::array<int, 3> cells_ = {1, 1, 1};
    std::vector<uint32_t> offset_, point_;
};

}  // namespace sunder
