#include "nodes/exports/fragment_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "nodes/files/file_io.h"
#include "nodes/files/layer_columns.h"
#include "nodes/files/ply_file.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPieceMagic = "comment sunder piece 1";

std::string piece_path(size_t fragment) {
    char text[40];
    std::snprintf(text, sizeof text, "pieces/piece.%04zu.ply", fragment + 1);
    return text;
}

Json to_array(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

// Names of pieces in the folder that we wrote before; a piece by that name that somebody else wrote is an error.
Result<std::vector<fs::path>> earlier_pieces(const fs::path& folder) {
    std::vector<fs::path> found;
    std::error_code code;
    for (fs::directory_iterator it(folder / "pieces", code), end; !code && it != end; it.increment(code)) {
        const std::string name = it->path().filename().string();
        if (!name.starts_with("piece.") || !name.ends_with(".ply")) continue;
        auto bytes = read_file(it->path());
        if (!bytes) return bytes.error();
        if (bytes->substr(0, 200).find(kPieceMagic) == std::string::npos)
            return bad_input(it->path().string(), "is there already and was not written by sunder",
                             "choose another folder, or move it away");
        found.push_back(it->path());
    }
    std::sort(found.begin(), found.end());
    return found;
}

Status require_own_listing(const fs::path& listing) {
    std::error_code code;
    if (!fs::exists(fs::symlink_status(listing, code))) return {};
    auto bytes = read_file(listing);
    if (!bytes) return bytes.error();
    const Json json = Json::parse(*bytes, nullptr, false);
    if (!json.is_object() || !json.contains("sunder"))
        return bad_input(listing.string(), "is there already and was not written by sunder",
                         "choose another folder, or move it away");
    return {};
}

Error not_removed(const fs::path& path, const std::error_code& code) {
    return io_error(path.string(), "cannot remove: " + code.message());
}

}  // namespace

Json fragments_to_json(const FragmentSet& set) {
    Json json;
    json["sunder"] = SUNDER_VERSION;
    json["source"] = {{"path", set.source_path}, {"volume", set.source_volume}, {"area", set.source_area}};
    Json fragments = Json::array(), interfaces = Json::array();
    double volume = 0, interface_area = 0;
    for (size_t i = 0; i < set.fragments.size(); ++i) {
        const Fragment& f = set.fragments[i];
        volume += f.volume;
        fragments.push_back(
            {{"id", i},
             {"volume", f.volume},
             {"centroid", to_array(f.centroid)},
             {"radii", to_array(f.radii)},
             {"orientation", {f.orientation.w(), f.orientation.x(), f.orientation.y(), f.orientation.z()}},
             {"cluster", f.cluster},
             {"toughness_factor", f.toughness_factor},
             {"yield_factor", f.yield_factor},
             {"density_factor", f.density_factor},
             {"file", piece_path(i)}});
    }
    for (const Interface& i : set.interfaces) {
        interface_area += i.area;
        interfaces.push_back(
            {{"a", i.a.value},
             {"b", i.b.value},
             {"area", i.area},
             {"normal", to_array(i.normal)},
             {"centroid", to_array(i.centroid)},
             {"toughness_factor", std::isinf(i.toughness_factor) ? Json(nullptr) : Json(i.toughness_factor)},
             {"joins", i.joins}});
    }
    json["fragments"] = std::move(fragments);
    json["interfaces"] = std::move(interfaces);
    const Status whole = check_fragments(set);
    json["checks"] = {{"closed", static_cast<bool>(whole)},
                      {"fault", whole ? Json(nullptr) : Json(whole.error().text())},
                      {"fragments", set.fragments.size()},
                      {"interfaces", set.interfaces.size()},
                      {"volume", volume},
                      {"volume_error", set.source_volume > 0 ? (volume - set.source_volume) / set.source_volume : 0.0},
                      {"interface_area", interface_area}};
    json["materials"] = set.material_names;
    json["interior_material"] = set.interior_material;
    json["warnings"] = set.warnings;
    return json;
}

