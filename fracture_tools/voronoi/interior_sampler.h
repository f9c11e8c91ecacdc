// Random points of a solid.
#pragma once

#include <random>
#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Numbers that are the same on every machine for one seed.
class RandomShares {
public:
    explicit RandomShares(uint64_t seed) : engine_(seed) {}
    double share() { return double(engine_() >> 11) * 0x1p-53; }  // [0, 1)
    Vec3 in_unit_box() {
        const double x = share(), y = share(), z = share();
        return {x, y, z};
    }
    Vec3 direction();  // unit

private:
    std::mt19937_64 engine_;
};

/// Tells inside from outside by lines along z, looked up in a grid over x and y. The mesh, which must outlive it, has
/// to bound a solid.
class InteriorSampler {
public:
    explicit InteriorSampler(MeshView mesh);

    /// In doubles: within rounding of the surface either answer may come.
    bool is_inside(const Vec3& p) const;

    /// Evenly spread over the solid's volume; where that is a tiny share of its box (kFilled), over lines through its
    /// surface, and along these. On the surface where no line finds an inside.
    Vec3 draw(RandomShares& io_random) const;

    const Aabb& bounds() const { return box_; }

private:
    /// Where the line along z through a point crosses the surface.
    struct Crossing {
        double above;  // the point, m
        int turn;      // 1 where the line leaves the solid upward, -1 where it enters it
    };
    template <class Visit>
    void visit_crossings(const Vec3& p, Visit visit) const;
    size_t column(double x, double y) const;
    Vec3 draw_on_line(RandomShares& io_random) const;

    MeshView mesh_;
    Aabb box_;
    bool is_sparse_ = false;
    int side_ = 1;  // columns along x and along y
    std::vector<uint32_t> offset_, triangle_;
};

}  // namespace sunder
