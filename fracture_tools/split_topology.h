// Which vertices and faces the visual mesh has while fracture goes on (Choi 2014, section 4.1 and Fig. 2).
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/fragment_faces.h"
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
    /// `interface_intact` (n_interfaces) alone. Fans are joined anew only around vertices of interfaces that changed;
    /// numbering and listing are one linear pass over all faces (about 10 ns a face).
    bool update(std::span<const uint8_t> interface_intact);

    const FragmentFaces& faces() const { return faces_; }

    std::span<const uint32_t> triangle_face() const { return triangle_face_; }  // listed faces, ascending
    std::span<const Triangle> triangles() const { return triangles_; }          // of visual vertices
    /// 1: at an interface that holds, or both sides of a broken one on the same three vertices. ListedFaces::visible
    /// lists none of them. (n_triangles)
    std::span<const uint8_t> triangle_hidden() const { return triangle_hidden_; }
    size_t n_vertices() const { return vertex_class_.size(); }
    /// Pool vertex of a visual vertex; visual vertices are ascending by it.
    uint32_t pool_vertex(uint32_t vertex) const { return fan_vertex_[vertex_class_[vertex]]; }
    /// Number that the vertex had before the last update if the fragments around it are the same ones, else kNone.
    uint32_t previous_vertex(uint32_t vertex) const { return previous_vertex_[vertex]; }
    /// Fans, the instances of vertices of section 4.2: their number and order do not change while fracture goes on.
    size_t n_fans() const { return fan_vertex_.size(); }
    uint32_t fan_pool_vertex(uint32_t fan) const { return fan_vertex_[fan]; }
    /// Fans of one pool vertex with the same class hang together there.
    uint32_t fan_class(uint32_t fan) const { return fan_class_[fan]; }
    /// Pool vertices around which fans were joined anew by the last update that changed something.
    std::span<const uint32_t> changed_vertices() const { return changed_vertices_; }
    uint32_t corner_fan(uint32_t corner) const { return corner_fan_[corner]; }  // corner: of FragmentFaces
    /// The visual vertex that a fan is an instance of; kNone: it is not seen.
    uint32_t vertex_of_fan(uint32_t fan) const { return class_vertex_[fan_class_[fan]]; }
    /// Fragments connected at the vertex, ascending.
    void connected_fragments(uint32_t vertex, std::vector<uint32_t>& out) const;

    static constexpr uint32_t kNone = 0xffffffffu;

private:
    struct Join {
        uint32_t fan_a, fan_b, interface;
    };

    Status make_fans();
    void make_joins();
    void unite_fans_around(uint32_t pool_vertex, std::span<const uint8_t> interface_intact);
    void list_triangles(std::span<const uint8_t> interface_intact);
    void number_vertices(const std::vector<uint8_t>& vertex_changed);

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
    std::vector<uint32_t> changed_vertices_;
    std::vector<uint32_t> fan_class_;     // lowest fan that a fan hangs together with   (n_fans)
    std::vector<uint32_t> class_vertex_;  // visual vertex of a class, kNone: unseen     (n_fans)
    std::vector<uint32_t> vertex_class_, previous_vertex_;
    std::vector<uint32_t> triangle_face_;
    std::vector<Triangle> triangles_;
    std::vector<uint8_t> triangle_hidden_;
};

}  // namespace sunder
