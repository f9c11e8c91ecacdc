#include "fracture_tools/skin/surface_motion.h"

#include <string>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/skin/triangle_axes.h"

namespace sunder {
namespace {

Status check_mesh_of(const TriMesh& mesh, double thickness) {
    const MeshReport report = check_mesh(mesh);
    if (!report.is_usable())
        return bad_input("mesh", report.faults.empty() ? "it has no triangles" : report.faults.front());
    if (thickness > 0) return {};
    Status solid = require_solid(mesh, "mesh");
    if (!solid) {
        Error error = solid.error();
        error.mend +=
            (error.mend.empty() ? "" : "; ") + std::string("an open sheet collides if it is given a thickness");
        return error;
    }
    return {};
}

// What is flat in the mesh itself may be flat ever after.
Status check_frame(const TriMesh& mesh, std::span<const Vec3> position, int frame, bool bounds_a_solid) {
    const std::string then = " at frame " + std::to_string(frame);
    if (bounds_a_solid && !(mesh_volume(MeshView(position, mesh.triangles)) > 0))
        return bad_input("motion", "the mesh is turned inside out" + then, "mend the animation there");
    Aabb box;
    for (const Vec3& p : mesh.positions) box.extend(p);
    for (const Triangle& t : mesh.triangles)
        if (is_flat(position, t, box.diagonal()) && !is_flat(mesh.positions, t, box.diagonal()))
            return bad_input("motion",
                             "the triangle of vertices " + std::to_string(t[0]) + ", " + std::to_string(t[1]) +
                                 " and " + std::to_string(t[2]) + " is squeezed flat" + then,
                             "mend the animation there");
    return {};
}

}  // namespace

Result<std::shared_ptr<const SurfaceMotion>> SurfaceMotion::make(const TriMesh& mesh, VertexFrames frames,
                                                                 double thickness) {
    if (Status ok = check_mesh_of(mesh, thickness); !ok) return ok.error();
    if (Status ok = frames.check(mesh.positions.size()); !ok) return ok.error();
    std::shared_ptr<SurfaceMotion> motion(new SurfaceMotion());
    motion->frames_ = std::move(frames);
    for (size_t k = 0; k < motion->frames_.n_frames; ++k)
        if (Status ok =
                check_frame(mesh, motion->at(k), motion->frames_.first_frame + static_cast<int>(k), thickness == 0);
            !ok)
            return ok.error();
    motion->tree_ = make_surface_tree(mesh, thickness);
    return std::shared_ptr<const SurfaceMotion>(std::move(motion));
}

std::vector<Vec3> SurfaceMotion::at(size_t k) const {
    std::vector<Vec3> position(frames_.n_vertices);
    for (size_t v = 0; v < position.size(); ++v) position[v] = frames_.at(k, v);
    return position;
}

std::shared_ptr<const MovingSurface> SurfaceMotion::from(int frame) const {
    const std::lock_guard lock(kept_mutex_);
    if (kept_frame_ != frame) {
        kept_ = std::make_shared<const MovingSurface>(
            move_surface(tree_, at(frames_.index_of(frame)), at(frames_.index_of(frame + 1))));
        kept_frame_ = frame;
    }
    return kept_;
}

}  // namespace sunder
