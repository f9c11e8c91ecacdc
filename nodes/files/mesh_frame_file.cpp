#include "nodes/files/mesh_frame_file.h"

#include <bit>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <set>
#include <unordered_map>

#include "fracture_tools/skin/skinning.h"
#include "nodes/files/layer_columns.h"
#include "nodes/files/ply_file.h"

namespace sunder {
namespace {

// Rows of a table, packed as they are in memory.
struct RowWriter {
    char* at;

    template <class T>
    void put(const T& value) {
        std::memcpy(at, &value, sizeof(T));
        at += sizeof(T);
    }
    void put_bytes(const void* data, size_t n) {
        std::memcpy(at, data, n);
        at += n;
    }
    template <class T>
    void put_list(const T* entry, uint8_t length) {
        put(length), put(*entry);
    }
};

// The three corners of a triangle.
template <class T>
const std::array<T, 3>* corners(const SharedArray<T>& of_corners, size_t triangle) {
    return reinterpret_cast<const std::array<T, 3>*>(of_corners.data() + 3 * triangle);
}

void put_float(std::string& out, float value) {
    char text[32];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);  // shortest that reads back the same
}

void put_index(std::string& out, uint32_t value) {
    char text[16];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

// Numbers equal rows of N floats alike, by first appearance, and writes each new one as a line.
template <int N>
class Pool {
public:
    explicit Pool(const char* keyword) : keyword_(keyword) {}

    uint32_t index(std::string& out, const float* value) {
        std::array<uint32_t, N> bits;
        for (int i = 0; i < N; ++i) bits[i] = std::bit_cast<uint32_t>(value[i]);
        const auto [at, is_new] = index_.try_emplace(bits, static_cast<uint32_t>(index_.size() + 1));
        if (is_new) {
            out += keyword_;
            for (int i = 0; i < N; ++i) out += ' ', put_float(out, value[i]);
            out += '\n';
        }
        return at->second;
    }

private:
    struct Hash {
        size_t operator()(const std::array<uint32_t, N>& bits) const {
            size_t h = 0;
            for (uint32_t b : bits) h = (h ^ b) * 0x9e3779b97f4a7c15ull, h ^= h >> 29;
            return h;
        }
    };
    const char* keyword_;
    std::unordered_map<std::array<uint32_t, N>, uint32_t, Hash> index_;  // looked up only, never walked
};

// A line of a PLY header ends where a name does not.
std::string one_line(std::string name) {
    for (char& c : name)
        if (static_cast<unsigned char>(c) < ' ') c = ' ';
    return name;
}

// By material. Blanks end a name in OBJ, and materials of one name are one: "a_b_2" is a second "a b". "interior" is
// that of break surfaces, whatever others are called.
std::vector<std::string> obj_names(const FragmentSet& fragments) {
    const int32_t interior = fragments.interior_material;
    std::vector<std::string> names;
    std::set<std::string> taken = {material_label(fragments, interior)};
    for (int32_t m = 0; m < interior; ++m) {
        std::string name = material_label(fragments, m);
        for (char& c : name)
            if (static_cast<unsigned char>(c) <= ' ') c = '_';
        std::string unique = name;
        for (int n = 2; !taken.insert(unique).second; ++n) unique = name + "_" + std::to_string(n);
        names.push_back(unique);
    }
    names.push_back(material_label(fragments, interior));
    return names;
}

// Of each vertex in the mesh that was cut; empty where nothing tells.
SharedArray<Vec3f> rest_positions(const VisualMesh& mesh, const FragmentSet& fragments) {
    if (!mesh.skin) return mesh.rest_positions;
    std::vector<Vec3f> rest;
    rest.reserve(mesh.positions.size());
    for (uint32_t v : mesh.skin->pool_vertices()) rest.push_back(fragments.vertices[v].cast<float>());
    return rest;
}

}  // namespace

std::string material_label(const FragmentSet& fragments, int32_t material) {
    if (material == fragments.interior_material) return "interior";
    const size_t i = static_cast<size_t>(material);
    if (material >= 0 && i < fragments.material_names.size() && !fragments.material_names[i].empty())
        return fragments.material_names[i];
    return "material_" + std::to_string(material);
}

ByteBuffer encode_mesh_ply(const VisualMesh& mesh, const FragmentSet& fragments) {
    const SharedArray<Vec3f> rest = rest_positions(mesh, fragments);
    const bool has_uvs = !mesh.corner_uvs.empty(), has_velocities = !mesh.velocities.empty();
    const bool has_accelerations = !mesh.accelerations.empty();
    const bool has_hidden = !mesh.triangle_hidden.empty(), has_rest = !rest.empty();
    PlyElement vertex{"vertex", mesh.positions.size(), ply_scalars("x y z", PlyType::float32)};
    vertex.properties.push_back({"fragment", PlyType::int32, {}});
    for (const PlyProperty& p : ply_scalars("rest_x rest_y rest_z", PlyType::float32))
        if (has_rest) vertex.properties.push_back(p);
    for (const PlyProperty& p : ply_scalars("vx vy vz", PlyType::float32))
        if (has_velocities) vertex.properties.push_back(p);
    for (const PlyProperty& p : ply_scalars("ax ay az", PlyType::float32))
        if (has_accelerations) vertex.properties.push_back(p);
    PlyElement face{"face", mesh.triangles.size(), {{"vertex_indices", PlyType::int32, PlyType::uint8}}};
    face.properties.push_back({"material", PlyType::int32, {}});
    face.properties.push_back({"fragment", PlyType::int32, {}});
    if (has_hidden) face.properties.push_back({"hidden", PlyType::uint8, {}});
    if (has_uvs) face.properties.push_back({"texcoord", PlyType::float32, PlyType::uint8});
    face.properties.push_back({"corner_normals", PlyType::float32, PlyType::uint8});
    const bool has_interfaces = !mesh.triangle_interface.empty(), has_colors = !mesh.corner_colors.empty(),
               has_rim = !mesh.corner_rim.empty();
    if (has_interfaces) face.properties.push_back({"interface", PlyType::int32, {}});
    if (has_colors) face.properties.push_back({"corner_colors", PlyType::float32, PlyType::uint8});
    if (has_rim) face.properties.push_back({"rim", PlyType::float32, PlyType::uint8});
    const LayerColumns of_vertices(mesh.layers, false), of_faces(mesh.layers, true);
    of_vertices.add_properties(vertex), of_faces.add_properties(face);

    const size_t vertex_bytes =
        16 + (has_rest ? 12 : 0) + (has_velocities ? 12 : 0) + (has_accelerations ? 12 : 0) + of_vertices.row_bytes();
    const size_t face_bytes = 1 + 12 + 8 + (has_hidden ? 1 : 0) + (has_uvs ? 1 + 24 : 0) + 1 + 36 +
                              (has_interfaces ? 4 : 0) + (has_colors ? 1 + 48 : 0) + (has_rim ? 1 + 12 : 0) +
                              of_faces.row_bytes();
    ByteBuffer bytes;
    bytes.reserve(8192 + mesh.positions.size() * vertex_bytes + mesh.triangles.size() * face_bytes);
    std::vector<std::string> comments = {std::string(kMeshFileMagic), "written by sunder " SUNDER_VERSION};
    for (int32_t m = 0; m <= fragments.interior_material; ++m)
        comments.push_back(std::string(kMaterialComment) + std::to_string(m) + ' ' +
                           one_line(material_label(fragments, m)));
    write_ply_header(bytes, {comments, {vertex, face}});
    RowWriter rows{bytes.grow(mesh.positions.size() * vertex_bytes + mesh.triangles.size() * face_bytes)};
    const auto put = [&](const void* data, size_t n) { rows.put_bytes(data, n); };
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        rows.put(mesh.positions[v]), rows.put(mesh.vertex_fragment[v]);
        if (has_rest) rows.put(rest[v]);
        if (has_velocities) rows.put(mesh.velocities[v]);
        if (has_accelerations) rows.put(mesh.accelerations[v]);
        of_vertices.write_row(v, put);
    }
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        rows.put_list(mesh.triangles.data() + t, uint8_t{3});
        rows.put(mesh.triangle_material[t]), rows.put(mesh.triangle_fragment[t]);
        if (has_hidden) rows.put(mesh.triangle_hidden[t]);
        if (has_uvs) rows.put_list(corners(mesh.corner_uvs, t), uint8_t{6});
        rows.put_list(corners(mesh.corner_normals, t), uint8_t{9});
        if (has_interfaces) rows.put(mesh.triangle_interface[t]);
        if (has_colors) rows.put_list(corners(mesh.corner_colors, t), uint8_t{12});
        if (has_rim) rows.put_list(corners(mesh.corner_rim, t), uint8_t{3});
        of_faces.write_row(t, put);
    }
    return bytes;
}

