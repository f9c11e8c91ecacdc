// glTF 2.0 in its binary form (Khronos, glTF 2.0 specification): every fragment a node that moves rigidly.
//
//   12 bytes header, chunk JSON, chunk BIN; Y up, metres, seconds; (x, y, z) of ours is (x, z, -y) there
#include <Eigen/SVD>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <map>

#include "nodes/exports/glb_builder.h"
#include "nodes/exports/shot_export.h"
#include "nodes/files/frame_number.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

Vec3f y_up(const Vec3& v) { return Vec3(v.x(), v.z(), -v.y()).cast<float>(); }
Eigen::Vector4f y_up(const Quat& q) {  // x y z w
    const Vec3f axis = y_up(q.vec());
    return {axis.x(), axis.y(), axis.z(), float(q.w())};
}

/// Where a rigid fragment is: first frame's vertices, seen from their mean, to now.
struct Motion {
    Vec3 position = Vec3::Zero();  // of the mean of its vertices, m
    Quat rotation = Quat::Identity();
    double deviation = 0;  // largest distance of a vertex from where the motion takes it, m
};

/// The best rigid motion in the least-squares sense (Kabsch 1976).
Motion rigid_motion(const std::vector<Vec3>& local, const std::vector<uint32_t>& vertices,
                    const std::vector<Vec3f>& positions) {
    Motion m;
    for (uint32_t v : vertices) m.position += positions[v].cast<double>();
    m.position /= double(vertices.size());
    Mat3 H = Mat3::Zero();
    for (size_t k = 0; k < vertices.size(); ++k)
        H += (positions[vertices[k]].cast<double>() - m.position) * local[k].transpose();
    const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vec3 sign = Vec3::Ones();
    sign.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Mat3 R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    m.rotation = Quat(R).normalized();
    for (size_t k = 0; k < vertices.size(); ++k) {
        const Vec3 now = m.position + R * local[k];
        m.deviation = std::max(m.deviation, (positions[vertices[k]].cast<double>() - now).norm());
    }
    return m;
}

struct RigidFragment {
    uint32_t fragment = 0;
    std::vector<uint32_t> vertices, triangles;  // of the first frame
    std::vector<Vec3> local;                    // of `vertices`, about their mean, m
    std::vector<Motion> motion;                 // in each frame
};

/// Fragments of a mesh of constant topology, ascending.
Result<std::vector<RigidFragment>> fragments_of(const ShotMesh& source, const VisualMesh& first) {
    std::map<uint32_t, RigidFragment> found;
    std::vector<uint32_t> owner(first.positions.size(), kNone);
    for (uint32_t t = 0; t < first.triangles.size(); ++t) {
        RigidFragment& f = found[first.triangle_fragment[t]];
        f.fragment = first.triangle_fragment[t];
        f.triangles.push_back(t);
        for (uint32_t v : first.triangles[t]) {
            if (owner[v] == kNone) owner[v] = f.fragment, f.vertices.push_back(v);
            if (owner[v] != f.fragment)
                return bad_input("body '" + source.name + "'", "its fragments share vertices, as nodes of .glb cannot",
                                 "bake with the deformer's topology 'constant', or export .usda");
        }
    }
    std::vector<RigidFragment> fragments;
    for (auto& [unused, f] : found) {
        Vec3 mean = Vec3::Zero();
        for (uint32_t v : f.vertices) mean += first.positions[v].cast<double>();
        mean /= double(f.vertices.size());
        for (uint32_t v : f.vertices) f.local.push_back(first.positions[v].cast<double>() - mean);
        fragments.push_back(std::move(f));
    }
    return fragments;
}

// COLOR_0 is from 0 to 1 (3.7.2.1); what is no number is 0.
Color clamped(Color color) {
    for (float& c : color) c = c > 0 ? std::min(c, 1.0f) : 0.0f;
    return color;
}

