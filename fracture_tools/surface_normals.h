// Corner normals of the visual mesh: smooth on the artist's surface, sharp where it broke.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/skinning.h"
#include "fracture_tools/split_topology.h"
#include "solver/data/fragment_set.h"

namespace sunder {

/// Which corners share a normal is decided at rest, around each vertex: two faces with a common edge are smooth there
/// if their rest normals differ by less than 60 degrees (outer faces), or less than the set's interior smooth angle
/// (break surfaces of one fragment). Outer and interior faces never are: a break has a sharp rim. At run time corners
/// that are smooth and still on one visual vertex get the mean of their faces' normals, weighted by the faces' angles.
///
/// Where the artist brought normals, outer corners have those, turned as the skin turns there (cofactor of its linear
/// part, which is what carries normals).
class SurfaceNormals {
public:
    /// `rest_vertex`: pool vertices in rest coordinates. `rest_normals`: the artist's, of outer corners, in rest
    /// coordinates; or empty. `interface_normals`: unit, from a to b, in rest coordinates (n_interfaces).
    /// `interior_smooth_angle`: degrees.
    SurfaceNormals(const FragmentFaces& faces, std::span<const Vec3> rest_vertex, std::vector<Vec3> rest_normals,
                   std::span<const Vec3> interface_normals, double interior_smooth_angle);

    /// Finds which corners share a normal. Call when `topology` has changed. Linear in the visible corners, up to a
    /// factor log(corners around a vertex).
    void bind(const SplitTopology& topology);

    /// `positions`, `skin`: of the visual vertices. Gives a unit vector for each corner, degenerate triangles included:
    /// those have their rest normal, turned by the skin. (3 n_triangles x 3)
    void evaluate(const SplitTopology& topology, std::span<const Vec3> positions, std::span<const Affine> skin,
                  std::vector<Vec3f>& out);

private:
    void find_rest_normals(const FragmentFaces& faces, std::span<const Vec3> rest_vertex,
                           std::span<const Vec3> interface_normals);
    void find_smooth_corners(const FragmentFaces& faces, double interior_cosine);

    std::vector<Vec3> artist_normal_;  // (3 n_outer x 3), or empty
    std::vector<Vec3> rest_normal_;    // unit                           (n_faces x 3)
    std::vector<uint8_t> sliver_;      // face too thin to tell a normal (n_faces)
    std::vector<uint32_t> smooth_;     // lowest corner that a corner is smooth with   (3 n_faces)

    std::vector<uint32_t> slot_;  // shared normal of a visible corner            (3 n_triangles)
    std::vector<Vec3> slot_normal_;
};

}  // namespace sunder
