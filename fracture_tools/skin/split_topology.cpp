#include "fracture_tools/skin/split_topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "fracture_tools/mesh/counting_sort.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/invariant.h"

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
    const auto vertex_of = [&](uint32_t corner) { return faces_.triangles[corner / 3][corner % 3]; };
    const Groups around = group_by(n_corners, faces_.n_vertices, vertex_of);
    struct EdgeEnd {  // of one vertex
        uint32_t fragment, other, corner;
        bool leaves;  // the face runs from the vertex to `other`
        auto edge() const { return std::pair(fragment, other); }
    };
    std::vector<EdgeEnd> ends;
    std::vector<uint32_t> parent = disjoint_sets(n_corners);
    corner_fan_.assign(n_corners, kNone);
    fan_offset_.assign(1, 0), fan_offset_.reserve(faces_.n_vertices + 1);
    for (uint32_t v = 0; v < faces_.n_vertices; ++v) {
        ends.clear();
        for (const uint32_t corner : around[v]) {
            const Triangle& t = faces_.triangles[corner / 3];
            const uint32_t c = corner % 3, fragment = faces_.fragment[corner / 3];
            ends.push_back({fragment, t[(c + 1) % 3], corner, true});
            ends.push_back({fragment, t[(c + 2) % 3], corner, false});
        }
        std::sort(ends.begin(), ends.end(), [](const EdgeEnd& x, const EdgeEnd& y) {
            return std::tuple(x.fragment, x.other, x.corner) < std::tuple(y.fragment, y.other, y.corner);
        });
        for (size_t i = 0; i < ends.size();) {
            int surplus = 0;
            size_t j = i;
            for (; j < ends.size() && ends[j].edge() == ends[i].edge(); ++j) {
                surplus += ends[j].leaves ? 1 : -1;
                unite(parent, ends[i].corner, ends[j].corner);
            }
            if (surplus != 0)
                return bad_input("fragment " + std::to_string(ends[i].fragment),
                                 "the surface is open at the edge between vertices " + std::to_string(v) + " and " +
                                     std::to_string(ends[i].other),
                                 "fracture the mesh again");
            i = j;
        }
        for (const EdgeEnd& e : ends) {  // in the order of fragments: number fans as they come up
            uint32_t& fan = corner_fan_[lowest(parent, e.corner)];
            if (fan != kNone) continue;
            fan = static_cast<uint32_t>(fan_vertex_.size());
            fan_vertex_.push_back(v), fan_fragment_.push_back(e.fragment);
        }
        fan_offset_.push_back(static_cast<uint32_t>(fan_vertex_.size()));
    }
    for (uint32_t c = 0; c < n_corners; ++c) corner_fan_[c] = corner_fan_[lowest(parent, c)];
    fan_listed_.assign(n_fans(), 0);
    for (const uint32_t fan : corner_fan_) ++fan_listed_[fan];
    return {};
}

void SplitTopology::make_joins() {
    std::vector<Join> all;
    all.reserve(3 * size_t{faces_.n_interface});
    uint32_t n_interfaces = 0;
    for (uint32_t f = faces_.n_outer; f < faces_.n_outer + faces_.n_interface; ++f) {
        n_interfaces = std::max(n_interfaces, faces_.interface[f] + 1);
        for (int c = 0; c < 3; ++c)
            all.push_back({corner_fan_[3 * f + c], corner_fan_[3 * faces_.twin(f) + FragmentFaces::twin_corner(c)],
                           faces_.interface[f]});
    }
    const auto key = [](const Join& j) { return std::tuple(j.fan_a, j.fan_b, j.interface); };
    const Groups at = group_by(static_cast<uint32_t>(all.size()), faces_.n_vertices,
                               [&](uint32_t j) { return fan_vertex_[all[j].fan_a]; });
    std::vector<Join> here;
    join_offset_.assign(1, 0), join_offset_.reserve(faces_.n_vertices + 1);
    for (uint32_t v = 0; v < faces_.n_vertices; ++v) {
        here.clear();
        for (const uint32_t j : at[v]) here.push_back(all[j]);
        std::sort(here.begin(), here.end(), [&](const Join& x, const Join& y) { return key(x) < key(y); });
        const auto end =
            std::unique(here.begin(), here.end(), [&](const Join& x, const Join& y) { return key(x) == key(y); });
        joins_.insert(joins_.end(), here.begin(), end);
        join_offset_.push_back(static_cast<uint32_t>(joins_.size()));
    }

    Groups of_interface =
        group_by(faces_.n_interface, n_interfaces, [&](uint32_t i) { return faces_.interface[faces_.n_outer + i]; });
    interface_offset_ = std::move(of_interface.offset), interface_face_ = std::move(of_interface.member);
    for (uint32_t& face : interface_face_) face += faces_.n_outer;
}

