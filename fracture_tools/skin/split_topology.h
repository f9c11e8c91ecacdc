// Which vertices and faces the visual mesh has while fracture goes on (Choi 2014, section 4.1 and Fig. 2).
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "fracture_tools/fragments/fragment_faces.h"
#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/shared_array.h"
#include "solver/data/ids.h"
#include "solver/data/result.h"

namespace sunder {

enum class ListedFaces {
    visible,  // what can be seen: no face at an interface that holds (section 4.1)
    all,      // every face of every fragment, those at interfaces that hold marked as hidden (section 4.2)
};

/// Splits the vertices that fragments share, as the interfaces between them break.
///
/// The paper asks, around each vertex, which fragments are still connected through unbroken interfaces there. We ask
/// it of *fans*: the faces of one fragment around one vertex that hang together by edges. A fragment has one fan at
/// most of its vertices and then both are the same; where it touches itself in a point (fragments made of tetrahedra
/// do) it has several, and stays a manifold when it comes off.
///
///        a | b      Around v: fans a, b, c; joins a-b, b-c, c-a, one for each interface with a face at v.
///       ---v---     a-b broken: a and b hold together through c, v does not split.
///          c        a-b and c-a broken: {a} {b c}, two vertices.
///
/// Balance: all faces of a fragment along one edge share the fans at both ends, so each closed fragment is balanced in
/// fans; both faces of an unbroken interface triangle have the same vertices, so leaving them out keeps the balance.
/// That holds for any set of broken interfaces. (Manifold it is only from case to case: a crack may end in an edge.)
class SplitTopology {
public:
    /// Errors: a fragment that is not closed. Cost: sorts the corners once, O(n log n).
    static Result<SplitTopology> make(FragmentFaces faces, ListedFaces listed = ListedFaces::visible);

    /// Makes vertices and triangles for a state of the interfaces; true when something changed. The result depends on
    /// `interface_intact` (n_interfaces) alone: faces are listed in their own order, vertices numbered in the order of
    /// the lowest fan of each class. What hangs together where, and what is seen, is worked out anew only around
    /// vertices of interfaces that changed; numbers are given in linear passes. `run` changes no bit.
    bool update(std::span<const uint8_t> interface_intact, const RangeRunner& run = run_serially);

    const FragmentFaces& faces() const { return faces_; }

    std::span<const uint32_t> triangle_face() const { return triangle_face_; }  // listed faces, ascending
    const SharedArray<Triangle>& triangles() const { return triangles_; }       // of visual vertices
    /// 1: at an interface that holds, or both sides of a broken one on the same three vertices. ListedFaces::visible
    /// lists none of them. (n_faces)
    std::span<const uint8_t> face_hidden() const { return face_hidden_; }
    bool is_listed(uint32_t face) const { return listed_ == ListedFaces::all || !face_hidden_[face]; }
    bool are_all_listed() const { return listed_ == ListedFaces::all; }
    /// Faces whose entry there the last update that changed something changed (at the first one: that are hidden).
    std::span<const uint32_t> flipped_faces() const { return flipped_faces_; }

