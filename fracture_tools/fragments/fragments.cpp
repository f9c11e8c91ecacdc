#include "fracture_tools/fragments/fragments.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "fracture_tools/fragments/interfaces.h"
#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/corner_normals.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_rows.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/mesh/surface_uvs.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

Triangle reversed(const Triangle& t) { return {t[0], t[2], t[1]}; }

/// The complex's face that each triangle of the set comes from.
struct SetFaces {
    std::vector<uint32_t> outer, interface;
};

/// Puts the faces that bound fragments into the set, in the set's order.
SetFaces gather_faces(const CellComplex& complex, std::span<const uint32_t> label, FragmentSet& io_set) {
    struct Entry {
        uint32_t a, b, face;
    };  // b: kOutside for outer faces
    std::vector<Entry> outer, cut;
    for (uint32_t i = 0; i < complex.faces.size(); ++i) {
        const CellFace& f = complex.faces[i];
        const uint32_t a = label[f.cell];
        if (f.neighbour == CellFace::kOutside)
            outer.push_back({a, CellFace::kOutside, i});
        else if (const uint32_t b = label[f.neighbour]; a != b)
            cut.push_back({std::min(a, b), std::max(a, b), i});
    }
    auto before = [](const Entry& x, const Entry& y) {
        return std::tie(x.a, x.b, x.face) < std::tie(y.a, y.b, y.face);
    };
    std::sort(outer.begin(), outer.end(), before);
    std::sort(cut.begin(), cut.end(), before);

    SetFaces from;
    std::vector<uint32_t>& outer_face = from.outer;
    size_t next = 0;
    for (uint32_t i = 0; i < io_set.fragments.size(); ++i) {
        io_set.fragments[i].outer_begin = static_cast<uint32_t>(outer_face.size());
        for (; next < outer.size() && outer[next].a == i; ++next) {
            io_set.outer_triangles.push_back(complex.faces[outer[next].face].vertices);
            outer_face.push_back(outer[next].face);
        }
        io_set.fragments[i].outer_end = static_cast<uint32_t>(outer_face.size());
    }
    for (const Entry& e : cut) {
        if (io_set.interfaces.empty() || io_set.interfaces.back().a.value != e.a ||
            io_set.interfaces.back().b.value != e.b) {
            Interface face;
            face.a = FragmentId(e.a);
            face.b = FragmentId(e.b);
            face.triangle_begin = static_cast<uint32_t>(io_set.interface_triangles.size());
            io_set.interfaces.push_back(face);
        }
        const CellFace& f = complex.faces[e.face];
        io_set.interface_triangles.push_back(label[f.cell] == e.a ? f.vertices : reversed(f.vertices));
        io_set.interfaces.back().triangle_end = static_cast<uint32_t>(io_set.interface_triangles.size());
        from.interface.push_back(e.face);
    }
    return from;
}

/// Keeps the vertices that some triangle uses, in their order.
void gather_vertices(const CellComplex& complex, FragmentSet& io_set) {
    std::vector<uint32_t> number(complex.vertices.size(), kNone);
    for (const auto* triangles : {&io_set.outer_triangles, &io_set.interface_triangles})
        for (const Triangle& t : *triangles)
            for (uint32_t v : t) number[v] = 0;
    for (uint32_t v = 0; v < number.size(); ++v)
        if (number[v] != kNone) {
            number[v] = static_cast<uint32_t>(io_set.vertices.size());
            io_set.vertices.push_back(complex.vertices[v]);
        }
    for (auto* triangles : {&io_set.outer_triangles, &io_set.interface_triangles})
        for (Triangle& t : *triangles)
            for (uint32_t& v : t) v = number[v];
}

/// On the source's own surface: each corner has what the source has there. Where it has no normals, what they would be:
/// from the finer triangles others would follow, and show where it will break.
void blend_corners(const CellComplex& complex, const std::vector<uint32_t>& outer_face, const TriMesh& source,
                   FragmentSet& io_set) {
    const std::vector<Vec3f> own_normals =
        source.corner_normals.empty() ? smooth_corner_normals(source) : std::vector<Vec3f>();
    const std::vector<Vec3f>& normals = source.corner_normals.empty() ? own_normals : source.corner_normals;
    for (uint32_t f : outer_face) {
        const uint32_t t = complex.faces[f].source_triangle;
        for (const Vec3& w : complex.source_weights[f]) {
            if (!source.corner_uvs.empty()) io_set.outer_corner_uvs.push_back(blended(source.corner_uvs, t, w));
            if (!source.corner_colors.empty())
                io_set.outer_corner_colors.push_back(blended(source.corner_colors, t, w));
            for (size_t k = 0; k < source.layers.size(); ++k)
                if (source.layers[k].domain != LayerDomain::face)
                    append_at(source, source.layers[k], t, w, io_set.outer_layers[k].values);
            Vec3 n = Vec3::Zero();
            for (int m = 0; m < 3; ++m) n += w[m] * normals[3 * t + m].cast<double>();
            const bool at_corner = w.maxCoeff() == 1;  // as the artist has it, to the last bit
            io_set.outer_corner_normals.push_back(at_corner ? n.cast<float>() : n.normalized().cast<float>());
        }
    }
}

/// On a surface that was meshed anew: colours of the nearest points, and layers by point.
void take_nearest(const CellComplex& complex, const std::vector<uint32_t>& outer_face, const TriMesh& source,
                  FragmentSet& io_set) {
    const SurfaceLookup lookup(source);
    for (uint32_t f : outer_face)
        for (uint32_t v : complex.faces[f].vertices) {
            const SurfacePoint near = lookup.nearest(complex.vertices[v]);
            if (!source.corner_colors.empty())
                io_set.outer_corner_colors.push_back(blended(source.corner_colors, near.triangle, near.barycentric));
            for (size_t k = 0; k < source.layers.size(); ++k)
                if (source.layers[k].domain == LayerDomain::point)
                    append_at(source, source.layers[k], near.triangle, near.barycentric, io_set.outer_layers[k].values);
        }
}

