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

    /// Evenly spread over the solid's volume.
    Vec3 draw(RandomShares& io_random) const;

    const Aabb& bounds() const { return box_; }

private:
    size_t column(double x, double y) const;

    MeshView mesh_;
    Aabb box_;
    int side_ = 1;  // columns along x and along y
    std::vector<uint32_t> offset_, triangle_;
};

}  // namespace sunder