// glTF has one normal, UV and colour a vertex: corners that differ become vertices of their own.
size_t add_mesh(Glb& glb, const VisualMesh& first, const RigidFragment& f, const std::string& name,
                const std::vector<Surface>& surfaces) {
    std::map<uint32_t, Vec3> local;
    for (size_t k = 0; k < f.vertices.size(); ++k) local[f.vertices[k]] = f.local[k];
    std::map<int32_t, std::vector<uint32_t>> by_material;
    for (uint32_t t : f.triangles) by_material[first.triangle_material[t]].push_back(t);
    std::vector<const VisualLayer*> more_uvs;
    for (const VisualLayer& layer : first.layers)
        if (layer.kind == LayerKind::uv) more_uvs.push_back(&layer);
    Json primitives = Json::array();
    for (const auto& [material, triangles] : by_material) {
        const Surface& surface = surfaces[static_cast<size_t>(material)];
        // Vertex, bits of normal, UV and colour; of further UVs.
        using Key = std::pair<std::array<uint32_t, 10>, std::vector<uint32_t>>;
        std::map<Key, uint32_t> known;
        std::vector<uint32_t> indices;
        std::vector<Vec3f> positions, normals;
        std::vector<Vec2f> uvs;
        std::vector<std::vector<Vec2f>> further(more_uvs.size());
        std::vector<Color> colors;
        for (uint32_t t : triangles)
            for (uint32_t c = 0; c < 3; ++c) {
                const Vec3f& n = first.corner_normals[3 * t + c];
                const Vec2f uv = first.corner_uvs.empty() ? Vec2f(0, 0) : first.corner_uvs[3 * t + c];
                const Color color =
                    surface.takes_vertex_colors ? clamped(first.corner_colors[3 * t + c]) : Color{1, 1, 1, 1};
                const uint32_t v = first.triangles[t][c];
                Key key = {
                    {v, std::bit_cast<uint32_t>(n.x()), std::bit_cast<uint32_t>(n.y()), std::bit_cast<uint32_t>(n.z()),
                     std::bit_cast<uint32_t>(uv.x()), std::bit_cast<uint32_t>(uv.y()),
                     std::bit_cast<uint32_t>(color[0]), std::bit_cast<uint32_t>(color[1]),
                     std::bit_cast<uint32_t>(color[2]), std::bit_cast<uint32_t>(color[3])},
                    {}};
                for (const VisualLayer* layer : more_uvs)
                    for (size_t k = 0; k < 2; ++k)
                        key.second.push_back(std::bit_cast<uint32_t>(layer->row(3 * t + c)[k]));
                const auto [at, is_new] = known.try_emplace(key, static_cast<uint32_t>(positions.size()));
                indices.push_back(at->second);
                if (!is_new) continue;
                positions.push_back(y_up(local[v])), normals.push_back(y_up(n.cast<double>()));
                uvs.push_back({uv.x(), 1 - uv.y()});  // v runs down there
                for (size_t m = 0; m < more_uvs.size(); ++m) {
                    const float* row = more_uvs[m]->row(3 * t + c);
                    further[m].push_back({row[0], 1 - row[1]});
                }
                colors.push_back(color);
            }
        Json attributes = {{"POSITION", glb.accessor(positions, "VEC3", kFloat, kArrayBuffer, true)},
                           {"NORMAL", glb.accessor(normals, "VEC3", kFloat, kArrayBuffer, false)}};
        if (!first.corner_uvs.empty())
            attributes["TEXCOORD_0"] = glb.accessor(uvs, "VEC2", kFloat, kArrayBuffer, false);
        for (size_t m = 0; m < more_uvs.size(); ++m)
            attributes["TEXCOORD_" + std::to_string(m + (first.corner_uvs.empty() ? 0 : 1))] =
                glb.accessor(further[m], "VEC2", kFloat, kArrayBuffer, false);
        if (surface.takes_vertex_colors)
            attributes["COLOR_0"] = glb.accessor(colors, "VEC4", kFloat, kArrayBuffer, false);
        primitives.push_back({{"attributes", attributes},
                              {"indices", glb.accessor(indices, "SCALAR", kUnsignedInt, kElementBuffer, false)},
                              {"material", glb.add_material(surface)}});
    }
    return glb.add("meshes", {{"name", name}, {"primitives", primitives}});
}

