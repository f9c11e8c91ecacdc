// Fragments that are attached to an animated mesh that is not the body's own: each to the triangle that is nearest.
#pragma once

#include <vector>

#include "fracture_tools/skin/fragment_motion.h"
#include "fracture_tools/skin/vertex_frames.h"
#include "solver/data/simulation_mesh.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// A fragment goes as the triangle takes it that is nearest to its centre where both are at the start: the point of the
/// triangle goes where its corners take it, and the fragment stays beside that point as the triangle turns. A triangle
/// turns as its plane does, and in its plane by the best rotation of its corners.
class SurfaceAttachment final : public FragmentMotion {
public:
    /// `rest`: the body as placed; `fragments`: of it, at least one; `start`: frame at which the places of both belong
    /// together. Errors: those of VertexFrames::check, a mesh without triangles.
    static Result<std::shared_ptr<const SurfaceAttachment>> make(const SimulationMesh& rest,
                                                                 std::span<const uint32_t> fragments,
                                                                 const TriMesh& mesh, VertexFrames frames, int start);

private:
    struct Tie {
        uint32_t fragment;
        Triangle corners;
        Vec3 weight;            // of the corners
        Vec3 arm;               // from the point to the fragment's centre, m
        Mat3 axes;              // of the triangle at the start: along its first edge, across it, its normal
        Eigen::Matrix2d edges;  // of the triangle, by the first two axes, m
    };
    SurfaceAttachment() = default;
    Status tie(const SimulationMesh& rest, std::span<const uint32_t> fragments, const TriMesh& mesh, int start);
    /// An error names a fragment whose triangle is squeezed flat, the triangle's vertices and the frame.
    Result<SourcePose> pose_at(size_t frame_index) const override;
    std::vector<Vec3> places(size_t frame_index) const;
    Status check_triangle(std::span<const Vec3> position, const Tie& tie, size_t frame_index) const;

    double diagonal_ = 0;  // of the mesh at the start, m
    std::vector<Tie> tie_;
    std::vector<Vec3> rest_center_;  // of all fragments                   (n_fragments), m
    std::vector<double> mass_;       // kg; 0: it is not attached
};

}  // namespace sunder
