#include "nodes/exports/shot_solids.h"

#include <algorithm>
#include <map>
#include <set>

#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/skin/triangle_axes.h"
#include "nodes/files/compression.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "nodes/types/shape_mesh.h"
#include "nodes/types/time_scale.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

constexpr double kPlaneExtent = 10;  // side of the square that stands for a plane, in diagonals of the first frame

Vec3 vector3(const Json& value) { return Vec3(value[0].get<double>(), value[1].get<double>(), value[2].get<double>()); }

/// One face after another with normals of their own where the mesh has none.
VisualMesh visual_mesh(const TriMesh& mesh) {
    VisualMesh made;
    std::vector<Vec3f> positions, normals = mesh.corner_normals;
    for (const Vec3& p : mesh.positions) positions.push_back(p.cast<float>());
    if (normals.empty())
        for (const Triangle& t : mesh.triangles) {
            const Vec3& a = mesh.positions[t[0]];
            const Vec3 n = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).normalized();
            normals.insert(normals.end(), 3, n.cast<float>());
        }
    made.positions = std::move(positions), made.triangles = mesh.triangles, made.corner_normals = std::move(normals);
    made.corner_uvs = mesh.corner_uvs, made.corner_colors = mesh.corner_colors;
    made.triangle_material =
        mesh.triangle_material.empty() ? std::vector<int32_t>(mesh.triangles.size()) : mesh.triangle_material;
    made.triangle_fragment = std::vector<uint32_t>(mesh.triangles.size());
    return made;
}

/// A mesh as a surface has its vertices at `share` of the frame; its normals turn with its triangles.
MeshFrame deformed(const TriMesh& mesh, const MovingSurface& surface, double share) {
    TriMesh now = mesh;
    const Pose whole = pose_between({}, surface.whole, surface.pivot, share);
    for (uint32_t v = 0; v < now.positions.size(); ++v) now.positions[v] = whole.apply(surface.vertex(v, share));
    for (size_t c = 0; c < now.corner_normals.size(); c += 3) {
        const Triangle& t = mesh.triangles[c / 3];
        const Mat3 turn = triangle_axes(now.positions, t) * triangle_axes(mesh.positions, t).transpose();
        for (size_t k = c; k < c + 3; ++k)
            now.corner_normals[k] = (turn * mesh.corner_normals[k].cast<double>()).cast<float>();
    }
    MeshFrame frame{visual_mesh(now), {}};
    const auto& material = now.triangle_material;
    frame.materials.assign(material.empty() ? 1 : static_cast<size_t>(std::ranges::max(material)) + 1, "Collider");
    return frame;
}

class SolidFinder {
public:
    SolidFinder(const SolidSource& source, double extent, Graph graph)
        : source_(source), extent_(extent), graph_(std::move(graph)) {}

    Result<ShotSolids> run() {
        std::vector<std::string> solvers;
        for (const std::string& name : graph_.node_names())
            if (graph_.describe(name).take()->type == "solver") solvers.push_back(name);
        for (const std::string& solver : solvers)
            if (Status s = add_rigid_bodies(solver); !s) return s.error();
        for (const std::string& solver : solvers)
            for (const SocketReference& wire : graph_.wires({solver, "colliders"}).take())
                if (seen_.insert(wire.node).second)
                    if (Status s = add_collider(wire.node, solver); !s) return s.error();
        return std::move(found_);
    }

private:
    Json at(const std::string& node, const char* parameter, double frame) const {
        return graph_.parameter_at(node, parameter, frame).take();
    }

    Status add_collider(const std::string& node, const std::string& solver) {
        const double first = source_.frames.front();
        if (at(node, "shape", first) == "mesh" && at(node, "motion", first) == "vertices")
            return add_surface(node, solver);
        return add(node, collider_poses(node, solver), "Collider");
    }

    SceneTime time_of(const std::string& solver, double frame) const {
        const int start = graph_.frame_range()[0];
        return scene_time(start, graph_.integral(solver, "time_scale", start, frame).take(), 1);
    }

