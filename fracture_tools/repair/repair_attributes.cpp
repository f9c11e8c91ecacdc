#include "fracture_tools/repair/repair_attributes.h"

#include <algorithm>
#include <map>

#include "fracture_tools/mesh/mesh_rows.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/mesh/surface_uvs.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

using Key = std::array<double, 3>;
Key key(const Vec3& p) { return {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}; }  // -0 is 0

std::array<Key, 3> corner_keys(const TriMesh& m, uint32_t t) {
    std::array<Key, 3> keys;
    for (int c = 0; c < 3; ++c) keys[c] = key(m.positions[m.triangles[t][c]]);
    return keys;
}

/// Triangles of a mesh by the positions of their corners, in any order.
class TriangleFinder {
public:
    explicit TriangleFinder(const TriMesh& mesh) : mesh_(mesh) {
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) entries_.push_back({sorted(corner_keys(mesh, t)), t});
        std::sort(entries_.begin(), entries_.end());
    }

    /// Entry c: the corner (3 * triangle + corner) at corner c of `keys`. False: there is no such triangle.
    bool find(const std::array<Key, 3>& keys, std::array<uint32_t, 3>& out_corners) const {
        const std::array<Key, 3> wanted = sorted(keys);
        const auto at = std::lower_bound(entries_.begin(), entries_.end(), Entry{wanted, 0});
        if (at == entries_.end() || at->keys != wanted) return false;
        const std::array<Key, 3> own = corner_keys(mesh_, at->triangle);
        for (int c = 0; c < 3; ++c)
            for (uint32_t k = 0; k < 3; ++k)
                if (own[k] == keys[c]) out_corners[c] = 3 * at->triangle + k;
        return true;
    }

private:
    struct Entry {
        std::array<Key, 3> keys;
        uint32_t triangle;
        auto operator<=>(const Entry&) const = default;
    };
    static std::array<Key, 3> sorted(std::array<Key, 3> keys) {
        std::sort(keys.begin(), keys.end());
        return keys;
    }

    const TriMesh& mesh_;
    std::vector<Entry> entries_;
};

/// Groups name vertices by number; their positions find them again.
void carry_groups(const TriMesh& source, TriMesh& io_mesh) {
    if (source.vertex_groups.empty()) return;
    std::map<Key, std::vector<uint32_t>> at;
    for (uint32_t v = 0; v < io_mesh.positions.size(); ++v) at[key(io_mesh.positions[v])].push_back(v);
    for (const auto& [name, vertices] : source.vertex_groups) {
        std::vector<uint32_t>& out = io_mesh.vertex_groups[name];
        for (uint32_t v : vertices)
            if (const auto found = at.find(key(source.positions[v])); found != at.end())
                out.insert(out.end(), found->second.begin(), found->second.end());
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
    }
}

/// What triangles have that come from triangle `from` of the source.
void append_to_triangle(const TriMesh& source, uint32_t from, TriMesh& io_mesh) {
    if (!source.triangle_material.empty()) io_mesh.triangle_material.push_back(source.triangle_material[from]);
    for (size_t k = 0; k < source.layers.size(); ++k)
        if (source.layers[k].domain == LayerDomain::face)
            append_at(source, source.layers[k], from, Vec3::UnitX(), io_mesh.layers[k].values);
}

/// Layers by corner at a point of a triangle of the source.
void append_to_corner(const TriMesh& source, uint32_t triangle, const Vec3& weights, TriMesh& io_mesh) {
    for (size_t k = 0; k < source.layers.size(); ++k)
        if (source.layers[k].domain == LayerDomain::corner)
            append_at(source, source.layers[k], triangle, weights, io_mesh.layers[k].values);
}

