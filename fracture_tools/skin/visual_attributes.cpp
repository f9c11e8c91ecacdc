#include "fracture_tools/skin/visual_attributes.h"

#include <array>

namespace sunder {
namespace {

constexpr size_t kGrain = 2048;  // triangles

// Replaces `io_last` by Width entries a listed face, put(face). `n_same`: faces at the front, which are the same in
// every frame.
template <size_t Width, class T, class Put>
void fill(ArrayRecycler<T>& io_recycler, SharedArray<T>& io_last, const SplitTopology& topology, size_t n_same,
          const RangeRunner& run, const Put& put) {
    const std::span<const uint32_t> face = topology.triangle_face();
    io_last = {};  // free to be written over
    auto& slot = io_recycler.take(Width * face.size(), Width * size_t{topology.faces().n_faces()});
    T* out = slot.object->data();
    const size_t first = slot.finished / Width;
    run(face.size() - first, kGrain, [&](size_t begin, size_t end) {
        for (size_t t = first + begin; t < first + end; ++t) {
            const std::array<T, Width> values = put(face[t]);
            for (size_t i = 0; i < Width; ++i) out[Width * t + i] = values[i];
        }
    });
    slot.finished = Width * n_same;
    io_last = ArrayRecycler<T>::share(slot);
}

// Of the corners of a face: what the source has there, or nothing.
template <class T>
std::array<T, 3> corners(const FragmentFaces& faces, uint32_t face, const std::vector<T>& source, const T& nothing) {
    if (source.empty()) return {nothing, nothing, nothing};
    return {source[faces.source_corner(face, 0)], source[faces.source_corner(face, 1)],
            source[faces.source_corner(face, 2)]};
}

}  // namespace

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
}

}  // namespace sunder
