// Nearest and near points, by a uniform grid.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Keeps a copy of a fixed set of points, cell after cell; about one point a grid cell.
class PointGrid {
public:
    explicit PointGrid(std::span<const Vec3> points);

    /// Index of the nearest point, the lowest of those equally near. Needs at least one point.
    uint32_t nearest(const Vec3& query) const;

    struct Near {
        uint32_t index;           // of a point
        double squared_distance;  // m2
    };
    /// The same where a point near the query is known: the nearer that is, the fewer cells are looked at.
    Near nearest(const Vec3& query, Near known) const;

    /// Calls visit(index) for points in cells that meet the ball: all within `radius` and some beyond. Order is fixed.
    template <class Visit>
    void visit_near(const Vec3& center, double radius, Visit visit) const {
        visit_runs_near(center, radius, [&](uint32_t begin, uint32_t end) {
            for (uint32_t s = begin; s < end; ++s) visit(index_[s]);
        });
    }

    /// All points in the order of their cells (n_points x 3), m, and their indices; points of one cell ascend.
    std::span<const Vec3> places() const { return place_; }
    std::span<const uint32_t> indices() const { return index_; }

    /// Like visit_near, in runs of places(): visit(begin, end), ascending.
    template <class Visit>
    void visit_runs_near(const Vec3& center, double radius, Visit visit) const {
        const std::array<int, 3> low = cell_of(center - Vec3::Constant(radius)),
                                 high = cell_of(center + Vec3::Constant(radius));
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y) {
                const uint32_t begin = offset_[number(low[0], y, z)], end = offset_[number(high[0], y, z) + 1];
                if (begin < end) visit(begin, end);
            }
    }

private:
    std::array<int, 3> cell_of(const Vec3& p) const;  // clamped to the grid
    size_t number(int x, int y, int z) const { return (size_t(z) * cells_[1] + y) * cells_[0] + x; }

    Vec3 origin_ = Vec3::Zero();
    double cell_ = 1, cells_a_metre_ = 1;  // side of a grid cell, m
    std::array<int, 3> cells_ = {1, 1, 1};
    std::vector<Vec3> place_;
    std::vector<uint32_t> index_, offset_;  // of each place; of each cell's first place (n_cells + 1)
};

}  // namespace sunder