bool SplitTopology::update(std::span<const uint8_t> interface_intact, const RangeRunner& run) {
    const bool first = fan_class_.empty();
    if (!first && std::equal(interface_intact.begin(), interface_intact.end(), interface_intact_.begin(),
                             interface_intact_.end()))
        return false;
    if (first) {
        changed_vertices_.resize(faces_.n_vertices);
        std::iota(changed_vertices_.begin(), changed_vertices_.end(), 0u);
        vertex_changed_.assign(faces_.n_vertices, 1);
        fan_class_.resize(n_fans()), fan_visual_.resize(n_fans()), class_seen_.resize(n_fans());
        face_hidden_.assign(faces_.n_faces(), 0);
        triangle_face_.reserve(faces_.n_faces()), vertex_class_.reserve(n_fans());
    } else {
        find_changed_vertices(interface_intact);
    }
    interface_intact_.assign(interface_intact.begin(), interface_intact.end());

    constexpr size_t kGrain = 128;  // vertices
    run(changed_vertices_.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) unite_fans_around(changed_vertices_[i]);
    });
    hide_faces(run);
    run(changed_vertices_.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) find_seen_classes(changed_vertices_[i]);
    });
    number_vertices(run);
    list_triangles(run);
    return true;
}

void SplitTopology::find_changed_vertices(std::span<const uint8_t> interface_intact) {
    SUNDER_ASSERT(interface_intact.size() == interface_intact_.size());
    for (uint32_t v : changed_vertices_) vertex_changed_[v] = 0;
    changed_vertices_.clear();
    for (size_t i = 0; i + 1 < interface_offset_.size(); ++i) {
        if (bool(interface_intact[i]) == bool(interface_intact_[i])) continue;
        for (uint32_t s = interface_offset_[i]; s < interface_offset_[i + 1]; ++s)
            for (uint32_t v : faces_.triangles[interface_face_[s]]) vertex_changed_[v] = 1;
    }
    // In ascending order, in which what is kept about them lies in memory.
    for (uint32_t v = 0; v < faces_.n_vertices; ++v)
        if (vertex_changed_[v]) changed_vertices_.push_back(v);
}

void SplitTopology::unite_fans_around(uint32_t v) {
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan) fan_class_[fan] = fan;
    for (uint32_t j = join_offset_[v]; j < join_offset_[v + 1]; ++j)
        if (interface_intact_[joins_[j].interface]) unite(fan_class_, joins_[j].fan_a, joins_[j].fan_b);
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan) fan_class_[fan] = lowest(fan_class_, fan);
}

bool SplitTopology::is_hidden(uint32_t f) const {
    if (faces_.is_outer(f)) return false;
    if (interface_intact_[faces_.interface[f]]) return true;
    // Both sides on the same three vertices enclose nothing: a blister inside of a body that still holds together all
    // around. It would be a component of its own, with no volume.
    const auto class_of = [&](uint32_t face, int c) { return fan_class_[corner_fan_[3 * face + c]]; };
    const uint32_t twin = faces_.twin(f);
    return class_of(f, 0) == class_of(twin, 0) && class_of(f, 1) == class_of(twin, 2) &&
           class_of(f, 2) == class_of(twin, 1);
}

// Looks at the faces around changed vertices: at all side-a faces in their order, which takes less than to find those
// around one vertex after the other, and their twins go with them. Vertices of those that come or go have changed, too:
// a class may be seen for the first time where no fan was joined anew.
void SplitTopology::hide_faces(const RangeRunner& run) {
    constexpr size_t kFaces = 2048;  // of a chunk
    const size_t n = faces_.n_interface, n_chunks = (n + kFaces - 1) / kFaces;
    chunk_flips_.resize(n_chunks);
    run(n_chunks, 1, [&](size_t begin, size_t end) {
        for (size_t chunk = begin; chunk < end; ++chunk) {
            std::vector<uint32_t>& flips = chunk_flips_[chunk];
            flips.clear();
            const uint8_t* const changed = vertex_changed_.data();
            for (size_t i = chunk * kFaces; i < std::min(n, (chunk + 1) * kFaces); ++i) {
                const uint32_t f = faces_.n_outer + static_cast<uint32_t>(i);
                const Triangle& t = faces_.triangles[f];
                if (!(changed[t[0]] | changed[t[1]] | changed[t[2]])) continue;
                if (is_hidden(f) != bool(face_hidden_[f])) flips.push_back(f);
            }
        }
    });
    flipped_faces_.clear();
    for (const std::vector<uint32_t>& flips : chunk_flips_)
        for (const uint32_t f : flips) {
            for (const uint32_t side : {f, faces_.twin(f)}) {
                face_hidden_[side] = !face_hidden_[side];
                flipped_faces_.push_back(side);
                if (are_all_listed()) continue;
                for (uint32_t c = 0; c < 3; ++c) fan_listed_[corner_fan_[3 * side + c]] += face_hidden_[side] ? -1 : 1;
            }
            for (const uint32_t v : faces_.triangles[f])
                if (!vertex_changed_[v]) vertex_changed_[v] = 1, changed_vertices_.push_back(v);
        }
}