// Translation and rotation of a node in every frame; neighbouring quaternions on one side, so that they blend the short
// way round.
void animate(Glb& glb, Json& animation, size_t node, const RigidFragment& f, size_t times) {
    std::vector<Vec3f> translation;
    std::vector<Eigen::Vector4f> rotation;  // x y z w
    for (const Motion& m : f.motion) {
        translation.push_back(y_up(m.position));
        Eigen::Vector4f q = y_up(m.rotation);
        if (!rotation.empty() && rotation.back().dot(q) < 0) q = -q;
        rotation.push_back(q);
    }
    const std::array<std::pair<const char*, size_t>, 2> paths = {
        {{"translation", glb.accessor(translation, "VEC3", kFloat, 0, false)},
         {"rotation", glb.accessor(rotation, "VEC4", kFloat, 0, false)}}};
    for (const auto& [path, output] : paths) {
        animation["channels"].push_back(
            {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
        animation["samplers"].push_back({{"input", times}, {"output", output}, {"interpolation", "LINEAR"}});
    }
}

Status add_body(Glb& glb, Json& animation, size_t times, const Shot& shot, const ShotMesh& source,
                const ExportSettings& settings, const Progress& progress, double& io_deviation) {
    auto start = source.read(0);
    if (!start) return start.error();
    const VisualMesh& first = start->mesh;
    auto fragments = fragments_of(source, first);
    if (!fragments) return fragments.error();
    Aabb box;
    for (const Vec3f& p : first.positions) box.extend(p.cast<double>());
    const double permitted = settings.tolerance * box.diagonal();
    for (size_t i = 0; i < shot.frames.size(); ++i) {
        if (!progress.report(double(i) / double(shot.frames.size()), "exporting")) return cancelled();
        const auto frame = source.read(i);
        if (!frame) return frame.error();
        if (Status s = check_constant_topology(first, frame->mesh, source.name, shot.frames[i], ".glb"); !s) return s;
        for (RigidFragment& f : *fragments) {
            f.motion.push_back(rigid_motion(f.local, f.vertices, frame->mesh.positions));
            const double deviation = f.motion.back().deviation;
            io_deviation = std::max(io_deviation, deviation);
            if (deviation <= permitted) continue;
            char text[160];
            std::snprintf(text, sizeof text, "fragment %u deforms by %.3g m at frame %s, and nodes of .glb are rigid",
                          f.fragment, deviation, frame_text(shot.frames[i]).c_str());
            return bad_input("body '" + source.name + "'", text,
                             "export .usda or .pc2, which deform, or allow more with --tolerance");
        }
    }
    const std::vector<Surface> surfaces = surfaces_of(source, *start);
    for (const Surface& surface : surfaces) glb.add_material(surface);  // in their order
    Json children = Json::array();
    for (const RigidFragment& f : *fragments) {
        char number[16];
        std::snprintf(number, sizeof number, ".%04u", f.fragment);
        const std::string name = source.name + number;
        const Vec3f at = y_up(f.motion[0].position);
        const size_t node = glb.add("nodes", {{"name", name},
                                              {"mesh", add_mesh(glb, first, f, name, surfaces)},
                                              {"translation", {at.x(), at.y(), at.z()}}});
        children.push_back(node);
        if (shot.frames.size() > 1) animate(glb, animation, node, f, times);
    }
    glb.json()["scenes"][0]["nodes"].push_back(glb.add("nodes", {{"name", source.name}, {"children", children}}));
    return {};
}

// One node that moves as its poses tell.
Status add_solid(Glb& glb, Json& animation, size_t times, const ShotMesh& source) {
    const auto frame = source.read(0);
    if (!frame) return frame.error();
    RigidFragment whole;
    for (uint32_t v = 0; v < frame->mesh.positions.size(); ++v) {
        whole.vertices.push_back(v);
        whole.local.push_back(frame->mesh.positions[v].cast<double>());
    }
    for (uint32_t t = 0; t < frame->mesh.triangles.size(); ++t) whole.triangles.push_back(t);
    for (const Pose& pose : source.poses) whole.motion.push_back({pose.position, pose.orientation});
    const Vec3f at = y_up(whole.motion[0].position);
    const Eigen::Vector4f q = y_up(whole.motion[0].rotation);
    const size_t node =
        glb.add("nodes", {{"name", source.name},
                          {"mesh", add_mesh(glb, frame->mesh, whole, source.name, surfaces_of(source, *frame))},
                          {"translation", {at.x(), at.y(), at.z()}},
                          {"rotation", {q[0], q[1], q[2], q[3]}}});
    if (whole.motion.size() > 1) animate(glb, animation, node, whole, times);
    glb.json()["scenes"][0]["nodes"].push_back(node);
    return {};
}

}  // namespace

Result<ExportReport> export_glb(const Shot& bodies, const ExportSettings& settings, const Progress& progress) {
    std::string notes;
    const auto whole = with_solids(bodies, Deforming::left_out, notes);
    if (!whole) return whole.error();
    const Shot& shot = *whole;
    Glb glb;
    Json animation = {{"name", "shot"}, {"channels", Json::array()}, {"samplers", Json::array()}};
    std::vector<float> seconds;
    for (size_t i = 0; i < shot.frames.size(); ++i)
        seconds.push_back(static_cast<float>(shot.frame_rate.seconds(shot.frames[i] - shot.frames[0])));
    const size_t times = glb.accessor(seconds, "SCALAR", kFloat, 0, true);
    double deviation = 0;
    for (size_t k = 0; k < shot.meshes.size(); ++k) {
        const double n = double(shot.meshes.size());
        if (!shot.meshes[k].poses.empty()) {
            if (Status s = add_solid(glb, animation, times, shot.meshes[k]); !s) return s.error();
            continue;
        }
        if (Status s = add_body(glb, animation, times, shot, shot.meshes[k], settings,
                                progress.part(double(k) / n, double(k + 1) / n), deviation);
            !s)
            return s.error();
    }
    if (!animation["channels"].empty()) glb.json()["animations"] = Json::array({animation});
    if (glb.binary_bytes() > UINT32_MAX / 2)
        return bad_input(settings.file.string(), "would be larger than 2 GB, which .glb cannot be", "export .usda");
    const auto stamp = write_file(settings.file, glb.file().view());
    if (!stamp) return stamp.error();
    char note[120];
    std::snprintf(note, sizeof note, "fragments are rigid in .glb; they deformed by %.2g m at most", deviation);
    return ExportReport{{}, {{settings.file, *stamp}}, notes.empty() ? note : note + ("; " + notes)};
}

}  // namespace sunder
