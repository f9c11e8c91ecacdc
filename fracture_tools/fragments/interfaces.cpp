#include "fracture_tools/fragments/interfaces.h"

namespace sunder {

void assign_interface_uvs(FragmentSet& io_set) {
    io_set.interface_corner_uvs.resize(3 * io_set.interface_triangles.size());
    for (const Interface& face : io_set.interfaces) {
        int axis = 0;  // the world axis least along the normal gives u its direction
        face.normal.cwiseAbs().minCoeff(&axis);
        const Vec3 u = (Vec3::Unit(axis) - face.normal * face.normal[axis]).normalized();
        const Vec3 v = face.normal.cross(u);
        for (uint32_t t = face.triangle_begin; t < face.triangle_end; ++t)
            for (int c = 0; c < 3; ++c) {
                const Vec3 d = io_set.vertices[io_set.interface_triangles[t][c]] - face.centroid;
                io_set.interface_corner_uvs[3 * t + c] = Vec2f(float(d.dot(u)), float(d.dot(v)));
            }
    }
}

}  // namespace sunder