/// Numbers of vertices: the source's own where it has a vertex in the place, else those of the nearest point.
void carry_vertex_attributes(const TriMesh& source, TriMesh& io_mesh) {
    const auto is_of_points = [](const MeshLayer& l) { return l.domain == LayerDomain::point; };
    if (source.vertex_attributes.empty() && std::ranges::none_of(source.layers, is_of_points)) return;
    std::map<Key, uint32_t> at;
    for (uint32_t v = 0; v < source.positions.size(); ++v) at.emplace(key(source.positions[v]), v);
    const SurfaceLookup lookup(source);
    for (const Vec3& p : io_mesh.positions) {
        const auto own = at.find(key(p));
        const SurfacePoint near = own == at.end() ? lookup.nearest(p) : SurfacePoint();
        for (const auto& [name, values] : source.vertex_attributes) {
            double value = 0;
            if (own != at.end())
                value = double(values[own->second]);
            else
                for (int c = 0; c < 3; ++c)
                    value += near.barycentric[c] * double(values[source.triangles[near.triangle][c]]);
            io_mesh.vertex_attributes[name].push_back(float(value));
        }
        for (size_t k = 0; k < source.layers.size(); ++k) {
            const MeshLayer& from = source.layers[k];
            std::vector<float>& to = io_mesh.layers[k].values;
            if (!is_of_points(from)) continue;
            if (own != at.end())
                to.insert(to.end(), from.row(own->second), from.row(own->second) + from.width);
            else
                append_at(source, from, near.triangle, near.barycentric, to);
        }
    }
}

}  // namespace

std::vector<Origin> carry_attributes(const TriMesh& source, TriMesh& io_mesh) {
    const TriangleFinder finder(source);
    io_mesh.layers = empty_layers(source.layers);
    std::vector<Origin> origin;
    for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
        std::array<uint32_t, 3> from{};
        const bool found = finder.find(corner_keys(io_mesh, t), from);
        const bool same = (from[1] - from[0] + 3) % 3 == 1;  // its corners follow one another as the source's do
        origin.push_back({from[0] / 3, !found ? Sense::none : same ? Sense::same : Sense::reversed});
        append_to_triangle(source, from[0] / 3, io_mesh);
        for (uint32_t corner : from) {
            append_to_corner(source, corner / 3, Vec3::Unit(corner % 3), io_mesh);
            if (!source.corner_uvs.empty()) io_mesh.corner_uvs.push_back(source.corner_uvs[corner]);
            if (!source.corner_colors.empty()) io_mesh.corner_colors.push_back(source.corner_colors[corner]);
            if (!source.corner_normals.empty())
                io_mesh.corner_normals.push_back(same ? source.corner_normals[corner] : -source.corner_normals[corner]);
        }
    }
    io_mesh.material_names = source.material_names;
    carry_groups(source, io_mesh);
    carry_vertex_attributes(source, io_mesh);
    return origin;
}

void carry_cut_attributes(const TriMesh& source, TriMesh& io_mesh) {
    const TriangleFinder finder(source);
    const SurfaceLookup lookup(source);
    io_mesh.layers = empty_layers(source.layers);
    for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
        std::array<Vec3, 3> at, weights;
        for (int c = 0; c < 3; ++c) at[c] = io_mesh.positions[io_mesh.triangles[t][c]];
        std::array<uint32_t, 3> from{};
        const bool is_whole = finder.find(corner_keys(io_mesh, t), from);
        const uint32_t home = is_whole ? from[0] / 3 : lookup.nearest((at[0] + at[1] + at[2]) / 3).triangle;
        const auto& [a, b, d] = source.triangles[home];
        for (int c = 0; c < 3; ++c)
            weights[c] = is_whole
                             ? Vec3(Vec3::Unit(from[c] % 3))
                             : nearest_on_triangle(at[c], source.positions[a], source.positions[b], source.positions[d])
                                   .barycentric;
        append_to_triangle(source, home, io_mesh);
        for (const Vec3& w : weights) {
            append_to_corner(source, home, w, io_mesh);
            Vec2f uv = Vec2f::Zero();
            Vec3f n = Vec3f::Zero();
            for (uint32_t k = 0; k < 3; ++k) {
                if (!source.corner_uvs.empty()) uv += float(w[k]) * source.corner_uvs[3 * home + k];
                if (!source.corner_normals.empty()) n += float(w[k]) * source.corner_normals[3 * home + k];
            }
            if (!source.corner_uvs.empty()) io_mesh.corner_uvs.push_back(uv);
            if (!source.corner_colors.empty()) io_mesh.corner_colors.push_back(blended(source.corner_colors, home, w));
            if (!source.corner_normals.empty()) io_mesh.corner_normals.push_back(is_whole ? n : Vec3f(n.normalized()));
        }
    }
    io_mesh.material_names = source.material_names;
    carry_groups(source, io_mesh);
    carry_vertex_attributes(source, io_mesh);
}