    size_t n_vertices() const { return vertex_class_.size(); }
    /// Fan that a visual vertex is numbered by, the lowest of those that hang together in it; ascending.
    uint32_t vertex_class(uint32_t vertex) const { return vertex_class_[vertex]; }
    std::span<const uint32_t> vertex_classes() const { return vertex_class_; }
    /// Pool vertex of a visual vertex; visual vertices are ascending by it.
    uint32_t pool_vertex(uint32_t vertex) const { return fan_vertex_[vertex_class_[vertex]]; }
    /// Fans, the instances of vertices of section 4.2: their number and order do not change while fracture goes on.
    size_t n_fans() const { return fan_vertex_.size(); }
    uint32_t fan_pool_vertex(uint32_t fan) const { return fan_vertex_[fan]; }
    std::span<const uint32_t> fan_pool_vertices() const { return fan_vertex_; }  // (n_fans)
    uint32_t fan_fragment(uint32_t fan) const { return fan_fragment_[fan]; }
    std::span<const uint32_t> fan_fragments() const { return fan_fragment_; }  // (n_fans)
    /// Fans of a pool vertex are those from its own to the next one's. (n_vertices of the pool + 1)
    uint32_t first_fan(uint32_t pool_vertex) const { return fan_offset_[pool_vertex]; }
    std::span<const uint32_t> first_fans() const { return fan_offset_; }
    /// Fans of one pool vertex with the same class hang together there.
    uint32_t fan_class(uint32_t fan) const { return fan_class_[fan]; }
    std::span<const uint32_t> fan_classes() const { return fan_class_; }  // (n_fans)
    /// Pool vertices around which the last update that changed something joined fans anew, listed a face or hid one.
    std::span<const uint32_t> changed_vertices() const { return changed_vertices_; }
    bool is_changed(uint32_t pool_vertex) const { return vertex_changed_[pool_vertex]; }
    std::span<const uint8_t> changed() const {
        return vertex_changed_;
    }  // 1: is one of them    (n_vertices of the pool)
    /// Whether one of a chunk is among them.
    bool any_changed(size_t chunk) const {
        const auto begin = vertex_changed_.begin();
        const size_t first = chunk * kChunk, last = std::min<size_t>(first + kChunk, faces_.n_vertices);
        return std::find(begin + first, begin + last, 1) != begin + last;
    }
    uint32_t corner_fan(uint32_t corner) const { return corner_fan_[corner]; }  // corner: of FragmentFaces
    /// The visual vertex that a fan is an instance of; kNone: it is not seen.
    uint32_t vertex_of_fan(uint32_t fan) const { return fan_visual_[fan]; }
    std::span<const uint32_t> vertices_of_fans() const { return fan_visual_; }  // (n_fans)
    /// Pool vertices [chunk kChunk, (chunk + 1) kChunk) are what a thread takes at a time. Their visual vertices are
    /// those from this one to the next chunk's.
    uint32_t chunk_vertex(size_t chunk) const { return chunk_vertex_[chunk]; }
    /// Their fans, likewise.
    uint32_t chunk_fan(size_t chunk) const { return fan_offset_[std::min<size_t>(chunk * kChunk, faces_.n_vertices)]; }
    size_t n_chunks() const { return (faces_.n_vertices + kChunk - 1) / kChunk; }
    /// Fragments connected at the vertex that is numbered by a fan, ascending.
    void fragments_of_class(uint32_t fan, std::vector<uint32_t>& out) const;
    void connected_fragments(uint32_t vertex, std::vector<uint32_t>& out) const {
        fragments_of_class(vertex_class_[vertex], out);
    }

    static constexpr uint32_t kChunk = 256;

private:
    struct Join {
        uint32_t fan_a, fan_b, interface;
    };

    Status make_fans();
    void make_joins();
    void find_changed_vertices(std::span<const uint8_t> interface_intact);
    void unite_fans_around(uint32_t pool_vertex);
    bool is_hidden(uint32_t face) const;
    void hide_faces(const RangeRunner& run);
    void find_seen_classes(uint32_t pool_vertex);
    void number_vertices(const RangeRunner& run);
    void list_triangles(const RangeRunner& run);

    FragmentFaces faces_;
    ListedFaces listed_ = ListedFaces::visible;
    std::vector<uint32_t> corner_fan_;    // fan of each face corner                 (3 n_faces)
    std::vector<uint32_t> fan_vertex_;    // fans ascending by (pool vertex, fragment)   (n_fans)
    std::vector<uint32_t> fan_fragment_;  // (n_fans)
    std::vector<uint32_t> fan_offset_;    // fans of a pool vertex                   (n_vertices + 1)
    std::vector<Join> joins_;
    std::vector<uint32_t> join_offset_;       // joins at a pool vertex                  (n_vertices + 1)
    std::vector<uint32_t> interface_offset_;  // side-a faces of an interface            (n_interfaces + 1)
    std::vector<uint32_t> interface_face_;

    std::vector<uint8_t> interface_intact_;  // of the last update
    std::vector<uint8_t> vertex_changed_;    // by it                                   (n_vertices)
    std::vector<uint32_t> changed_vertices_, flipped_faces_;
    std::vector<std::vector<uint32_t>> chunk_flips_;  // scratch of hide_faces
    std::vector<uint32_t> fan_class_;                 // lowest fan that a fan hangs together with     (n_fans)
    std::vector<uint32_t> fan_listed_;                // how many of its corners are of listed faces     (n_fans)
    std::vector<uint8_t> class_seen_;                 // 1: a listed face has it                       (n_fans)
    std::vector<uint8_t> face_hidden_;                // (n_faces)
    std::vector<uint32_t> vertex_class_, chunk_vertex_, fan_visual_;
    std::vector<uint32_t> triangle_face_;
    ArrayRecycler<Triangle> recycler_;
    SharedArray<Triangle> triangles_;
};

}  // namespace sunder