void SplitTopology::find_seen_classes(uint32_t v) {
    std::fill(class_seen_.begin() + fan_offset_[v], class_seen_.begin() + fan_offset_[v + 1], 0);
    for (uint32_t fan = fan_offset_[v]; fan < fan_offset_[v + 1]; ++fan)
        class_seen_[fan_class_[fan]] |= fan_listed_[fan] > 0;
}

void SplitTopology::number_vertices(const RangeRunner& run) {
    chunk_vertex_.assign(n_chunks() + 1, 0);
    for (size_t chunk = 0; chunk < n_chunks(); ++chunk)
        chunk_vertex_[chunk + 1] =
            chunk_vertex_[chunk] +
            std::accumulate(class_seen_.begin() + chunk_fan(chunk), class_seen_.begin() + chunk_fan(chunk + 1), 0u);
    vertex_class_.resize(chunk_vertex_.back());
    run(n_chunks(), 4, [&](size_t begin, size_t end) {
        for (size_t chunk = begin; chunk < end; ++chunk) {
            uint32_t vertex = chunk_vertex_[chunk];
            for (uint32_t fan = chunk_fan(chunk), last = chunk_fan(chunk + 1); fan < last; ++fan) {
                if (fan_class_[fan] != fan) {  // its class is a fan before it, of the same pool vertex
                    fan_visual_[fan] = fan_visual_[fan_class_[fan]];
                    continue;
                }
                fan_visual_[fan] = class_seen_[fan] ? vertex : kNone;
                if (class_seen_[fan]) vertex_class_[vertex++] = fan;
            }
        }
    });
}

void SplitTopology::list_triangles(const RangeRunner& run) {
    constexpr uint32_t kFaces = 1024;  // of a chunk
    const uint32_t n_faces = faces_.n_faces(), n_chunks = (n_faces + kFaces - 1) / kFaces;
    std::vector<uint32_t> first(n_chunks + 1, 0);
    for (uint32_t chunk = 0; chunk < n_chunks; ++chunk) {
        const uint32_t begin = chunk * kFaces, end = std::min(n_faces, begin + kFaces);
        first[chunk + 1] = first[chunk] + end - begin;
        if (listed_ == ListedFaces::visible)
            first[chunk + 1] -= std::accumulate(face_hidden_.begin() + begin, face_hidden_.begin() + end, 0u);
    }
    const bool is_new = triangle_face_.empty();  // outer faces are all listed, in every frame
    triangle_face_.resize(first.back());
    triangles_ = {};
    auto& slot = recycler_.take(first.back(), n_faces);
    run(n_chunks, 2, [&](size_t begin, size_t end) {
        const bool all = listed_ == ListedFaces::all;
        const uint8_t* const hidden = face_hidden_.data();
        const uint32_t *const fan = corner_fan_.data(), *const visual = fan_visual_.data();
        for (uint32_t chunk = static_cast<uint32_t>(begin); chunk < end; ++chunk) {
            Triangle* out = slot.object->data() + first[chunk];
            uint32_t* face = triangle_face_.data() + first[chunk];
            uint32_t f = chunk * kFaces;
            const uint32_t last = std::min(n_faces, f + kFaces), last_outer = std::min(faces_.n_outer, last);
            if (is_new)
                for (uint32_t outer = f; outer < last_outer; ++outer) face[outer - f] = outer;
            if (f < last_outer) face += last_outer - f;
            for (; f < last_outer; ++f) *out++ = {visual[fan[3 * f]], visual[fan[3 * f + 1]], visual[fan[3 * f + 2]]};
            for (; f < last; ++f) {
                if (!all && hidden[f]) continue;
                *out++ = {visual[fan[3 * f]], visual[fan[3 * f + 1]], visual[fan[3 * f + 2]]};
                *face++ = f;
            }
        }
    });
    triangles_ = ArrayRecycler<Triangle>::share(slot);
}

void SplitTopology::fragments_of_class(uint32_t joined, std::vector<uint32_t>& out) const {
    const uint32_t last = fan_offset_[fan_vertex_[joined] + 1];
    out.resize(last - joined);
    out[0] = fan_fragment_[joined];
    size_t n = 1;
    for (uint32_t fan = joined + 1; fan < last; ++fan)
        if (fan_class_[fan] == joined && out[n - 1] != fan_fragment_[fan]) out[n++] = fan_fragment_[fan];
    out.resize(n);
}

}  // namespace sunder
