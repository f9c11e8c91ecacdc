#include "fracture_tools/split_topology.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <tuple>

#include "fracture_tools/disjoint_sets.h"

namespace sunder {

Result<SplitTopology> SplitTopology::make(FragmentFaces faces, ListedFaces listed) {
    SplitTopology topology;
    topology.faces_ = std::move(faces);
    topology.listed_ = listed;
    if (Status s = topology.make_fans(); !s) return s.error();
    topology.make_joins();
    return topology;
}

// A fan is a set of corners of one fragment at one vertex, united along each edge that leaves the vertex. All faces at
// an edge are united, also where a fragment touches itself along it: no pairing is needed, and the edge stays balanced.
Status SplitTopology::make_fans() {
    const uint32_t n_corners = 3 * faces_.n_faces();
    struct EdgeEnd {
        uint32_t vertex, fragment, other, corner;
        bool leaves;  // the face runs from `vertex` to `other`
    };
    std::vector<EdgeEnd> ends;
    ends.reserve(2 * size_t{n_corners});
    for (uint32_t f = 0; f < faces_.n_faces(); ++f)
        for (uint32_t c = 0; c < 3; ++c) {
            const Triangle& t = faces_.triangles[f];
            ends.push_back({t[c], faces_.fragment[f], t[(c + 1) % 3], 3 * f + c, true});
            ends.push_back({t[c], faces_.fragment[f], t[(c + 2) % 3], 3 * f + c, false});
        }
    auto key = [](const EdgeEnd& e) { return std::tuple(e.vertex, e.fragment, e.other); };
    std::sort(ends.begin(), ends.end(), [&](const EdgeEnd& x, const EdgeEnd& y) {
        return std::tuple_cat(key(x), std::tuple(x.corner)) < std::tuple_cat(key(y), std::tuple(y.corner));
    });

    std::vector<uint32_t> parent = disjoint_sets(n_corners);
    for (size_t i = 0; i < ends.size();) {
        int surplus = 0;
        size_t j = i;
        for (; j < ends.size() && key(ends[j]) == key(ends[i]); ++j) {
            surplus += ends[j].leaves ? 1 : -1;
            unite(parent, ends[i].corner, ends[j].corner);
        }
        if (surplus != 0)
            return bad_input("fragment " + std::to_string(ends[i].fragment),
                             "the surface is open at the edge between vertices " + std::to_string(ends[i].vertex) +
                                 " and " + std::to_string(ends[i].other),
                             "fracture the mesh again");
        i = j;
    }

    // `ends` meets corners in the order of (vertex, fragment): number fans as they come up.
    corner_fan_.assign(n_corners, kNone);
    fan_offset_.assign(faces_.n_vertices + 1, 0);
    for (const EdgeEnd& e : ends) {
        uint32_t& fan = corner_fan_[lowest(parent, e.corner)];
        if (fan != kNone) continue;
        fan = static_cast<uint32_t>(fan_vertex_.size());
        fan_vertex_.push_back(e.vertex);
        fan_fragment_.push_back(e.fragment);
        ++fan_offset_[e.vertex + 1];
    }
    for (uint32_t c = 0; c < n_corners; ++c) corner_fan_[c] = corner_fan_[lowest(parent, c)];
    std::partial_sum(fan_offset_.begin(), fan_offset_.end(), fan_offset_.begin());
    return {};
}

void SplitTopology::make_joins() {
    auto by_vertex_first = [&](const Join& j) {
        return std::tuple(fan_vertex_[j.fan_a], j.fan_a, j.fan_b, j.interface);
    };
    uint32_t n_interfaces = 0;
    for (uint32_t f = faces_.n_outer; f < faces_.n_outer + faces_.n_interface; ++f) {
        n_interfaces = std::max(n_interfaces, faces_.interface[f] + 1);
        for (int c = 0; c < 3; ++c)
            joins_.push_back({corner_fan_[3 * f + c], corner_fan_[3 * faces_.twin(f) + FragmentFaces::twin_corner(c)],
                              faces_.interface[f]});
    }
    std::sort(joins_.begin(), joins_.end(),
              [&](const Join& x, const Join& y) { return by_vertex_first(x) < by_vertex_first(y); });
    joins_.erase(std::unique(joins_.begin(), joins_.end(),
                             [&](const Join& x, const Join& y) { return by_vertex_first(x) == by_vertex_first(y); }),
                 joins_.end());
    join_offset_.assign(faces_.n_vertices + 1, 0);
    for (const Join& j : joins_) ++join_offset_[fan_vertex_[j.fan_a] + 1];
    std::partial_sum(join_offset_.begin(), join_offset_.end(), join_offset_.begin());

    interface_offset_.assign(n_interfaces + 1, 0);
    interface_face_.resize(faces_.n_interface);
    for (uint32_t f = faces_.n_outer; f < faces_.n_outer + faces_.n_interface; ++f)
        ++interface_offset_[faces_.interface[f] + 1];
    std::partial_sum(interface_offset_.begin(), interface_offset_.end(), interface_offset_.begin());
    std::vector<uint32_t> next(interface_offset_.begin(), interface_offset_.end() - 1);
    for (uint32_t f = faces_.n_outer; f < faces_.n_outer + faces_.n_interface; ++f)
        interface_face_[next[faces_.interface[f]]++] = f;
}

bool SplitTopology::update(std::span<const uint8_t> interface_intact) {
    const bool first = fan_class_.empty();
    if (!first && std::equal(interface_intact.begin(), interface_intact.end(), interface_intact_.begin(),
                             interface_intact_.end())) {
        std::iota(previous_vertex_.begin(), previous_vertex_.end(), 0u);
        return false;
    }

    std::vector<uint8_t> vertex_changed(faces_.n_vertices, first);
    changed_vertices_.clear();
    if (first) {
        changed_vertices_.resize(faces_.n_vertices);
        std::iota(changed_vertices_.begin(), changed_vertices_.end(), 0u);
        fan_class_.resize(fan_vertex_.size());
        class_vertex_.assign(fan_vertex_.size(), kNone);
        for (uint32_t v = 0; v < faces_.n_vertices; ++v) unite_fans_around(v, interface_intact);
    } else {
        assert(interface_intact.size() == interface_intact_.size());
        for (size_t i = 0; i + 1 < interface_offset_.size(); ++i) {
            if (bool(interface_intact[i]) == bool(interface_intact_[i])) continue;
            for (uint32_t s = interface_offset_[i]; s < interface_offset_[i + 1]; ++s)
                for (uint32_t v : faces_.triangles[interface_face_[s]])
                    if (!vertex_changed[v]) {
                        vertex_changed[v] = 1, changed_vertices_.push_back(v);
                        unite_fans_around(v, interface_intact);
                    }
        }
    }
    interface_intact_.assign(interface_intact.begin(), interface_intact.end());
    list_triangles(interface_intact);
    number_vertices(vertex_changed);
    return true;
}

void SplitTopology::unite_fans_around(uint32_t v, std::span<const uint8_t> interface_intact) {
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan) fan_class_[fan] = fan;
    for (uint32_t j = join_offset_[v]; j < join_offset_[v + 1]; ++j)
        if (interface_intact[joins_[j].interface]) unite(fan_class_, joins_[j].fan_a, joins_[j].fan_b);
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan) fan_class_[fan] = lowest(fan_class_, fan);
}