void resample_attributes(const TriMesh& source, TriMesh& io_mesh) {
    const SurfaceLookup lookup(source);
    const SourceCorners corners(source);
    const bool has_layers =
        std::ranges::any_of(source.layers, [](const MeshLayer& l) { return l.domain == LayerDomain::corner; });
    io_mesh.layers = empty_layers(source.layers);
    for (const auto& [a, b, c] : io_mesh.triangles) {
        const Vec3 middle = (io_mesh.positions[a] + io_mesh.positions[b] + io_mesh.positions[c]) / 3;
        const uint32_t home = lookup.nearest(middle).triangle;
        append_to_triangle(source, home, io_mesh);
        if (!source.corner_uvs.empty() || has_layers)
            for (uint32_t v : {a, b, c}) {
                const SourceCorners::Place at = corners.place(io_mesh.positions[v], middle, home);
                if (!source.corner_uvs.empty()) io_mesh.corner_uvs.push_back(corners.uvs(at));
                corners.append_all(at, io_mesh.layers);
            }
        if (!source.corner_colors.empty())
            for (uint32_t v : {a, b, c}) {
                const SurfacePoint near = lookup.nearest(io_mesh.positions[v]);
                io_mesh.corner_colors.push_back(blended(source.corner_colors, near.triangle, near.barycentric));
            }
    }
    io_mesh.material_names = source.material_names;
    carry_vertex_attributes(source, io_mesh);
    if (source.vertex_groups.empty()) return;
    std::vector<uint32_t> nearest;
    for (const Vec3& p : io_mesh.positions) {
        const SurfacePoint at = lookup.nearest(p);
        int corner = 0;
        at.barycentric.maxCoeff(&corner);
        nearest.push_back(source.triangles[at.triangle][corner]);
    }
    for (const auto& [name, vertices] : source.vertex_groups)
        for (uint32_t v = 0; v < nearest.size(); ++v)
            if (std::binary_search(vertices.begin(), vertices.end(), nearest[v]))
                io_mesh.vertex_groups[name].push_back(v);
}

uint32_t append_vertex(TriMesh& io_mesh, const Vec3& position, uint32_t like) {
    for_vertex_lists(io_mesh, [&](auto& values, size_t n) { append_row(values, n, like); });
    io_mesh.positions.push_back(position);
    return static_cast<uint32_t>(io_mesh.positions.size() - 1);
}

void append_triangle(TriMesh& io_mesh, const Triangle& corners, std::span<const uint32_t, 3> like,
                     std::span<const Vec3f, 3> normals) {
    io_mesh.triangles.push_back(corners);
    for_triangle_lists(io_mesh, [&](auto& values, size_t n) { append_row(values, n, like[0] / 3); });
    for_corner_lists(io_mesh, [&](auto& values, size_t n) {
        for (const uint32_t corner : like) append_row(values, n, corner);
    });
    if (!io_mesh.corner_normals.empty())
        io_mesh.corner_normals.insert(io_mesh.corner_normals.end(), normals.begin(), normals.end());
}

