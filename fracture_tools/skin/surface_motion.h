// An animated mesh as what collides: its surface from each frame to the next.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "fracture_tools/skin/vertex_frames.h"
#include "solver/data/moving_surface.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// A surface that bounds a solid at every frame, or is given a thickness.
class SurfaceMotion {
public:
    /// `thickness`: m; > 0: the mesh may be open, what is solid is all within half of this of it. Errors: those of
    /// VertexFrames::check, a mesh without triangles or one that bounds no solid, a frame in which it is turned inside
    /// out, a triangle that is squeezed flat, with its vertices and the frame.
    static Result<std::shared_ptr<const SurfaceMotion>> make(const TriMesh& mesh, VertexFrames frames,
                                                             double thickness);

    const VertexFrames& frames() const { return frames_; }
    const std::shared_ptr<const SurfaceTree>& tree() const { return tree_; }
    /// From a frame to the next. The last one asked for is kept. To be called from any thread.
    std::shared_ptr<const MovingSurface> from(int frame) const;

private:
    SurfaceMotion() = default;
    std::vector<Vec3> at(size_t frame_index) const;

    VertexFrames frames_;
    std::shared_ptr<const SurfaceTree> tree_;
    mutable std::mutex kept_mutex_;
    mutable std::optional<int> kept_frame_;
    mutable std::shared_ptr<const MovingSurface> kept_;
};

}  // namespace sunder