    Pose collider_pose(const std::string& node, double frame) const {
        return {vector3(at(node, "position", frame)), euler_xyz(vector3(at(node, "rotation", frame)))};
    }

    /// Keys of colliders are in simulated frames. Between two grid points they move as the solver moves them.
    std::vector<Pose> collider_poses(const std::string& node, const std::string& solver) const {
        std::vector<Pose> poses;
        for (const double frame : source_.frames) {
            const SceneTime time = time_of(solver, frame);
            const Pose from = collider_pose(node, time.grid());
            if (time.is_on_grid()) {
                poses.push_back(from);
                continue;
            }
            const Pose to = collider_pose(node, time.grid() + 1);
            poses.push_back(interpolate(DrivenPose{.begin = from, .end = to}, time.share()));
        }
        return poses;
    }

    Status add_rigid_bodies(const std::string& solver) {
        const std::vector<SocketReference> wires = graph_.wires({solver, "rigid_bodies"}).take();
        if (wires.empty()) return {};
        const std::map<double, fs::path> states = states_of(solver);
        if (states.empty()) {
            found_.notes.push_back("rigid bodies of '" + solver + "' are left out: bake its state (bake_state)");
            return {};
        }
        std::vector<std::map<double, Pose>> baked(wires.size());
        for (const auto& [frame, path] : states) {
            const auto file = read_state_file(path.string());
            if (!file) return file.error();
            if (file->state.rigid_bodies.size() != wires.size())
                return bad_input(path.string(), "has other rigid bodies than the graph", "bake again");
            for (size_t i = 0; i < wires.size(); ++i)
                baked[i][frame] = {file->state.rigid_bodies[i].position, file->state.rigid_bodies[i].orientation};
        }
        for (size_t i = 0; i < wires.size(); ++i)
            if (seen_.insert(wires[i].node).second)
                if (Status s = add(wires[i].node, poses_of(baked[i]), "Rigid Body"); !s) return s;
        return {};
    }

    /// At the frames wanted: where the state was baked less often than the meshes, straight from one to the next.
    std::vector<Pose> poses_of(const std::map<double, Pose>& baked) const {
        std::vector<Pose> poses;
        for (const double frame : source_.frames) {
            const auto next = baked.lower_bound(frame);
            if (next->first == frame) {
                poses.push_back(next->second);
                continue;
            }
            const auto& [before, pose] = *std::prev(next);
            poses.push_back(
                interpolate(DrivenPose{.begin = pose, .end = next->second}, (frame - before) / (next->first - before)));
        }
        return poses;
    }

    /// Files with the solver's state, at the frames wanted; none if it was not baked.
    std::map<double, fs::path> states_of(const std::string& solver) const {
        std::map<double, fs::path> paths;
        for (const ManifestFrame& frame : source_.manifest.frames) {
            if (frame.frame < source_.frames.front() || frame.frame > source_.frames.back()) continue;
            frame.for_each_file([&](double at, const ManifestFile& file) {
                const auto wires = graph_.wires({file.node, "state"});
                if (at >= source_.frames.front() && wires && !wires->empty() && wires->front().node == solver &&
                    uncompressed_path(file.path).ends_with(".ply"))
                    paths.try_emplace(at, source_.bake / file.path);
            });
        }
        return paths;
    }

    Result<TriMesh> mesh_of(const std::string& node, const Look& look) {
        if (!look.mesh.empty()) return read_mesh((source_.bake / look.mesh).string());
        const double first = source_.frames.front();
        Shape shape;
        const std::string kind = at(node, "shape", first).get<std::string>();
        if (kind == "mesh") return solid_mesh(node);
        shape.radius = at(node, "radius", first).get<double>();
        shape.half_extents = vector3(at(node, "size", first)) / 2;
        if (kind == "capsule") shape.half_height = at(node, "height", first).get<double>() / 2;
        shape.kind = kind == "box"       ? ShapeKind::box
                     : kind == "capsule" ? ShapeKind::capsule
                     : kind == "plane"   ? ShapeKind::plane
                                         : ShapeKind::sphere;
        return shape_mesh(shape, kPlaneExtent * extent_);
    }