/// On such a surface: UVs, and layers by corner.
void take_corners(const CellComplex& complex, const std::vector<uint32_t>& outer_face, const TriMesh& source,
                  FragmentSet& io_set) {
    const SourceCorners corners(source);
    for (uint32_t f : outer_face) {
        const auto& [a, b, c] = complex.faces[f].vertices;
        const Vec3 middle = (complex.vertices[a] + complex.vertices[b] + complex.vertices[c]) / 3;
        for (uint32_t v : {a, b, c}) {
            const SourceCorners::Place at =
                corners.place(complex.vertices[v], middle, complex.faces[f].source_triangle);
            if (!source.corner_uvs.empty()) io_set.outer_corner_uvs.push_back(corners.uvs(at));
            corners.append_all(at, io_set.outer_layers);
        }
    }
}

void carry_attributes(const CellComplex& complex, const std::vector<uint32_t>& outer_face, const TriMesh& source,
                      FragmentSet& io_set) {
    const bool has_materials = !source.triangle_material.empty();
    for (uint32_t f : outer_face)
        io_set.outer_material.push_back(has_materials ? source.triangle_material[complex.faces[f].source_triangle] : 0);
    io_set.material_names = source.material_names;
    io_set.interior_material = std::max<int32_t>(1, static_cast<int32_t>(source.material_names.size()));
    for (int32_t m : source.triangle_material) io_set.interior_material = std::max(io_set.interior_material, m + 1);

    io_set.outer_layers = empty_layers(source.layers);
    for (size_t k = 0; k < source.layers.size(); ++k)
        for (uint32_t f : outer_face)
            if (source.layers[k].domain == LayerDomain::face)
                append_at(source, source.layers[k], complex.faces[f].source_triangle, Vec3::UnitX(),
                          io_set.outer_layers[k].values);
    const auto has_layers = [&](LayerDomain domain) {
        return std::ranges::any_of(source.layers, [&](const MeshLayer& l) { return l.domain == domain; });
    };
    if (!complex.source_weights.empty()) return blend_corners(complex, outer_face, source, io_set);
    if (!source.corner_colors.empty() || has_layers(LayerDomain::point))
        take_nearest(complex, outer_face, source, io_set);
    if (!source.corner_uvs.empty() || has_layers(LayerDomain::corner))
        take_corners(complex, outer_face, source, io_set);
}

/// A group of the source's vertices becomes the fragments that have the surface nearest to them.
void carry_groups(const TriMesh& source, FragmentSet& io_set) {
    if (source.vertex_groups.empty() || io_set.outer_triangles.empty()) return;
    std::vector<FragmentId> owner(io_set.outer_triangles.size());
    for (size_t i = 0; i < io_set.fragments.size(); ++i)
        std::fill(owner.begin() + io_set.fragments[i].outer_begin, owner.begin() + io_set.fragments[i].outer_end,
                  FragmentId(i));
    const SurfaceLookup lookup(MeshView(io_set.vertices, io_set.outer_triangles));
    for (const auto& [name, vertices] : source.vertex_groups) {
        std::vector<FragmentId>& group = io_set.vertex_groups[name];
        for (uint32_t v : vertices) group.push_back(owner[lookup.nearest(source.positions[v]).triangle]);
        std::sort(group.begin(), group.end());
        group.erase(std::unique(group.begin(), group.end()), group.end());
    }
}

/// Flat interfaces have the normal of their plane, also where triangles are too thin to tell it.
void take_normals_from_sites(const CellComplex& complex, const std::vector<uint32_t>& interface_face,
                             std::span<const uint32_t> label, FragmentSet& io_set) {
    for (Interface& i : io_set.interfaces) {
        Vec3 sum = Vec3::Zero(), only = Vec3::Zero();
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t) {
            const CellFace& f = complex.faces[interface_face[t]];
            Vec3 n = (complex.cell_site[f.neighbour] - complex.cell_site[f.cell]).normalized();
            if (label[f.cell] != i.a.value) n = -n;
            if (t == i.triangle_begin) only = n;
            if (n != only) only.setZero();
            sum += complex.face_area(f) * n;
        }
        if (!only.isZero(0))
            i.normal = only;
        else if (sum.norm() > 1e-9 * i.area)
            i.normal = sum.normalized();
    }
}

}  // namespace

void find_source_triangles(const TriMesh& source, CellComplex& io_complex) {
    const SurfaceLookup lookup(source);
    for (CellFace& f : io_complex.faces) {
        if (f.neighbour != CellFace::kOutside) continue;
        const auto& [a, b, c] = f.vertices;
        f.source_triangle =
            lookup.nearest((io_complex.vertices[a] + io_complex.vertices[b] + io_complex.vertices[c]) / 3).triangle;
    }
}

FragmentSet make_fragments(const CellComplex& complex, std::span<const uint32_t> label, uint32_t n_labels,
                           const TriMesh& source) {
    FragmentSet set;
    set.fragments.resize(n_labels);
    const SetFaces faces = gather_faces(complex, label, set);
    gather_vertices(complex, set);
    carry_attributes(complex, faces.outer, source, set);
    carry_groups(source, set);
    set.source_volume = mesh_volume(source);
    set.source_area = mesh_area(source);
    measure_fragments(set);
    if (!complex.cell_site.empty()) take_normals_from_sites(complex, faces.interface, label, set);
    assign_interface_uvs(set);
    return set;
}

}  // namespace sunder
