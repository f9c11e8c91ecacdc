// collider: a solid that moves as it is told and is pushed by nothing.
#include "fracture_tools/level_set.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/vertex_source.h"

namespace sunder {
namespace {

ShapeKind kind_of(const std::string& name) {
    if (name == "sphere") return ShapeKind::sphere;
    if (name == "box") return ShapeKind::box;
    if (name == "capsule") return ShapeKind::capsule;
    if (name == "mesh") return ShapeKind::mesh;
    return ShapeKind::plane;
}

/// The level set, or the motion of a mesh that deforms, as it was made last, with the key of the node that it was made
/// for.
struct LevelSetStore {
    ContentKey node = 0;
    std::shared_ptr<const SurfaceMotion> motion;
    std::shared_ptr<const SignedDistanceGrid> grid;
    std::vector<std::string> warnings;
};

Result<std::shared_ptr<const TriMesh>> mesh_of(CookContext& context) {
    const std::string path = context.parameters().text("path");
    const Result<std::vector<Value>> wired = context.inputs("mesh", context.start_frame());
    if (!wired) return wired.error();
    if (wired->empty() == path.empty())
        return context.error("mesh",
                             path.empty() ? "no mesh is wired, and no path given" : "is wired, and a path given",
                             "shape 'mesh' takes one of the two");
    if (!wired->empty()) return std::get<std::shared_ptr<const TriMesh>>(wired->front());
    Result<TriMesh> read = read_mesh(context.resolve(path));
    if (read) return std::make_shared<const TriMesh>(read.take());
    Error error = read.error();
    error.node = context.node();
    error.parameter = "path";
    return error;
}

ContentKey key_of(const TriMesh& mesh, const LevelSetSettings& settings) {
    KeyHasher hasher;
    hasher.add(settings.voxel_size).add(settings.resolution).add(settings.thickness).add(mesh.positions.size());
    for (const Vec3& p : mesh.positions) hasher.add(p);
    for (const Triangle& t : mesh.triangles) hasher.add(t[0]).add(t[1]).add(t[2]);
    return hasher.key();
}

/// Made when the mesh or how it is sampled has changed, not at every frame: its motion is the pose's.
Result<LevelSetStore*> level_set(CookContext& context) {
    LevelSetStore& store = context.store().get<LevelSetStore>();
    const ContentKey node = context.key();
    if (store.grid && store.node == node) return &store;
    Result<std::shared_ptr<const TriMesh>> source = mesh_of(context);
    if (!source) return source.error();
    const Parameters& p = context.parameters();
    TriMesh mesh = **source;
    for (Vec3& x : mesh.positions) x *= p.number("scale");
    const LevelSetSettings settings{p.number_or("voxel_size", 0), p.integer("resolution"), p.number("thickness")};
    const ContentKey key = key_of(mesh, settings);
    if (!store.grid || store.grid->key != key) {
        store.warnings.clear();
        Result<SignedDistanceGrid> grid =
            make_level_set(mesh, settings, "node '" + context.node() + "'", store.warnings);
        if (!grid) return grid.error();
        grid->key = key;
        store.grid = std::make_shared<const SignedDistanceGrid>(grid.take());
    }
    store.node = node;
    return &store;
}

Result<std::shared_ptr<const SurfaceMotion>> surface_motion(CookContext& context) {
    LevelSetStore& store = context.store().get<LevelSetStore>();
    const ContentKey node = context.key();
    if (store.motion && store.node == node) return store.motion;
    Result<std::shared_ptr<const TriMesh>> mesh = mesh_of(context);
    if (!mesh) return mesh.error();
    Result<VertexFrames> frames = vertex_frames(context, kMotionPrefix, (*mesh)->positions.size());
    if (!frames) return frames.error();
    const Parameters& p = context.parameters();
    auto motion = SurfaceMotion::make(**mesh, frames.take(), p.number("thickness"));
    if (!motion) {
        const bool is_of_mesh = motion.error().where == "mesh";
        return context.error(is_of_mesh ? "mesh" : vertex_parameter(p, kMotionPrefix), motion.error().what,
                             motion.error().mend);
    }
    store.motion = motion.take(), store.node = node;
    return store.motion;
}

bool deforms(const Parameters& p) { return p.text("shape") == "mesh" && is_of_places(p); }

Status check_collider(const std::string& node, const Parameters& p) {
    return deforms(p) ? check_vertex_source(node, p, kMotionPrefix) : Status();
}

Result<Value> cook_collider(CookContext& context) {
    ColliderValue value;
    const Parameters& p = context.parameters();
    value.collider.name = context.node();
    value.collider.shape.kind = kind_of(p.text("shape"));
    value.collider.shape.radius = p.number("radius");
    value.collider.shape.half_extents = p.vector3("size") / 2;
    value.collider.shape.half_height = p.number("height") / 2;
    value.collider.friction = p.number("friction");
    value.collider.restitution = p.number("restitution");
    if (deforms(p)) {
        const auto motion = surface_motion(context);
        if (!motion) return motion.error();
        value.surface = *motion, value.collider.tree = value.surface->tree();
        return make_value(std::move(value));
    }
    value.pose = pose_of(p);
    if (value.collider.shape.kind == ShapeKind::mesh) {
        const Result<LevelSetStore*> made = level_set(context);
        if (!made) return made.error();
        value.collider.grid = (*made)->grid;
        value.collider.shape.grid = value.collider.grid.get();
        value.warnings = (*made)->warnings;
    }
    return make_value(std::move(value));
}

std::vector<ParameterDescription> mesh_parameters() {
    return {{.name = "path",
             .label = "Path",
             .type = ParameterType::path,
             .default_value = "",
             .sentence = "Of the file with the mesh of shape mesh, where none is wired; relative to the graph file's "
                         "folder",
             .needs = {{is("shape", {"mesh"})}}},
            {.name = "scale",
             .label = "Scale",
             .type = ParameterType::number,
             .min = 0,
             .max = 1e6,
             .min_excluded = true,
             .default_value = 1.0,
             .sentence = "Lengths of the mesh are multiplied by this, about its origin",
             .needs = {{is("shape", {"mesh"}), is("motion", {"transform"})}}},
            {.name = "resolution",
             .label = "Resolution",
             .type = ParameterType::integer,
             .min = 8,
             .max = 1000,
             .default_value = 100,
             .sentence = "Voxels along the mesh's longest side. What is thinner than two voxels is lost, edges are "
                         "rounded by a third of one; memory grows with the cube: 100 takes 5 MiB at most, 256 MiB are "
                         "permitted",
             .needs = {{is("shape", {"mesh"}), is("motion", {"transform"}), is("voxel_size", {nullptr})}}},
            {.name = "voxel_size",
             .label = "Voxel Size",
             .type = ParameterType::number,
             .unit = "m",
             .min = 0,
             .max = 1e6,
             .min_excluded = true,
             .default_value = nullptr,
             .sentence = "Sets the size of voxels itself; null goes by the resolution",
             .nullable = true,
             .needs = {{is("shape", {"mesh"}), is("motion", {"transform"})}}},
            {.name = "thickness",
             .label = "Thickness",
             .type = ParameterType::number,
             .unit = "m",
             .min = 0,
             .max = 1e5,
             .default_value = 0.0,
             .sentence = "Above 0 the mesh need not be closed: what collides is all within half of this of its "
                         "surface. Of motion transform at least two voxels",
             .needs = {{is("shape", {"mesh"})}}}};
}

}  // namespace

NodeType collider_node() {
    NodeDescription d{
        .type = "collider",
        .label = "Collider",
        .category = "simulation",
        .sentence =
            "A solid that moves as its keys tell it, or deforms as an animation does, and is pushed by nothing: "
            "floor, wall, tool, arm."};
    d.outputs = {{.name = "collider", .label = "Collider", .type = SocketType::collider, .sentence = "For a solver"}};
    d.inputs = {{.name = "mesh",
                 .label = "Mesh",
                 .type = SocketType::mesh,
                 .required = false,
                 .sentence = "Of shape mesh: a closed surface that bounds a solid"}};
    d.parameters = {
        {.name = "shape",
         .label = "Shape",
         .type = ParameterType::choice,
         .default_value = "plane",
         .sentence = "plane: all below z = 0 of its own frame; sphere takes `radius`; box takes `size`; "
                     "capsule takes `radius` and `height` along its z axis; mesh takes any solid from "
                     "`mesh` or `path`, as distances on a grid of voxels, or as its triangles where it deforms",
         .choices = {"plane", "sphere", "box", "capsule", "mesh"}},
        needing({{is("motion", {"transform"})}, {is("shape", {"plane", "sphere", "box", "capsule"})}},
                position_parameter(Animation::animatable,
                                   "Of its centre, of a point of the plane, or of the mesh's origin")),
        needing({{is("motion", {"transform"})}, {is("shape", {"plane", "sphere", "box", "capsule"})}},
                rotation_parameter(Animation::animatable, "About its position")),
        needing({{is("shape", {"sphere", "capsule"})}}, radius_parameter("Of sphere and capsule")),
        needing({{is("shape", {"box"})}}, size_parameter()),
        {.name = "height",
         .label = "Height",
         .unit = "m",
         .min = 0,
         .max = 1e5,
         .min_excluded = true,
         .default_value = 1.0,
         .sentence = "Of the capsule between the centres of its two caps",
         .needs = {{is("shape", {"capsule"})}}},
        surface_parameter("friction"),
        surface_parameter("restitution")};
    for (ParameterDescription& p : mesh_parameters()) d.parameters.push_back(std::move(p));
    d.parameters.push_back(
        needing({{is("shape", {"mesh"})}},
                motion_parameter(
                    "Of shape mesh. transform: it moves as one, by `position` and `rotation`; vertices: it deforms, "
                    "each vertex being where `motion_path` or `positions` say")));
    for (ParameterDescription& p : vertex_parameters(kMotionPrefix, {is("shape", {"mesh"})}))
        d.parameters.push_back(std::move(p));
    gather(d.parameters, "Sampling", {"resolution", "voxel_size", "thickness"});
    return {.description = d, .cook = cook_collider, .check = check_collider};
}

}  // namespace sunder
