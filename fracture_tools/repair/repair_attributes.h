// Attributes of an artist's mesh on the mesh that repair made of it: those of corners, triangles and vertices, and
// groups.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// How a triangle of a repaired mesh faces against the artist's own.
enum class Sense : int8_t { reversed = -1, none = 0, same = 1 };

/// `io_mesh` has positions and triangles, which are the source's, in any order, some reversed or missing. Gives them
/// what the source has at corners and triangles; vertex groups find their vertices by position. Normals of reversed
/// triangles are reversed, too. Gives what became of each triangle.
struct Origin {
    uint32_t triangle = 0;  // of the source
    Sense sense = Sense::none;
};
std::vector<Origin> carry_attributes(const TriMesh& source, TriMesh& io_mesh);

/// `io_mesh` has triangles of the source and parts of them, in any order. Gives each what its triangle has at its
/// place.
void carry_cut_attributes(const TriMesh& source, TriMesh& io_mesh);

/// `io_mesh` is a new surface near the source: attributes are those of the nearest triangle (UVs go on beyond its
/// border where that is a seam), groups have the vertices whose nearest triangle's nearest corner they have. Normals
/// are left out: they belong to a surface that is no longer there.
void resample_attributes(const TriMesh& source, TriMesh& io_mesh);

/// Appends a vertex with the attributes of another; gives its number.
uint32_t append_vertex(TriMesh& io_mesh, const Vec3& position, uint32_t like);

/// Appends a triangle with the attributes of another: corner c has those of corner `like[c]` (3 * triangle + corner).
void append_triangle(TriMesh& io_mesh, const Triangle& corners, std::span<const uint32_t, 3> like,
                     std::span<const Vec3f, 3> normals);

/// A vertex of the mesh as a corner within a triangle.
struct WeightedCorner {
    uint32_t vertex;
    Vec3 weights;  // of the triangle's corners, sum 1
};

/// Puts parts of a triangle in its place: the first one there, the others at the end. Corners have what the triangle
/// has in the place.
void replace_triangle(TriMesh& io_mesh, uint32_t triangle, std::span<const std::array<WeightedCorner, 3>> parts);

/// Turns a triangle with its attributes round.
void turn_triangle(TriMesh& io_mesh, uint32_t triangle);

/// Keeps the triangles with a mark, and the vertices that they have.
void keep_marked(TriMesh& io_mesh, std::span<const uint8_t> mark);

}  // namespace sunder