void replace_triangle(TriMesh& io_mesh, uint32_t triangle, std::span<const std::array<WeightedCorner, 3>> parts) {
    const uint32_t first = 3 * triangle;
    // What is not at a corner already is blended; all is read before the first part overwrites it.
    const auto blend = [&](auto& io_values, auto mix) {
        if (io_values.empty()) return;
        auto made = io_values;
        made.clear();
        for (const auto& part : parts)
            for (const WeightedCorner& c : part) made.push_back(mix(c.weights));
        std::copy_n(made.begin(), 3, io_values.begin() + first);
        io_values.insert(io_values.end(), made.begin() + 3, made.end());
    };
    const auto sum = [&](const auto& values, const Vec3& w) {
        auto out = (float(w[0]) * values[first]).eval();
        for (uint32_t k = 1; k < 3; ++k) out += float(w[k]) * values[first + k];
        return out;
    };
    blend(io_mesh.corner_uvs, [&](const Vec3& w) { return sum(io_mesh.corner_uvs, w); });
    blend(io_mesh.corner_colors, [&](const Vec3& w) { return blended(io_mesh.corner_colors, triangle, w); });
    blend(io_mesh.corner_normals, [&](const Vec3& w) { return Vec3f(sum(io_mesh.corner_normals, w).normalized()); });
    for (MeshLayer& layer : io_mesh.layers) {
        if (layer.domain == LayerDomain::point) continue;
        std::vector<float> made;
        for (const auto& part : parts)
            for (size_t c = 0; c < (layer.domain == LayerDomain::face ? 1u : 3u); ++c)
                append_at(io_mesh, layer, triangle, part[c].weights, made);
        const size_t width = made.size() / parts.size();  // of a triangle
        std::copy_n(made.begin(), width, layer.values.begin() + width * triangle);
        layer.values.insert(layer.values.end(), made.begin() + width, made.end());
    }
    if (!io_mesh.triangle_material.empty())
        io_mesh.triangle_material.insert(io_mesh.triangle_material.end(), parts.size() - 1,
                                         int32_t{io_mesh.triangle_material[triangle]});
    for (size_t k = 0; k < parts.size(); ++k) {
        const Triangle corners = {parts[k][0].vertex, parts[k][1].vertex, parts[k][2].vertex};
        if (k == 0)
            io_mesh.triangles[triangle] = corners;
        else
            io_mesh.triangles.push_back(corners);
    }
}

void turn_triangle(TriMesh& io_mesh, uint32_t triangle) {
    std::swap(io_mesh.triangles[triangle][1], io_mesh.triangles[triangle][2]);
    const size_t first = 3 * size_t(triangle);
    for_corner_lists(io_mesh, [&](auto& values, size_t n) { swap_rows(values, n, first + 1, first + 2); });
    if (io_mesh.corner_normals.empty()) return;
    std::swap(io_mesh.corner_normals[first + 1], io_mesh.corner_normals[first + 2]);
    for (size_t c = first; c < first + 3; ++c) io_mesh.corner_normals[c] = -io_mesh.corner_normals[c];
}

void keep_marked(TriMesh& io_mesh, std::span<const uint8_t> mark) {
    std::vector<uint32_t> number(io_mesh.positions.size(), kNone);
    uint32_t n = 0;
    for (uint32_t t = 0; t < mark.size(); ++t) {
        if (!mark[t]) continue;
        io_mesh.triangles[n] = io_mesh.triangles[t];
        for (uint32_t v : io_mesh.triangles[n]) number[v] = 0;
        for_triangle_lists(io_mesh, [&](auto& values, size_t width) { copy_row(values, width, t, n); });
        const auto move_corners = [&](auto& values, size_t width) { copy_row(values, 3 * width, t, n); };
        for_corner_lists(io_mesh, move_corners);
        if (!io_mesh.corner_normals.empty()) move_corners(io_mesh.corner_normals, 1);
        ++n;
    }
    io_mesh.triangles.resize(n);
    for_triangle_lists(io_mesh, [&](auto& values, size_t width) { values.resize(n * width); });
    for_corner_lists(io_mesh, [&](auto& values, size_t width) { values.resize(3 * size_t(n) * width); });
    if (!io_mesh.corner_normals.empty()) io_mesh.corner_normals.resize(3 * size_t(n));

    uint32_t kept = 0;
    for (uint32_t v = 0; v < number.size(); ++v)
        if (number[v] != kNone) {
            io_mesh.positions[kept] = io_mesh.positions[v];
            for_vertex_lists(io_mesh, [&](auto& values, size_t width) { copy_row(values, width, v, kept); });
            number[v] = kept++;
        }
    io_mesh.positions.resize(kept);
    for_vertex_lists(io_mesh, [&](auto& values, size_t width) { values.resize(kept * width); });
    for (Triangle& t : io_mesh.triangles)
        for (uint32_t& v : t) v = number[v];
    for (auto& [name, vertices] : io_mesh.vertex_groups) {
        std::vector<uint32_t> left;
        for (uint32_t v : vertices)
            if (number[v] != kNone) left.push_back(number[v]);
        vertices = std::move(left);
    }
}

}  // namespace sunder