    /// Of a collider of shape mesh: the file or wire that it was made from.
    Result<TriMesh> solid_mesh(const std::string& node) {
        const double first = source_.frames.front();
        const std::string path = at(node, "path", first).get<std::string>();
        Result<TriMesh> mesh = TriMesh{};
        if (path.empty()) {
            const SocketReference wire = graph_.wires({node, "mesh"}).take().front();
            const auto value = graph_.evaluate(wire.node, wire.socket, first);
            if (!value) return value.error();
            mesh = *std::get<std::shared_ptr<const TriMesh>>(*value);
        } else {
            mesh = read_mesh((source_.graph_folder / path).string());  // absolute paths stay
        }
        const double scale = at(node, "scale", first).get<double>();
        if (mesh)
            for (Vec3& p : mesh->positions) p *= scale;
        return mesh;
    }

    /// A collider that deforms, by the places that the solver had it at.
    Status add_surface(const std::string& node, const std::string& solver) {
        const Result<TriMesh> mesh = solid_mesh(node);
        const auto value = graph_.evaluate(node, "collider", graph_.frame_range()[0]);
        if (!mesh || !value) {
            found_.notes.push_back("'" + node + "' is left out, for its mesh or motion cannot be read: " +
                                   (mesh ? value.error() : mesh.error()).text() +
                                   "; --graph-folder tells where the graph lay");
            return {};
        }
        const auto surface = std::get<std::shared_ptr<const ColliderValue>>(*value)->surface;
        std::vector<SceneTime> times;
        for (const double frame : source_.frames) times.push_back(time_of(solver, frame));
        const auto look = source_.looks.find(node);
        const Look shown = look == source_.looks.end() ? Look{} : look->second;
        found_.meshes.push_back(
            {.name = shown.name.empty() ? node : shown.name,
             .read = [mesh = *mesh, surface, times = std::move(times)](size_t i) -> Result<MeshFrame> {
                 return deformed(mesh, *surface->from(times[i].grid()), times[i].share());
             },
             .look = shown,
             .is_surface = true});
        return {};
    }

    Status add(const std::string& node, std::vector<Pose> poses, const char* material) {
        const auto known = source_.looks.find(node);
        const Look look = known == source_.looks.end() ? Look{} : known->second;
        const Result<TriMesh> mesh = mesh_of(node, look);
        if (!mesh) {
            if (!look.mesh.empty()) return mesh.error();
            found_.notes.push_back("'" + node + "' is left out, for its mesh cannot be read: " + mesh.error().text() +
                                   "; --graph-folder tells where the graph lay");
            return {};
        }
        const auto is_there = [&](const Pose& p) {
            return p.position == poses[0].position && p.orientation.coeffs() == poses[0].orientation.coeffs();
        };
        if (std::ranges::all_of(poses, is_there)) poses.resize(1);
        MeshFrame frame{visual_mesh(*mesh), {}};
        const int32_t last = frame.mesh.triangle_material.empty() ? 0 : std::ranges::max(frame.mesh.triangle_material);
        frame.materials.assign(static_cast<size_t>(last) + 1, material);
        found_.meshes.push_back({.name = look.name.empty() ? node : look.name,
                                 .read = [frame](size_t) -> Result<MeshFrame> { return frame; },
                                 .look = look,
                                 .poses = std::move(poses)});
        return {};
    }

    const SolidSource& source_;
    const double extent_;  // m
    Graph graph_;
    ShotSolids found_;
    std::set<std::string> seen_;  // nodes
};

}  // namespace

Result<ShotSolids> shot_solids(const SolidSource& source, double extent) {
    auto graph = Graph::from_json_text(source.manifest.graph.dump(), (source.bake / kManifestName).string(),
                                       source.graph_folder.string());
    if (!graph) return graph.error();
    return SolidFinder(source, extent, graph.take()).run();
}

}  // namespace sunder
