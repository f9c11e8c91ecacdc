#include "fracture_tools/skin/surface_attachment.h"

#include <cmath>
#include <string>

#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/skin/triangle_axes.h"

namespace sunder {
namespace {

Eigen::Matrix2d edges_of(std::span<const Vec3> position, const Triangle& t, const Mat3& axes) {
    Eigen::Matrix2d edges;
    for (int k = 0; k < 2; ++k) edges.col(k) = (axes.transpose() * (position[t[k + 1]] - position[t[0]])).head<2>();
    return edges;
}

// The best rotation of F; both triangles are seen from their front, so that det F > 0.
Mat3 turn_in_plane(const Eigen::Matrix2d& F) {
    const double cosine = F(0, 0) + F(1, 1), sine = F(1, 0) - F(0, 1);
    const double length = std::sqrt(cosine * cosine + sine * sine);
    Mat3 turn = Mat3::Identity();
    turn.topLeftCorner<2, 2>() << cosine / length, -sine / length, sine / length, cosine / length;
    return turn;
}

}  // namespace

Result<std::shared_ptr<const SurfaceAttachment>> SurfaceAttachment::make(const SimulationMesh& rest,
                                                                         std::span<const uint32_t> fragments,
                                                                         const TriMesh& mesh, VertexFrames frames,
                                                                         int start) {
    if (mesh.triangles.empty()) return bad_input("mesh", "it has no triangles");
    if (Status ok = frames.check(mesh.positions.size()); !ok) return ok.error();
    std::shared_ptr<SurfaceAttachment> made(new SurfaceAttachment());
    made->frames_ = std::move(frames);
    if (Status ok = made->tie(rest, fragments, mesh, start); !ok) return ok.error();
    return std::shared_ptr<const SurfaceAttachment>(std::move(made));
}

Status SurfaceAttachment::tie(const SimulationMesh& rest, std::span<const uint32_t> fragments, const TriMesh& mesh,
                              int start) {
    const size_t first = frames_.index_of(start);
    const std::vector<Vec3> position = places(first);
    Aabb box;
    for (const Vec3& p : position) box.extend(p);
    diagonal_ = box.diagonal();
    const SurfaceLookup lookup{MeshView(position, mesh.triangles)};
    rest_center_ = rest.rest_position, mass_.assign(rest.n_particles(), 0.0);
    double mass = 0;
    for (const uint32_t f : fragments) {
        const SurfacePoint near = lookup.nearest(rest_center_[f]);
        Tie tie = {f, mesh.triangles[near.triangle], near.barycentric, rest_center_[f] - near.position, {}, {}};
        if (Status ok = check_triangle(position, tie, first); !ok) return ok;
        tie.axes = triangle_axes(position, tie.corners), tie.edges = edges_of(position, tie.corners, tie.axes);
        tie_.push_back(tie);
        mass_[f] = rest.mass[f], mass += mass_[f], center_ += mass_[f] * rest_center_[f];
    }
    center_ /= mass;
    return {};
}

std::vector<Vec3> SurfaceAttachment::places(size_t k) const {
    std::vector<Vec3> position(frames_.n_vertices);
    for (size_t v = 0; v < position.size(); ++v) position[v] = frames_.at(k, v);
    return position;
}

Status SurfaceAttachment::check_triangle(std::span<const Vec3> position, const Tie& tie, size_t k) const {
    const auto& [a, b, c] = tie.corners;
    if (!is_flat(position, tie.corners, diagonal_)) return {};
    return bad_input("motion",
                     "the triangle of vertices " + std::to_string(a) + ", " + std::to_string(b) + " and " +
                         std::to_string(c) + ", with which fragment " + std::to_string(tie.fragment) +
                         " goes, is squeezed flat at frame " +
                         std::to_string(frames_.first_frame + static_cast<int>(k)),
                     "mend the animation there, or let it go earlier");
}

Result<SourcePose> SurfaceAttachment::pose_at(size_t k) const {
    const std::vector<Vec3> position = places(k);
    SourcePose pose;
    pose.own.resize(rest_center_.size());
    for (const Tie& tie : tie_) {
        if (Status ok = check_triangle(position, tie, k); !ok) return ok.error();
        const Mat3 axes = triangle_axes(position, tie.corners);
        const Eigen::Matrix2d F = edges_of(position, tie.corners, axes) * tie.edges.inverse();
        const Quat turn = Quat(Mat3(axes * turn_in_plane(F) * tie.axes.transpose())).normalized();
        Vec3 point = Vec3::Zero();
        for (int c = 0; c < 3; ++c) point += tie.weight[c] * position[tie.corners[c]];
        pose.own[tie.fragment] = {point + turn * Vec3(tie.arm - rest_center_[tie.fragment]), turn};
    }
    gather_whole(mass_, rest_center_, center_, pose);
    return pose;
}

}  // namespace sunder
