// collider: a solid that moves as it is told and is pushed by nothing.
#include "fracture_tools/level_set.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

ShapeKind kind_of(const std::string& name) {
    if (name == "sphere") return ShapeKind::sphere;
    if (name == "box") return ShapeKind::box;
    if (name == "capsule") return ShapeKind::capsule;
    if (name == "mesh") return ShapeKind::mesh;
    return ShapeKind::plane;
}

/// The level set as it was made last, with the key of the node that it was made for.
struct LevelSetStore {
    ContentKey node = 0;
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
             .needs = {{is("shape", {"mesh"})}}},
            {.name = "resolution",
             .label = "Resolution",
             .type = ParameterType::integer,
             .min = 8,
             .max = 1000,
             .default_value = 100,
             .sentence = "Voxels along the mesh's longest side. What is thinner than two voxels is lost, edges are "
                         "rounded by a third of one; memory grows with the cube: 100 takes 5 MiB at most, 256 MiB are "
                         "permitted",
             .needs = {{is("shape", {"mesh"}), is("voxel_size", {nullptr})}}},
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
             .needs = {{is("shape", {"mesh"})}}},
            {.name = "thickness",
             .label = "Thickness",
             .type = ParameterType::number,
             .unit = "m",
             .min = 0,
             .max = 1e5,
             .default_value = 0.0,
             .sentence = "Above 0 the mesh need not be closed: what collides is all within half of this of its "
                         "surface. At least two voxels",
             .needs = {{is("shape", {"mesh"})}}}};
}

}  // namespace

NodeType collider_node() {
    NodeDescription d{
        .type = "collider",
        .label = "Collider",
        .category = "simulation",
        .sentence = "A solid that moves as its keys tell it and is pushed by nothing: floor, wall, tool."};
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
                     "`mesh` or `path`, as distances on a grid of voxels",
         .choices = {"plane", "sphere", "box", "capsule", "mesh"}},
        position_parameter(Animation::animatable, "Of its centre, of a point of the plane, or of the mesh's origin"),
        rotation_parameter(Animation::animatable, "About its position"),
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
    gather(d.parameters, "Sampling", {"resolution", "voxel_size", "thickness"});
    return {.description = d, .cook = cook_collider};
}

}  // namespace sunder
