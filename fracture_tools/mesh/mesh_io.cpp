// The only file that includes assimp. PLY and OFF it does not read safely: those are our own (polygon_files.h).
#include "fracture_tools/mesh/mesh_io.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/material.h>
#include <assimp/scene.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>

#include "fracture_tools/mesh/mesh_assembler.h"
#include "fracture_tools/mesh/obj_text.h"
#include "fracture_tools/mesh/polygon_files.h"
#include "fracture_tools/mesh/utf8_text.h"

namespace sunder {
namespace {

constexpr const char* kFormats = "OBJ, PLY, STL, glTF, GLB, FBX or OFF";

std::string lower_extension(const std::string& path) {
    std::string e = std::filesystem::path(path).extension().string();
    std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return std::tolower(c); });
    return e;
}

/// Gathers the polygons of all nodes into one mesh.
class Collector {
public:
    Collector(const aiScene& scene, std::string path, double scale)
        : scene_(scene),
          path_(std::move(path)),
          scale_(scale),
          assembler_(has_uvs(scene), has_normals(scene, path_), has_colors(scene)) {
        number_materials();
    }

    Result<TriMesh> collect() {
        if (Status s = visit(*scene_.mRootNode, Eigen::Matrix4d::Identity()); !s) return s.error();
        if (assembler_.n_triangles() == 0) return bad_input(path_, "the file has no triangles");
        TriMesh mesh = assembler_.finish();
        if (default_is_used_ && !material_name_.empty()) material_name_.push_back("default");
        mesh.material_names = material_name_;
        return mesh;
    }

private:
    static bool has_uvs(const aiScene& scene) {
        return std::any_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes,
                           [](const aiMesh* m) { return m->HasTextureCoords(0); });
    }
    static bool has_colors(const aiScene& scene) {
        return std::any_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes,
                           [](const aiMesh* m) { return m->HasVertexColors(0); });
    }
    /// STL's normals are those of the triangles and say nothing of what the artist wants smooth.
    static bool has_normals(const aiScene& scene, const std::string& path) {
        return lower_extension(path) != ".stl" && std::any_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes,
                                                              [](const aiMesh* m) { return m->HasNormals(); });
    }

    /// Materials keep the order of the file. The one that assimp adds for triangles without comes last: it is known by
    /// its name, or (glTF) has none and stands last.
    void number_materials() {
        std::vector<uint8_t> is_used(scene_.mNumMaterials, 0);
        for (unsigned m = 0; m < scene_.mNumMeshes; ++m)
            if (scene_.mMeshes[m]->mMaterialIndex < is_used.size()) is_used[scene_.mMeshes[m]->mMaterialIndex] = 1;
        for (unsigned m = 0; m < scene_.mNumMaterials; ++m) {
            const std::string name = to_utf8(scene_.mMaterials[m]->GetName().C_Str());
            const bool inserted =
                name == AI_DEFAULT_MATERIAL_NAME || (name.empty() && (!is_used[m] || m + 1 == scene_.mNumMaterials));
            material_number_.push_back(inserted ? -1 : static_cast<int32_t>(material_name_.size()));
            if (!inserted) material_name_.push_back(name);
        }
    }

    int32_t material_of(const aiMesh& part) {
        const int32_t number =
            part.mMaterialIndex < material_number_.size() ? material_number_[part.mMaterialIndex] : -1;
        if (number >= 0) return number;
        default_is_used_ = true;
        return static_cast<int32_t>(material_name_.size());
    }

    Status visit(const aiNode& node, const Eigen::Matrix4d& above) {
        Eigen::Matrix4d local;
        const aiMatrix4x4& m = node.mTransformation;
        local << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
        const Eigen::Matrix4d to_world = above * local;
        for (unsigned k = 0; k < node.mNumMeshes; ++k)
            if (Status s = add(*scene_.mMeshes[node.mMeshes[k]], to_world, node.mName.C_Str()); !s) return s;
        for (unsigned k = 0; k < node.mNumChildren; ++k)
            if (Status s = visit(*node.mChildren[k], to_world); !s) return s;
        return {};
    }

    Status add(const aiMesh& part, const Eigen::Matrix4d& to_world, const std::string& node) {
        const auto faces = std::span(part.mFaces, part.mNumFaces);
        enum : uint8_t { loose, of_lines, of_polygons };
        std::vector<uint8_t> used(part.mNumVertices, loose);
        for (size_t f = 0; f < faces.size(); ++f)
            for (unsigned v : std::span(faces[f].mIndices, faces[f].mNumIndices)) {
                if (v >= part.mNumVertices)
                    return bad_input(path_, "face " + std::to_string(f) + " names a vertex that is not there");
                used[v] = std::max<uint8_t>(used[v], faces[f].mNumIndices < 3 ? of_lines : of_polygons);
            }
        if (std::ranges::find(used, of_polygons) == used.end()) return {};
        const Mat3 linear = to_world.topLeftCorner<3, 3>();
        const Vec3 shift = to_world.topRightCorner<3, 1>();
        const bool is_mirrored = linear.determinant() < 0;
        const Mat3 normal_matrix = linear.inverse().transpose();
        std::vector<FileCorner> corners(part.mNumVertices);
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            if (used[v] == of_lines) continue;
            const aiVector3D& p = part.mVertices[v];
            const Vec3 world = scale_ * (linear * Vec3(p.x, p.y, p.z) + shift);
            if (!world.allFinite())
                return bad_input(path_, "vertex " + std::to_string(v) + " of mesh '" +
                                            (part.mName.length ? part.mName.C_Str() : node) +
                                            "' has a coordinate that is no finite number");
            corners[v].vertex = assembler_.weld(world);
            if (part.HasTextureCoords(0))
                corners[v].uv = Vec2f(part.mTextureCoords[0][v].x, part.mTextureCoords[0][v].y);
            if (part.HasNormals())
                corners[v].normal = normal_matrix * Vec3(part.mNormals[v].x, part.mNormals[v].y, part.mNormals[v].z);
            if (part.HasVertexColors(0)) {
                const aiColor4D& c = part.mColors[0][v];
                corners[v].color = {c.r, c.g, c.b, c.a};
            }
        }
        const int32_t material = material_of(part);
        std::vector<FileCorner> polygon;
        for (const aiFace& face : faces) {
            polygon.clear();
            for (unsigned v : std::span(face.mIndices, face.mNumIndices)) polygon.push_back(corners[v]);
            if (is_mirrored && !polygon.empty()) std::reverse(polygon.begin() + 1, polygon.end());
            assembler_.add_polygon(polygon, material);
        }
        return {};
    }

    const aiScene& scene_;
    std::string path_;
    double scale_;
    bool default_is_used_ = false;
    std::vector<int32_t> material_number_;  // of assimp's materials in ours; -1: inserted by assimp
    std::vector<std::string> material_name_;
    MeshAssembler assembler_;
};

