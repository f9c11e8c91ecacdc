#include "nodes/exports/shot_looks.h"

#include "nodes/bake_files/bake_folder.h"
#include "nodes/files/file_io.h"
#include "nodes/graph/strict_json.h"

namespace sunder {
namespace {

bool is_share(const Json& value) { return value.is_number() && value >= 0 && value <= 1; }

// What is not in `io_value`'s type is refused; what is not there stays as it is.
Status read_text(const Json& fields, const char* name, std::string& io_value, const std::string& where) {
    if (!fields.contains(name)) return {};
    if (!fields[name].is_string()) return bad_input(where, "'" + std::string(name) + "' is no text");
    io_value = fields[name].get<std::string>();
    return {};
}

Result<Surface> surface_of(const Json& fields, const std::string& where) {
    Surface surface;
    if (!fields.is_object()) return bad_input(where, "is no object");
    if (Status s = read_text(fields, "name", surface.name, where); !s) return s.error();
    const std::array<std::pair<const char*, double*>, 3> shares = {
        {{"metallic", &surface.metallic}, {"roughness", &surface.roughness}, {"transmission", &surface.transmission}}};
    for (const auto& [name, target] : shares) {
        if (!fields.contains(name)) continue;
        if (!is_share(fields[name])) return bad_input(where, "'" + std::string(name) + "' is not from 0 to 1");
        *target = fields[name].get<double>();
    }
    if (fields.contains("color_varies") && !fields["color_varies"].is_boolean())
        return bad_input(where, "'color_varies' is neither true nor false");
    if (!fields.contains("color")) return surface;
    surface.takes_vertex_colors = fields.value("color_varies", false);
    const Json& color = fields["color"];
    if (!color.is_array() || color.size() != 4) return bad_input(where, "'color' is not four numbers from 0 to 1");
    for (size_t k = 0; k < 4; ++k) {
        if (!is_share(color[k])) return bad_input(where, "'color' is not four numbers from 0 to 1");
        surface.color[k] = color[k].get<double>();
    }
    return surface;
}

Result<Look> look_of(const Json& fields, const std::string& where) {
    Look look;
    if (!fields.is_object()) return bad_input(where, "is no object");
    if (Status s = read_text(fields, "name", look.name, where); !s) return s.error();
    if (Status s = read_text(fields, "mesh", look.mesh, where); !s) return s.error();
    if (!look.mesh.empty() && !is_path_inside(look.mesh))
        return bad_input(where, "mesh '" + look.mesh + "' leaves the bake folder");
    if (fields.contains("interior")) {
        auto surface = surface_of(fields["interior"], where + ", interior");
        if (!surface) return surface.error();
        look.interior = surface.take();
    }
    if (!fields.contains("materials")) return look;
    if (!fields["materials"].is_array()) return bad_input(where, "'materials' is no list");
    for (const Json& entry : fields["materials"]) {
        auto surface = surface_of(entry, where + ", material " + std::to_string(look.surfaces.size()));
        if (!surface) return surface.error();
        look.surfaces.push_back(surface.take());
    }
    return look;
}

}  // namespace

Result<std::map<std::string, Look>> read_looks(const std::filesystem::path& bake_folder) {
    std::map<std::string, Look> looks;
    const std::filesystem::path path = bake_folder / kLooksName;
    std::error_code code;
    if (!std::filesystem::exists(path, code)) return looks;
    const auto text = read_file(path, uint64_t{64} << 20);
    if (!text) return text.error();
    const auto content = parse_json(*text, path.string());
    if (!content) return content.error();
    if (!content->is_object() || content->value("sunder_looks", Json()) != 1 || !content->contains("nodes") ||
        !(*content)["nodes"].is_object())
        return bad_input(path.string(), "holds no looks that this version knows", "remove it, or bake again");
    for (const auto& [node, fields] : (*content)["nodes"].items()) {
        auto look = look_of(fields, path.string() + ", node '" + node + "'");
        if (!look) return look.error();
        looks[node] = look.take();
    }
    return looks;
}

}  // namespace sunder
