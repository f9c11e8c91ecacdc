// Files to begin with: each kind of header, list and number that the readers know.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace sunder::testing {

template <class T>
void append_number(std::string& io_bytes, T value, bool big_endian) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof value);
    if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof value);
    io_bytes.append(raw, sizeof value);
}

/// A tetrahedron with UVs, normals and materials.
inline std::string binary_ply(bool big_endian) {
    std::string bytes = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                        "_endian 1.0\ncomment seed\nelement vertex 4\nproperty double x\nproperty double y\nproperty "
                        "double z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 4\nproperty "
                        "list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty short "
                        "material\nend_header\n";
    for (int v = 0; v < 4; ++v) {
        for (int k = 0; k < 3; ++k) append_number(bytes, double(v == k + 1), big_endian);
        for (int k = 0; k < 3; ++k) append_number(bytes, float(k == 2), big_endian);
    }
    constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    for (const auto& face : kFaces) {
        append_number(bytes, uint8_t{3}, big_endian);
        for (int v : face) append_number(bytes, int32_t{v}, big_endian);
        append_number(bytes, uint8_t{6}, big_endian);
        for (int k = 0; k < 6; ++k) append_number(bytes, 0.125f * float(k), big_endian);
        append_number(bytes, int16_t{1}, big_endian);
    }
    return bytes;
}

inline std::vector<std::string> mesh_seeds() {
    return {
        binary_ply(false),
        binary_ply(true),
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty "
        "float s\nproperty float t\nelement face 2\nproperty list uchar uint vertex_index\nelement edge 1\nproperty "
        "int vertex1\nproperty int vertex2\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0.5 0.4 0 0 1\n0 1 0.5 0 "
        "1\n5 0 1 2 3 4\n3 0 2 4\n0 1\n",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float "
        "point_float:heat%20map\nproperty list uchar int point_int:pair\nelement face 2\nproperty list uchar int "
        "vertex_indices\nproperty list uchar float corner_uv:Wall\nproperty int face_bool:top\nend_header\n0 0 0 0.5 2 "
        "1 "
        "-1\n1 0 0 1 2 2 -2\n1 1 0 nan 2 3 -3\n0 1 1 1e9 2 4 -4\n4 0 1 2 3 8 0 0 0 1 1 0 1 1 1\n3 0 1 2 6 0 0 0 1 1 1 "
        "0\n",
        "OFF\n# a box's corner\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
        "COFF 5 2 0\n0 0 0 255 0 0 255\n2 0 0\n2 2 0\n1 0.5 0\n0 2 1e-3\n5 0 1 2 3 4 0.1 0.2 0.3\n\n3 0 2 4\n",
        "NOFF\n3 1 0\n0 0 0 0 0 1\n+1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n"};
}

}  // namespace sunder::testing
