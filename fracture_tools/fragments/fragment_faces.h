// Every face of every fragment in one numbering: what the deformer's parts index by.
#pragma once

#include <vector>

#include "solver/data/fragment_set.h"
#include "solver/data/ids.h"
#include "solver/data/result.h"

namespace sunder {

/// The faces of all fragments, each seen from outside of its fragment:
///
///     [0, n_outer)                                 outer triangles
///     [n_outer, n_outer + n_interface)             interface triangles as `a` has them
///     [n_outer + n_interface, + n_interface)       the same triangles as `b` has them: corners 0, 2, 1
///
/// Corner c of face f has the index 3 f + c.
struct FragmentFaces {
    uint32_t n_outer = 0, n_interface = 0, n_vertices = 0, n_fragments = 0;
    std::vector<Triangle> triangles;  // pool vertices                  (n_faces x 3)
    std::vector<uint32_t> fragment;   // whose surface                  (n_faces)
    std::vector<uint32_t> interface;  // kNone for outer faces          (n_faces)

    uint32_t n_faces() const { return n_outer + 2 * n_interface; }
    bool is_outer(uint32_t face) const { return face < n_outer; }
    bool is_side_b(uint32_t face) const { return face >= n_outer + n_interface; }
    /// The same interface triangle as the other fragment has it.
    uint32_t twin(uint32_t face) const { return is_side_b(face) ? face - n_interface : face + n_interface; }
    /// Where the twin has the vertex of corner c.
    static int twin_corner(int c) { return c == 0 ? 0 : 3 - c; }
    /// Entry of the set's outer_corner_* (outer faces) or interface_corner_* (interface faces) arrays.
    uint32_t source_corner(uint32_t face, int c) const {
        if (is_outer(face)) return 3 * face + c;
        return is_side_b(face) ? 3 * (face - n_outer - n_interface) + twin_corner(c) : 3 * (face - n_outer) + c;
    }
};

/// Errors: indices, ranges or attribute arrays of `set` that do not fit together; vertices that are not finite.
/// Whether fragments are closed is checked where their faces are joined (SplitTopology::make).
Result<FragmentFaces> make_fragment_faces(const FragmentSet& set);

}  // namespace sunder