Status check_readable(const std::string& path, const MeshReadSettings& settings) {
    if (!(settings.scale > 0) || !std::isfinite(settings.scale)) return bad_input(path, "the scale must be above 0");
    std::error_code code;
    if (!std::filesystem::exists(path, code)) return bad_input(path, "there is no such file");
    if (!std::filesystem::is_regular_file(path, code)) return bad_input(path, "this is not a file");
    if (::access(path.c_str(), R_OK) != 0)
        return bad_input(path, std::string("cannot be opened: ") + std::strerror(errno), "check the permissions");
    const std::string extension = lower_extension(path);
    for (const char* known : {".obj", ".ply", ".stl", ".gltf", ".glb", ".fbx", ".off"})
        if (extension == known) return {};
    return bad_input(path, "this is no mesh format that can be read", std::string("give ") + kFormats);
}

/// Assimp reads floats: what lies far from the origin for its size is crumpled, or without any area.
Status check_precision(const aiScene& scene, const std::string& path) {
    constexpr double kStep = 6e-8, kCoarsest = 1e-3;  // of a float, of the mesh's size
    Eigen::AlignedBox3d box;
    for (unsigned m = 0; m < scene.mNumMeshes; ++m)
        for (unsigned v = 0; v < scene.mMeshes[m]->mNumVertices; ++v) {
            const aiVector3D& p = scene.mMeshes[m]->mVertices[v];
            box.extend(Vec3(p.x, p.y, p.z));
        }
    if (box.isEmpty()) return {};
    const double farthest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
    if (!(kStep * farthest > kCoarsest * box.diagonal().norm())) return {};
    char text[120];
    std::snprintf(text, sizeof text, "lies too far from the origin (%.3g) for its size (%.3g)", farthest,
                  box.diagonal().norm());
    return bad_input(path, text, "move it nearer, or give it as PLY, which is read in double precision");
}