ByteBuffer encode_mesh_obj(const VisualMesh& mesh, const FragmentSet& fragments) {
    const bool has_uvs = !mesh.corner_uvs.empty();
    ByteBuffer bytes;
    bytes.reserve(mesh.positions.size() * 40 + mesh.triangles.size() * 120);
    bytes.text("# " + std::string(kMeshFileMagic) + ", written by sunder " SUNDER_VERSION "\n");
    std::string line;
    for (const Vec3f& p : mesh.positions) {
        line = "v";
        for (int i = 0; i < 3; ++i) line += ' ', put_float(line, p[i]);
        bytes.text(line += '\n');
    }
    Pool<2> uvs("vt");
    Pool<3> normals("vn");
    const std::vector<std::string> names = obj_names(fragments);
    const int32_t no_material = -1;
    int32_t material = no_material;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        line.clear();
        if (mesh.triangle_material[t] != material) {
            material = mesh.triangle_material[t];
            line += "usemtl " + names[static_cast<size_t>(material)] + "\n";
        }
        std::string face = "f";
        for (size_t c = 0; c < 3; ++c) {
            face += ' ', put_index(face, mesh.triangles[t][c] + 1);
            face += '/';
            if (has_uvs) put_index(face, uvs.index(line, mesh.corner_uvs[3 * t + c].data()));
            face += '/', put_index(face, normals.index(line, mesh.corner_normals[3 * t + c].data()));
        }
        bytes.text(line), bytes.text(face += '\n');
    }
    return bytes;
}

Result<ByteBuffer> encode_mesh(const std::string& path, const VisualMesh& mesh, const FragmentSet& fragments) {
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        if (!mesh.positions[v].allFinite()) {
            Error e = bad_input(path, "vertex " + std::to_string(v) + " of the mesh is not finite");
            e.code = ErrorCode::numerical;
            return e;
        }
    const std::string extension = std::filesystem::path(path).extension().string();
    if (extension == ".ply") return encode_mesh_ply(mesh, fragments);
    if (extension == ".obj") return encode_mesh_obj(mesh, fragments);
    return bad_input(path, "meshes are not written as '" + extension + "'", "end the path in .ply or .obj");
}

}  // namespace sunder
