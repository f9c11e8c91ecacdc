// The nearest point of a triangle surface.
#pragma once

#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

struct SurfacePoint {
    uint32_t triangle = 0;
    Vec3 barycentric = Vec3::UnitX();  // weights of its corners, sum 1
    Vec3 position = Vec3::Zero();      // m
    double distance = 0;               // m
};

/// Nearest point of one triangle (Ericson 2005, section 5.1.5); degenerate triangles are allowed.
SurfacePoint nearest_on_triangle(const Vec3& query, const Vec3& a, const Vec3& b, const Vec3& c);

/// A tree of boxes over the triangles of a mesh, which must outlive it. Needs at least one triangle.
class SurfaceLookup {
public:
    explicit SurfaceLookup(MeshView mesh);

    /// Of triangles equally near the one with the lowest index.
    SurfacePoint nearest(const Vec3& query) const;

private:
    struct Node {
        Aabb box;
        uint32_t begin = 0, end = 0;  // its triangles in order_
        uint32_t right = 0;           // right child; the left one follows; 0: a leaf
    };
    void build(uint32_t node);

    MeshView mesh_;
    std::vector<uint32_t> order_;
    std::vector<Vec3> middle_;
    std::vector<Node> nodes_;
};

}  // namespace sunder