/// Length of the file's unit, m. FBX tells it in cm; assimp leaves coordinates as they are.
double unit_of(const aiScene& scene, const std::string& path) {
    if (lower_extension(path) != ".fbx") return 1;
    float cm = 1;
    if (scene.mMetaData) scene.mMetaData->Get("UnitScaleFactor", cm);
    return cm > 0 && std::isfinite(cm) ? 0.01 * double(cm) : 0.01;
}

Result<std::string> read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string bytes(std::filesystem::file_size(path), '\0');
    if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        return bad_input(path, "the file cannot be read");
    return bytes;
}

/// Files as they are, but for one that has another text.
class MendedFile final : public Assimp::DefaultIOSystem {
public:
    MendedFile(std::string path, std::string text) : path_(std::move(path)), text_(std::move(text)) {}
    Assimp::IOStream* Open(const char* file, const char* mode) override {
        if (file != path_) return DefaultIOSystem::Open(file, mode);
        return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(text_.data()), text_.size());
    }

private:
    const std::string path_, text_;
};

Status mend_text(const std::string& path, Assimp::Importer& importer) {
    if (lower_extension(path) != ".obj") return {};
    const Result<std::string> bytes = read_bytes(path);
    if (!bytes) return bytes.error();
    if (auto mended = mended_obj(*bytes)) importer.SetIOHandler(new MendedFile(path, std::move(*mended)));  // owns it
    return {};
}

Result<TriMesh> read_with_assimp(const std::string& path, double scale) {
    Assimp::Importer importer;
    if (Status s = mend_text(path, importer); !s) return s.error();
    // As it is: polygons are cut into triangles by ourselves, assimp (5.2) makes some of no area of concave ones.
    const aiScene* scene = importer.ReadFile(path, 0);
    if (!scene || !scene->mRootNode) {
        std::string reason = importer.GetErrorString();
        std::replace(reason.begin(), reason.end(), '\n', ' ');
        return bad_input(path, "the file cannot be read: " + reason, std::string("give ") + kFormats);
    }
    if (Status s = check_precision(*scene, path); !s) return s.error();
    return Collector(*scene, path, scale * unit_of(*scene, path)).collect();
}

}  // namespace

Result<TriMesh> read_mesh(const std::string& path, const MeshReadSettings& settings) {
    if (Status s = check_readable(path, settings); !s) return s.error();
    try {
        const std::string extension = lower_extension(path);
        if (extension != ".ply" && extension != ".off") return read_with_assimp(path, settings.scale);
        const Result<std::string> bytes = read_bytes(path);
        if (!bytes) return bytes.error();
        return extension == ".ply" ? read_ply(*bytes, path, settings.scale) : read_off(*bytes, path, settings.scale);
    } catch (const std::exception& failure) {
        return bad_input(path, std::string("the file cannot be read: ") + failure.what(),
                         std::string("give ") + kFormats);
    }
}

}  // namespace sunder
