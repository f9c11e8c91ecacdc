#include "fracture_tools/fragments/fragment_faces.h"

#include <algorithm>

namespace sunder {
namespace {

Error broken_set(std::string what) { return bad_input("fragments", std::move(what), "fracture the mesh again"); }

Status check_attributes(const FragmentSet& set) {
    auto is_empty_or = [](size_t size, size_t wanted) { return size == 0 || size == wanted; };
    const size_t outer = set.outer_triangles.size(), cut = set.interface_triangles.size();
    if (set.outer_material.size() != outer)
        return broken_set("there are " + std::to_string(set.outer_material.size()) + " materials for " +
                          std::to_string(outer) + " outer triangles");
    if (!is_empty_or(set.outer_corner_uvs.size(), 3 * outer)) return broken_set("outer UVs are not three a triangle");
    if (!is_empty_or(set.outer_corner_normals.size(), 3 * outer))
        return broken_set("outer normals are not three a triangle");
    if (!is_empty_or(set.interface_corner_uvs.size(), 3 * cut))
        return broken_set("interface UVs are not three a triangle");
    if (!is_empty_or(set.outer_corner_colors.size(), 3 * outer))
        return broken_set("outer colours are not three a triangle");
    if (!is_empty_or(set.interface_corner_rim.size(), 3 * cut))
        return broken_set("the rim's marks are not three a triangle");
    for (const MeshLayer& layer : set.outer_layers)
        if (layer.values.size() != layer.width * (layer.domain == LayerDomain::face ? outer : 3 * outer))
            return broken_set("layer '" + layer.name + "' has not a row for each " +
                              (layer.domain == LayerDomain::face ? "outer triangle" : "corner of an outer triangle"));
    for (size_t v = 0; v < set.vertices.size(); ++v)
        if (!set.vertices[v].allFinite()) return broken_set("vertex " + std::to_string(v) + " is not finite");
    return {};
}

Status check_triangles(const std::vector<Triangle>& triangles, size_t n_vertices, const char* kind) {
    for (size_t t = 0; t < triangles.size(); ++t) {
        const auto [a, b, c] = triangles[t];
        if (std::max({a, b, c}) >= n_vertices || a == b || b == c || c == a)
            return broken_set(std::string(kind) + " triangle " + std::to_string(t) +
                              " has no three vertices of the set");
    }
    return {};
}

}  // namespace

Result<FragmentFaces> make_fragment_faces(const FragmentSet& set) {
    if (set.fragments.empty()) return broken_set("there are none");
    if (Status s = check_attributes(set); !s) return s.error();
    if (Status s = check_triangles(set.outer_triangles, set.vertices.size(), "outer"); !s) return s.error();
    if (Status s = check_triangles(set.interface_triangles, set.vertices.size(), "interface"); !s) return s.error();

    FragmentFaces faces;
    faces.n_outer = static_cast<uint32_t>(set.outer_triangles.size());
    faces.n_interface = static_cast<uint32_t>(set.interface_triangles.size());
    faces.n_vertices = static_cast<uint32_t>(set.vertices.size());
    faces.n_fragments = static_cast<uint32_t>(set.fragments.size());
    faces.triangles = set.outer_triangles;
    faces.triangles.resize(faces.n_faces());
    faces.fragment.assign(faces.n_faces(), kNone);
    faces.interface.assign(faces.n_faces(), kNone);

    for (uint32_t i = 0; i < faces.n_fragments; ++i) {
        const Fragment& fragment = set.fragments[i];
        if (fragment.outer_begin > fragment.outer_end || fragment.outer_end > faces.n_outer)
            return broken_set("fragment " + std::to_string(i) + " has outer triangles that do not exist");
        std::fill(faces.fragment.begin() + fragment.outer_begin, faces.fragment.begin() + fragment.outer_end, i);
    }
    for (uint32_t i = 0; i < set.interfaces.size(); ++i) {
        const Interface& face = set.interfaces[i];
        const std::string name = "interface " + std::to_string(i);
        if (face.a >= face.b || face.b.index() >= faces.n_fragments)
            return broken_set(name + " joins no two fragments of the set");
        if (i > 0 && std::pair(set.interfaces[i - 1].a, set.interfaces[i - 1].b) >= std::pair(face.a, face.b))
            return broken_set(name + " is not in ascending order of its fragments");
        if (face.triangle_begin > face.triangle_end || face.triangle_end > faces.n_interface)
            return broken_set(name + " has triangles that do not exist");
        for (uint32_t t = face.triangle_begin; t < face.triangle_end; ++t) {
            const uint32_t side_a = faces.n_outer + t, side_b = faces.twin(side_a);
            const auto [v0, v1, v2] = set.interface_triangles[t];
            faces.triangles[side_a] = {v0, v1, v2};
            faces.triangles[side_b] = {v0, v2, v1};
            faces.fragment[side_a] = face.a.value;
            faces.fragment[side_b] = face.b.value;
            faces.interface[side_a] = faces.interface[side_b] = i;
        }
    }
    for (uint32_t f = 0; f < faces.n_faces(); ++f)
        if (faces.fragment[f] == kNone)
            return broken_set(faces.is_outer(f) ? "outer triangle " + std::to_string(f) + " belongs to no fragment"
                                                : "an interface triangle belongs to no interface");
    return faces;
}

}  // namespace sunder
