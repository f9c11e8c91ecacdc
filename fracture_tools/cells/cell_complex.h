// Small cells that fill a solid: what every cutter makes, and what fragments are gathered from.
#pragma once

#include <cstdint>
#include <vector>

#include "fracture_tools/cells/tetrahedralize.h"
#include "solver/data/math.h"

namespace sunder {

/// A triangle between two cells, or between a cell and the outside. A polygon is several of them.
struct CellFace {
    static constexpr uint32_t kOutside = 0xffffffffu;

    Triangle vertices;  // counter-clockwise seen from outside of `cell`
    uint32_t cell = 0;  // for inner faces the lower of the two
    uint32_t neighbour = kOutside;
    uint32_t source_triangle = kOutside;  // of the mesh that was cut, which an outer face lies on or nearest to
};

/// Cells share vertices and faces by index, hence any union of cells is closed.
struct CellComplex {
    std::vector<Vec3> vertices;       // (n_vertices x 3), m
    std::vector<CellFace> faces;      // (n_faces)
    std::vector<double> cell_volume;  // (n_cells), m3, > 0
    std::vector<Vec3> cell_centroid;  // (n_cells x 3), m

    /// Weights of the source triangle's corners at the corners of each outer face, where outer faces lie on the source:
    /// they then are the first ones of `faces` (n_outer). Empty: the surface was meshed anew.
    std::vector<std::array<Vec3, 3>> source_weights;
    /// Inner faces lie in the bisector plane of their cells' sites (n_cells x 3). Empty: there is no such plane.
    std::vector<Vec3> cell_site;

    size_t n_cells() const { return cell_volume.size(); }
    double face_area(const CellFace& face) const {
        const auto& [a, b, c] = face.vertices;
        return 0.5 * (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).norm();
    }
};

/// Faces of each cell, one after the other.
struct CellFaceLists {
    std::vector<uint32_t> offset;  // (n_cells + 1)
    std::vector<uint32_t> face;    // into CellComplex::faces

    explicit CellFaceLists(const CellComplex& complex);
};

/// Leaves out separate parts (sets of cells that hang together by faces) of less than `least_volume`, m3, but never the
/// largest part. Gives where each was.
std::vector<Vec3> drop_crumbs(TetMesh& io_mesh, double least_volume);

/// Tetrahedra as cells; `source_triangle` is left open.
CellComplex make_cell_complex(const TetMesh& mesh);

}  // namespace sunder
