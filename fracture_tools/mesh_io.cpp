// The only file that includes assimp.
#include "fracture_tools/mesh_io.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <Eigen/LU>
#include <filesystem>
#include <unordered_map>

namespace sunder {
namespace {

constexpr const char* kFormats = "OBJ, PLY, STL, glTF, GLB, FBX or OFF";

std::string lower_extension(const std::string& path) {
    std::string e = std::filesystem::path(path).extension().string();
    std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return std::tolower(c); });
    return e;
}

struct BitsHash {
    size_t operator()(const std::array<double, 3>& p) const {
        size_t h = 0;
        for (double x : p) h = (h ^ std::hash<double>()(x)) * 0x9e3779b97f4a7c15ull, h ^= h >> 29;
        return h;
    }
};

/// Gathers the triangles of all nodes into one mesh.
class Collector {
public:
    Collector(const aiScene& scene, std::string path, double scale) : scene_(scene), path_(std::move(path)), scale_(scale) {
        number_materials();
        for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
            has_uvs_ |= scene.mMeshes[m]->HasTextureCoords(0);
            has_normals_ |= scene.mMeshes[m]->HasNormals();
        }
        // STL's normals are those of the triangles and say nothing of what the artist wants smooth.
        if (lower_extension(path_) == ".stl") has_normals_ = false;
    }

    Result<TriMesh> collect() {
        if (Status s = visit(*scene_.mRootNode, Eigen::Matrix4d::Identity()); !s) return s.error();
        if (mesh_.triangles.empty()) return bad_input(path_, "the file has no triangles");
        if (default_is_used_ && material_name_.size() > 0)
            material_name_.push_back("default");
        mesh_.material_names = material_name_;
        return std::move(mesh_);
    }

private:
    /// Materials keep the order of the file. The one that assimp adds for triangles without comes last.
    void number_materials() {
        for (unsigned m = 0; m < scene_.mNumMaterials; ++m) {
            const std::string name = scene_.mMaterials[m]->GetName().C_Str();
            const bool inserted = name == AI_DEFAULT_MATERIAL_NAME || (name.empty() && scene_.mNumMaterials == 1);
            material_number_.push_back(inserted ? -1 : static_cast<int32_t>(material_name_.size()));
            if (!inserted) material_name_.push_back(name);
        }
    }

    int32_t material_of(const aiMesh& part) {
        const int32_t number = part.mMaterialIndex < material_number_.size() ? material_number_[part.mMaterialIndex] : -1;
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
        if (!(part.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) return {};
        const Mat3 linear = to_world.topLeftCorner<3, 3>();
        const Vec3 shift = to_world.topRightCorner<3, 1>();
        const bool is_mirrored = linear.determinant() < 0;
        const Mat3 normal_matrix = linear.inverse().transpose();
        std::vector<uint32_t> number(part.mNumVertices);
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            const aiVector3D& p = part.mVertices[v];
            const Vec3 world = scale_ * (linear * Vec3(p.x, p.y, p.z) + shift);
            if (!world.allFinite())
                return bad_input(path_, "vertex " + std::to_string(v) + " of mesh '" + (part.mName.length ? part.mName.C_Str() : node) +
                                            "' has a coordinate that is no finite number");
            number[v] = weld(world);
        }
        const int32_t material = material_of(part);
        for (unsigned f = 0; f < part.mNumFaces; ++f) {
            const aiFace& face = part.mFaces[f];
            if (face.mNumIndices != 3) continue;
            std::array<unsigned, 3> corner = {face.mIndices[0], face.mIndices[1], face.mIndices[2]};
            if (*std::max_element(corner.begin(), corner.end()) >= part.mNumVertices)
                return bad_input(path_, "triangle " + std::to_string(f) + " names a vertex that is not there");
            if (is_mirrored) std::swap(corner[1], corner[2]);
            const Triangle t = {number[corner[0]], number[corner[1]], number[corner[2]]};
            if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
            mesh_.triangles.push_back(t);
            mesh_.triangle_material.push_back(material);
            if (has_uvs_)
                for (unsigned c : corner) {
                    const bool has = part.HasTextureCoords(0);
                    mesh_.corner_uvs.push_back(has ? Vec2f(part.mTextureCoords[0][c].x, part.mTextureCoords[0][c].y) : Vec2f(0, 0));
                }
            if (has_normals_) add_normals(part, corner, t, normal_matrix);
        }
        return {};
    }

    void add_normals(const aiMesh& part, const std::array<unsigned, 3>& corner, const Triangle& t, const Mat3& normal_matrix) {
        const auto& p = mesh_.positions;
        const Vec3 own = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
        for (unsigned c : corner) {
            Vec3 n = own;
            if (part.HasNormals()) n = normal_matrix * Vec3(part.mNormals[c].x, part.mNormals[c].y, part.mNormals[c].z);
            if (!n.allFinite() || n.norm() == 0) n = own;
            mesh_.corner_normals.push_back(n.normalized().cast<float>());
        }
    }

    uint32_t weld(const Vec3& p) {
        const std::array<double, 3> key = {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};  // + 0.0: -0 is 0
        const auto [at, is_new] = vertex_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
        if (is_new) mesh_.positions.push_back(Vec3(key[0], key[1], key[2]));
        return at->second;
    }

    const aiScene& scene_;
    std::string path_;
    double scale_;
    bool has_uvs_ = false, has_normals_ = false, default_is_used_ = false;
    std::vector<int32_t> material_number_;      // of assimp's materials in ours; -1: inserted by assimp
    std::vector<std::string> material_name_;
    std::unordered_map<std::array<double, 3>, uint32_t, BitsHash> vertex_;  // looked up only
    TriMesh mesh_;
};

Status check_readable(const std::string& path, const MeshReadSettings& settings) {
    if (!(settings.scale > 0) || !std::isfinite(settings.scale)) return bad_input(path, "the scale must be above 0");
    std::error_code code;
    if (!std::filesystem::exists(path, code)) return bad_input(path, "there is no such file");
    if (!std::filesystem::is_regular_file(path, code)) return bad_input(path, "this is not a file");
    const std::string extension = lower_extension(path);
    for (const char* known : {".obj", ".ply", ".stl", ".gltf", ".glb", ".fbx", ".off"})
        if (extension == known) return {};
    return bad_input(path, "this is no mesh format that can be read", std::string("give ") + kFormats);
}

}  // namespace

Result<TriMesh> read_mesh(const std::string& path, const MeshReadSettings& settings) {
    if (Status s = check_readable(path, settings); !s) return s.error();
    try {
        Assimp::Importer importer;
        const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType);
        if (!scene || !scene->mRootNode) {
            std::string reason = importer.GetErrorString();
            std::replace(reason.begin(), reason.end(), '\n', ' ');
            return bad_input(path, "the file cannot be read: " + reason, std::string("give ") + kFormats);
        }
        return Collector(*scene, path, settings.scale).collect();
    } catch (const std::exception& failure) {
        return bad_input(path, std::string("the file cannot be read: ") + failure.what(), std::string("give ") + kFormats);
    }
}

}  // namespace sunder
