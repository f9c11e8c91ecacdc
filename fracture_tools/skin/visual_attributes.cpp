#include "fracture_tools/skin/visual_attributes.h"

#include <array>

#include "fracture_tools/fragments/outer_layers.h"
#include "fracture_tools/skin/skinning.h"

namespace sunder {
namespace {

constexpr size_t kFaceGrain = 2048;  // triangles

// Replaces `io_last` by `width` entries a listed face, which put(face, out) writes. `n_same`: faces at the front, which
// are the same in every frame.
template <class T, class Put>
void fill_rows(ArrayRecycler<T>& io_recycler, SharedArray<T>& io_last, const SplitTopology& topology, size_t n_same,
               const RangeRunner& run, size_t width, const Put& put) {
    const std::span<const uint32_t> face = topology.triangle_face();
    io_last = {};  // free to be written over
    auto& slot = io_recycler.take(width * face.size(), width * size_t{topology.faces().n_faces()});
    T* out = slot.object->data();
    const size_t first = slot.finished / width;
    run(face.size() - first, kFaceGrain, [&](size_t begin, size_t end) {
        for (size_t t = first + begin; t < first + end; ++t) put(face[t], out + width * t);
    });
    slot.finished = width * n_same;
    io_last = ArrayRecycler<T>::share(slot);
}

// The same, put(face) giving an array of Width entries.
template <size_t Width, class T, class Put>
void fill(ArrayRecycler<T>& io_recycler, SharedArray<T>& io_last, const SplitTopology& topology, size_t n_same,
          const RangeRunner& run, const Put& put) {
    fill_rows(io_recycler, io_last, topology, n_same, run, Width, [&](uint32_t face, T* out) {
        const std::array<T, Width> values = put(face);
        for (size_t i = 0; i < Width; ++i) out[i] = values[i];
    });
}

// Of the corners of a face: what the source has there, or nothing.
template <class T>
std::array<T, 3> corners(const FragmentFaces& faces, uint32_t face, const std::vector<T>& source, const T& nothing) {
    if (source.empty()) return {nothing, nothing, nothing};
    return {source[faces.source_corner(face, 0)], source[faces.source_corner(face, 1)],
            source[faces.source_corner(face, 2)]};
}

// Of a face, or of its three corners, in a layer of the set.
void put_layer(const FragmentSet& set, const MeshLayer& layer, const FragmentFaces& faces, uint32_t face, float* out) {
    const bool is_of_face = layer.domain == LayerDomain::face;
    for (int c = 0; c < (is_of_face ? 1 : 3); ++c, out += layer.width) {
        const uint32_t corner = faces.source_corner(face, c);
        LayerRow row =
            faces.is_outer(face) ? row_of(layer, is_of_face ? face : corner) : row_inside(set, layer, corner);
        if (layer.kind == LayerKind::uv && faces.is_side_b(face)) row[0] = -row[0];  // as corner_uvs
        std::copy_n(row.begin(), layer.width, out);
    }
}

}  // namespace

VisualAttributes::VisualAttributes(std::shared_ptr<const FragmentSet> set)
    : set_(std::move(set)), layers_(set_->outer_layers.size()) {
    if (std::ranges::none_of(set_->outer_layers, [](const MeshLayer& l) { return l.domain == LayerDomain::point; }))
        return;
    outer_corner_.assign(set_->vertices.size(), kNone);
    for (uint32_t c = 0; c < 3 * set_->outer_triangles.size(); ++c)
        if (uint32_t& first = outer_corner_[set_->outer_triangles[c / 3][c % 3]]; first == kNone) first = c;
}

void VisualAttributes::list(const SplitTopology& topology, const RangeRunner& run, VisualMesh& io_mesh) {
    const FragmentFaces& faces = topology.faces();
    const size_t n_outer = faces.n_outer;
    fill<1>(material_, io_mesh.triangle_material, topology, n_outer, run, [&](uint32_t f) {
        return std::array{faces.is_outer(f) ? set_->outer_material[f] : set_->interior_material};
    });
    fill<1>(fragment_, io_mesh.triangle_fragment, topology, n_outer, run,
            [&](uint32_t f) { return std::array{faces.fragment[f]}; });
    fill<1>(interface_, io_mesh.triangle_interface, topology, n_outer, run,
            [&](uint32_t f) { return std::array{faces.is_outer(f) ? -1 : static_cast<int32_t>(faces.interface[f])}; });
    // Side b sees the cut from behind: u changes sign, so that a texture reads the right way round on both sides and
    // what meets at one point of the cut has the same |u|, v.
    if (!set_->outer_corner_uvs.empty() || !set_->interface_corner_uvs.empty())
        fill<3>(uvs_, io_mesh.corner_uvs, topology, n_outer, run, [&](uint32_t f) {
            const auto& source = faces.is_outer(f) ? set_->outer_corner_uvs : set_->interface_corner_uvs;
            std::array<Vec2f, 3> uv = corners<Vec2f>(faces, f, source, Vec2f::Zero());
            if (faces.is_side_b(f) && !source.empty())
                for (Vec2f& x : uv) x.x() = -x.x();
            return uv;
        });
    if (!set_->outer_corner_colors.empty())
        fill<3>(colors_, io_mesh.corner_colors, topology, n_outer, run, [&](uint32_t f) {
            static const std::vector<Color> none;
            return corners<Color>(faces, f, faces.is_outer(f) ? set_->outer_corner_colors : none, Color{1, 1, 1, 1});
        });
    if (!set_->interface_corner_rim.empty())
        fill<3>(rim_, io_mesh.corner_rim, topology, n_outer, run, [&](uint32_t f) {
            static const std::vector<float> none;
            return corners<float>(faces, f, faces.is_outer(f) ? none : set_->interface_corner_rim, 0.0f);
        });
    io_mesh.layers.resize(set_->outer_layers.size());
    for (size_t k = 0; k < layers_.size(); ++k) {
        const MeshLayer& layer = set_->outer_layers[k];
        static_cast<LayerId&>(io_mesh.layers[k]) = static_cast<const LayerId&>(layer);
        if (layer.domain == LayerDomain::point) continue;
        const size_t width = layer.width * (layer.domain == LayerDomain::face ? 1 : 3);
        fill_rows(layers_[k], io_mesh.layers[k].values, topology, n_outer, run, width,
                  [&](uint32_t f, float* out) { put_layer(*set_, layer, faces, f, out); });
    }
}

void VisualAttributes::list_points(VisualMesh& io_mesh) {
    if (outer_corner_.empty()) return;
    const std::vector<uint32_t> pool_vertex = io_mesh.skin->pool_vertices();
    for (size_t k = 0; k < layers_.size(); ++k) {
        const MeshLayer& layer = set_->outer_layers[k];
        if (layer.domain != LayerDomain::point) continue;
        io_mesh.layers[k].values = {};  // free to be written over
        auto& slot = layers_[k].take(layer.width * pool_vertex.size());
        float* out = slot.object->data();
        for (const uint32_t v : pool_vertex) {
            const uint32_t corner = outer_corner_[v];
            const LayerRow row = corner == kNone ? row_inside(*set_, layer, 0) : row_of(layer, corner);
            out = std::copy_n(row.begin(), layer.width, out);
        }
        io_mesh.layers[k].values = ArrayRecycler<float>::share(slot);
    }
}

}  // namespace sunder