ByteBuffer encode_piece(const TriMesh& piece) {
    const bool has_uvs = !piece.corner_uvs.empty();
    PlyElement face{"face",
                    piece.triangles.size(),
                    {{"vertex_indices", PlyType::int32, PlyType::uint8}, {"material", PlyType::int32, {}}}};
    if (has_uvs) face.properties.push_back({"texcoord", PlyType::float32, PlyType::uint8});
    const bool has_normals = !piece.corner_normals.empty(), has_colors = !piece.corner_colors.empty();
    if (has_normals) face.properties.push_back({"corner_normals", PlyType::float32, PlyType::uint8});
    if (has_colors) face.properties.push_back({"corner_colors", PlyType::float32, PlyType::uint8});
    PlyElement vertex{"vertex", piece.positions.size(), ply_scalars("x y z", PlyType::float64)};
    const LayerColumns of_vertices(piece.layers, false), of_faces(piece.layers, true);
    of_vertices.add_properties(vertex), of_faces.add_properties(face);
    ByteBuffer bytes;
    const auto put = [&](const void* data, size_t n) { bytes.append(data, n); };
    bytes.reserve(4096 + piece.positions.size() * 24 + piece.triangles.size() * (has_uvs ? 42 : 17));
    write_ply_header(bytes,
                     {{std::string(kPieceMagic.substr(8)), "written by sunder " SUNDER_VERSION}, {vertex, face}});
    for (size_t v = 0; v < piece.positions.size(); ++v) {
        bytes.append(piece.positions[v].data(), sizeof(double) * 3);
        of_vertices.write_row(v, put);
    }
    for (size_t t = 0; t < piece.triangles.size(); ++t) {
        bytes.number(uint8_t{3});
        bytes.append(piece.triangles[t].data(), sizeof(uint32_t) * 3);
        bytes.number(piece.triangle_material.empty() ? int32_t{0} : piece.triangle_material[t]);
        if (has_uvs) {
            bytes.number(uint8_t{6});
            for (size_t c = 0; c < 3; ++c) bytes.append(piece.corner_uvs[3 * t + c].data(), sizeof(float) * 2);
        }
        if (has_normals) {
            bytes.number(uint8_t{9});
            for (size_t c = 0; c < 3; ++c) bytes.append(piece.corner_normals[3 * t + c].data(), sizeof(float) * 3);
        }
        if (has_colors) {
            bytes.number(uint8_t{12});
            for (size_t c = 0; c < 3; ++c) bytes.append(piece.corner_colors[3 * t + c].data(), sizeof(float) * 4);
        }
        of_faces.write_row(t, put);
    }
    return bytes;
}

Status write_fragments(const FragmentSet& set, const fs::path& folder, const Progress& progress) {
    const fs::path listing = folder / "fragments.json";
    if (fs::is_symlink(folder / "pieces"))
        return bad_input((folder / "pieces").string(), "leads out of the output folder through a link",
                         "remove the link, or choose another folder");
    if (Status s = require_own_listing(listing); !s) return s;
    auto earlier = earlier_pieces(folder);
    if (!earlier) return earlier.error();
    if (Status s = make_folders(folder / "pieces"); !s) return s;
    std::error_code code;
    if (fs::remove(listing, code); code) return not_removed(listing, code);

    const size_t n = set.fragments.size();
    const FragmentMeshes pieces(set);
    for (size_t i = 0; i < n; ++i) {
        if (!progress.report(static_cast<double>(i) / static_cast<double>(n), "writing pieces")) return cancelled();
        const TriMesh piece = pieces.mesh(FragmentId(i));
        if (auto written = write_file(folder / piece_path(i), encode_piece(piece).view()); !written)
            return written.error();
    }
    for (const fs::path& old : *earlier) {  // of an earlier cut into more pieces
        size_t number = 0;
        if (std::sscanf(old.filename().c_str(), "piece.%zu.ply", &number) == 1 && number >= 1 && number <= n &&
            folder / piece_path(number - 1) == old)
            continue;
        if (fs::remove(old, code); code) return not_removed(old, code);
    }
    const std::string text = fragments_to_json(set).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
    if (auto written = write_file(listing, text); !written) return written.error();
    return {};
}

}  // namespace sunder
