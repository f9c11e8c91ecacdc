// A triangle surface whose vertices go from one frame's places to the next one's: what a collider that deforms is
// asked.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solver/data/math.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// What of a surface stays as it deforms: who is joined to whom, and a tree over its triangles.
struct SurfaceTree {
    /// Of triangles that lay near one another at rest.
    struct Node {
        uint32_t begin = 0, end = 0;  // its triangles
        uint32_t right = 0;           // its second child, the first being the next node; 0: a leaf
    };
    size_t n_vertices = 0;
    double thickness = 0;              // m; > 0: not what it bounds, but what is within half of this of it
    std::vector<Triangle> triangles;   // leaf after leaf
    std::vector<Node> nodes;           // the root first, each before its children
    std::vector<uint32_t> fan_offset;  // of the triangles of a vertex              (n_vertices + 1)
    std::vector<uint32_t> fan;         // vertex after vertex, ascending            (3 n_triangles)
    uint64_t key = 0;                  // equal for equal triangles and thickness
};

/// Needs triangles whose corners are vertices of the mesh, at least one. Same mesh, same bits.
std::shared_ptr<const SurfaceTree> make_surface_tree(const MeshView& mesh, double thickness);

/// A surface over one frame. It moves as a whole from where it begins, about `pivot`, to `whole`; each vertex goes
/// straight on within that. So what turns as a whole is not deformed on its way.
struct MovingSurface {
    std::shared_ptr<const SurfaceTree> tree = {};
    Pose whole = {};                                 // at the end of the frame; at its begin the identity
    Vec3 pivot = Vec3::Zero();                       // at the begin of the frame, m
    std::vector<Vec3> begin = {};                    // of vertices, in the scene              (n_vertices), m
    std::vector<Vec3> way = {};                      // over the frame, within the whole       (n_vertices), m
    std::vector<Aabb> box_begin = {}, box_end = {};  // of nodes, within the whole             (n_nodes), m
    double longest = 0;                              // of these ways, m
    uint64_t begin_key = 0, end_key = 0;             // equal where all vertices are, and the tree is

    /// Within the whole, at `share` of the frame, m.
    Vec3 vertex(uint32_t v, double share) const { return begin[v] + share * way[v]; }
    /// Holds the triangles of a node.
    Aabb box(size_t node, double share) const {
        return {box_begin[node].min + share * (box_end[node].min - box_begin[node].min),
                box_begin[node].max + share * (box_end[node].max - box_begin[node].max)};
    }
};

/// Of vertices that are at `begin` and come to `end` ((n_vertices), m, finite). The whole is the rotation that fits
/// best in the mean of squares, about the mean.
MovingSurface move_surface(std::shared_ptr<const SurfaceTree> tree, std::span<const Vec3> begin,
                           std::span<const Vec3> end);

}  // namespace sunder