// Triangles of classes here; number_vertices turns them into visual vertices.
void SplitTopology::list_triangles(std::span<const uint8_t> interface_intact) {
    triangle_face_.clear(), triangles_.clear(), triangle_hidden_.clear();
    auto class_of = [&](uint32_t corner) { return fan_class_[corner_fan_[corner]]; };
    for (uint32_t f = 0; f < faces_.n_faces(); ++f) {
        const Triangle t = {class_of(3 * f), class_of(3 * f + 1), class_of(3 * f + 2)};
        bool hidden = false;
        if (!faces_.is_outer(f)) {
            // Both sides on the same three vertices enclose nothing: a blister inside of a body that still holds
            // together all around. It would be a component of its own, with no volume.
            const uint32_t twin = 3 * faces_.twin(f);
            hidden = interface_intact[faces_.interface[f]] ||
                     (t[0] == class_of(twin) && t[1] == class_of(twin + 2) && t[2] == class_of(twin + 1));
        }
        if (hidden && listed_ == ListedFaces::visible) continue;
        triangle_face_.push_back(f);
        triangles_.push_back(t);
        triangle_hidden_.push_back(hidden);
    }
}

void SplitTopology::number_vertices(const std::vector<uint8_t>& vertex_changed) {
    std::vector<uint8_t> seen(fan_vertex_.size(), 0);
    for (const Triangle& t : triangles_)
        for (uint32_t c : t) seen[c] = 1;
    vertex_class_.clear();
    previous_vertex_.clear();
    for (uint32_t c = 0; c < seen.size(); ++c) {
        const uint32_t before = class_vertex_[c];
        class_vertex_[c] = kNone;
        if (!seen[c]) continue;
        class_vertex_[c] = static_cast<uint32_t>(vertex_class_.size());
        vertex_class_.push_back(c);
        previous_vertex_.push_back(vertex_changed[fan_vertex_[c]] ? kNone : before);
    }
    for (Triangle& t : triangles_)
        for (uint32_t& corner : t) corner = class_vertex_[corner];
}

void SplitTopology::connected_fragments(uint32_t vertex, std::vector<uint32_t>& out) const {
    out.clear();
    const uint32_t joined = vertex_class_[vertex], v = fan_vertex_[joined];
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan)
        if (fan_class_[fan] == joined && (out.empty() || out.back() != fan_fragment_[fan]))
            out.push_back(fan_fragment_[fan]);
}

}  // namespace sunder
