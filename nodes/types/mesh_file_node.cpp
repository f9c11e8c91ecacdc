// mesh_file: a triangle mesh from a file.
#include <algorithm>

#include "fracture_tools/mesh/mesh_io.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/json.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Status check_mesh_file(const std::string& node, const Parameters& parameters) {
    if (parameters.text("path").empty())
        return node_error(node, "path", "no file is given", "OBJ, PLY, STL, glTF, GLB, FBX or OFF");
    return {};
}

/// Turned about the origin; a rotation leaves volumes and handedness alone.
void rotate(TriMesh& io_mesh, const Quat& rotation) {
    for (Vec3& p : io_mesh.positions) p = rotation * p;
    const Eigen::Quaternionf turn = rotation.cast<float>();
    for (Vec3f& n : io_mesh.corner_normals) n = (turn * n).normalized();
}

Status add_groups(CookContext& context, const Json& groups, TriMesh& io_mesh) {
    for (const auto& [name, list] : groups.items()) {
        std::vector<uint32_t> vertices = list.get<std::vector<uint32_t>>();
        std::ranges::sort(vertices);
        vertices.erase(std::ranges::unique(vertices).begin(), vertices.end());
        if (!vertices.empty() && vertices.back() >= io_mesh.positions.size())
            return context.error("groups", "group '" + name + "' has vertex " + std::to_string(vertices.back()),
                                 "the mesh has vertices 0 to " + std::to_string(io_mesh.positions.size() - 1));
        io_mesh.vertex_groups[name] = std::move(vertices);
    }
    return {};
}

Result<Value> cook_mesh_file(CookContext& context) {
    const Parameters& p = context.parameters();
    Result<TriMesh> read = read_mesh(context.resolve(p.text("path")), {.scale = p.number("scale")});
    if (!read) {
        Error error = read.error();
        error.node = context.node();
        error.parameter = "path";
        error.where =
            "node '" + context.node() + "', parameter 'path'" + (error.where.empty() ? "" : ": " + error.where);
        return error;
    }
    TriMesh mesh = read.take();
    const Vec3 rotation = p.vector3("rotation");
    if (!rotation.isZero(0)) rotate(mesh, euler_xyz(rotation));
    if (Status ok = add_groups(context, p.value("groups"), mesh); !ok) return ok.error();
    return make_value(std::move(mesh));
}

}  // namespace

NodeType mesh_file_node() {
    NodeDescription d{
        .type = "mesh_file",
        .label = "Mesh File",
        .category = "input",
        .sentence =
            "Reads a triangle mesh from a file: OBJ, PLY, STL, glTF, GLB, FBX or OFF. Colours of vertices are "
            "kept, and further numbers that a PLY file has for each vertex."};
    d.outputs = {
        {.name = "mesh", .label = "Mesh", .type = SocketType::mesh, .sentence = "All meshes of the file as one"}};
    d.parameters = {
        {.name = "path",
         .label = "Path",
         .type = ParameterType::path,
         .default_value = "",
         .sentence = "The file, relative to the graph file's folder"},
        {.name = "scale",
         .label = "Scale",
         .type = ParameterType::number,
         .unit = "m per file unit",
         .min = 0,
         .max = 1e6,
         .min_excluded = true,
         .default_value = 1.0,
         .sentence = "Length of the file's unit in metres; for FBX, which tells its unit, a factor on that"},
        rotation_parameter(Animation::constant, "Turns the mesh about its origin, for files whose up axis is not z"),
        {.name = "groups",
         .label = "Vertex Groups",
         .type = ParameterType::vertex_groups,
         .default_value = JsonValue::empty_object(),
         .sentence = "Named lists of vertices (numbered as read, equal positions being one vertex), for pins"}};
    return {.description = d, .cook = cook_mesh_file, .check = check_mesh_file};
}

}  // namespace sunder
