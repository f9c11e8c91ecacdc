#include "nodes/file_info.h"

#include <cstdio>
#include <filesystem>
#include <set>

#include "fracture_tools/mesh/layer_property.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/suggest_pieces.h"
#include "nodes/bake_files/manifest.h"
#include "nodes/files/compression.h"
#include "nodes/files/frame_number.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/ply_file.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/strict_json.h"
#include "nodes/graph/value.h"
#include "solver/data/math_functions.h"
#include "solver/scene/scales.h"
#include "solver/solver.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

template <class... Values>
std::string format(const char* pattern, Values... values) {
    char text[400];
    std::snprintf(text, sizeof text, pattern, values...);
    return text;
}

std::string box_text(const Aabb& b) {
    return format("bounds         (%g %g %g) to (%g %g %g) m", b.min.x(), b.min.y(), b.min.z(), b.max.x(), b.max.y(),
                  b.max.z());
}

Result<Lines> describe_mesh(const std::string& path) {
    const auto mesh = read_mesh(path);
    if (!mesh) return mesh.error();
    const MeshReport r = check_mesh(*mesh);
    Lines lines = {path + ": mesh", format("vertices       %zu", r.n_vertices),
                   format("triangles      %zu in %zu components", r.n_triangles, r.n_components),
                   format("volume, area   %g m3, %g m2", r.volume, r.area), box_text(r.bounds)};
    for (const std::string& name : mesh->material_names) lines.push_back("material       " + name);
    lines.push_back(std::string("UVs, normals   ") + (mesh->corner_uvs.empty() ? "no" : "yes") + ", " +
                    (mesh->corner_normals.empty() ? "no" : "yes"));
    for (const MeshLayer& layer : mesh->layers) lines.push_back("layer          " + layer_prefix(layer) + layer.name);
    if (r.is_solid())
        lines.push_back(format("pieces         about %d, %d or %d to deform within 10, 5 or 2 %% of the continuum",
                               suggest_pieces(*mesh, 0.1), suggest_pieces(*mesh, 0.05), suggest_pieces(*mesh, 0.02)));
    lines.push_back(r.is_solid() ? "bounds a solid" : "bounds no solid:");
    for (const std::string& fault : r.faults) lines.push_back("  " + fault);
    return lines;
}

Result<Lines> describe_state(std::string bytes, const std::string& path) {
    auto file = decode_state(std::move(bytes), path);
    if (!file) return file.error();
    const FrameState& s = file->state;
    size_t n_intact = 0;
    for (uint8_t intact : s.edge_intact) n_intact += intact;
    Aabb box;
    double strain = 0;
    for (const Vec3& p : s.position) box.extend(p);
    for (double e : s.strain) strain = std::max(strain, e);
    return Lines{path + ": state frame",
                 format("frame, time    %s, %.9g s", frame_text(file->frame).c_str(), s.time),
                 format("particles      %zu in %zu bodies", s.n_particles(),
                        std::set<uint32_t>(file->body.begin(), file->body.end()).size()),
                 format("edges          %zu, %zu intact, %zu broken in this frame", s.edge_intact.size(), n_intact,
                        s.broken.size()),
                 format("rigid bodies   %zu", s.rigid_bodies.size()),
                 format("largest strain %g", strain),
                 box_text(box),
                 "state hash     " + hex(state_hash(s))};
}

Result<Lines> describe_ply(std::string bytes, const std::string& path, const char* kind) {
    const auto file = PlyFile::parse(std::move(bytes), path);
    if (!file) return file.error();
    Lines lines = {path + ": " + kind};
    for (const PlyElement& e : file->header().elements) {
        std::string names;
        for (const PlyProperty& p : e.properties) names += " " + p.name;
        lines.push_back(format("%-14s %llu:", e.name.c_str(), static_cast<unsigned long long>(e.count)) + names);
    }
    return lines;
}

Result<Lines> describe_bake(const fs::path& folder) {
    const auto m = read_manifest(folder);
    if (!m) return m.error();
    size_t n_files = 0;
    uint64_t bytes = 0;
    for (const ManifestFrame& frame : m->frames)
        frame.for_each_file([&](double, const ManifestFile& f) { ++n_files, bytes += f.stamp.size; });
    return Lines{
        folder.string() + ": bake by Sunder " + m->version,
        format("frames         %zu of %d to %d%s", m->frames.size(), m->frame_range[0], m->frame_range[1],
               static_cast<int>(m->frames.size()) == m->frame_range[1] - m->frame_range[0] + 1 ? ", complete"
                                                                                               : ", not complete"),
        format("files          %zu, %llu bytes", n_files, static_cast<unsigned long long>(bytes)),
        format("nodes          %zu", m->graph["nodes"].size())};
}

Result<Lines> describe_fragments(const std::string& path, const Json& json) {
    const auto count = [&](const char* name) {
        return json.contains(name) && json[name].is_array() ? json[name].size() : 0;
    };
    Lines lines = {path + ": fragments", format("fragments      %zu", count("fragments")),
                   format("interfaces     %zu", count("interfaces"))};
    if (json.contains("source") && json["source"].is_object() && json["source"].contains("path"))
        lines.push_back("source         " + json["source"]["path"].dump());
    if (json.contains("warnings"))
        for (const Json& w : json["warnings"])
            lines.push_back("warning        " + (w.is_string() ? w.get<std::string>() : w.dump()));
    return lines;
}

// How long a crack's process zone is beside the fragments: where it is shorter, pieces are as large as fragments.
std::string fracture_text(const Value& value) {
    const auto* body = std::get_if<std::shared_ptr<const BodyValue>>(&value);
    if (body == nullptr) return {};
    const Material& m = (*body)->material;
    if (!(m.fracture_energy < kNever && m.toughness < kNever)) return {};
    const SimulationMesh& rest = *(*body)->rest;
    double spacing = 0;
    for (const double volume : rest.volume) spacing += math::cbrt(volume) / static_cast<double>(rest.n_particles());
    const double length = opening_length(m, m.toughness);
    return format(": fracture energy %.4g J/m2, L %.3g m, %.2g times the fragments' %.3g m", m.fracture_energy, length,
                  length / spacing, spacing) +
           (length < spacing ? ": crumbs and pieces are as large as these (docs/cracks.md)" : "");
}

Result<Lines> describe_json(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return text.error();
    if (is_own_manifest(*text))
        return describe_bake(fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path("."));
    const auto json = parse_json(*text, path);
    if (!json) return json.error();
    if (json->is_object() && json->contains("fragments") && json->contains("interfaces"))
        return describe_fragments(path, *json);
    auto graph = Graph::load(path);
    if (!graph) return graph.error();
    const auto [first, last] = graph->frame_range();
    Lines lines = {path + ": graph",
                   format("frames         %d to %d at %s a second", first, last, graph->frame_rate().text().c_str())};
    for (const std::string& name : graph->node_names()) {
        const std::string& type = (*graph->describe(name))->type;
        lines.push_back("node           " + name + ": " + type);
        if (type != "body") continue;
        if (const auto body = graph->evaluate(name, "body", first)) lines.back() += fracture_text(*body);
    }
    return lines;
}

}  // namespace

Result<Lines> describe_path(const std::string& path) {
    std::error_code code;
    const fs::file_status status = fs::status(path, code);
    if (!fs::exists(status)) return bad_input(path, "there is no such file or folder", "check the path");
    if (fs::is_directory(status)) {
        const fs::path listing = fs::path(path) / "fragments.json";
        return !fs::exists(fs::path(path) / kManifestName, code) && fs::exists(listing, code)
                   ? describe_json(listing.string())
                   : describe_bake(path);
    }
    const std::string extension = fs::path(uncompressed_path(path)).extension().string();
    if (extension == ".json") return describe_json(path);
    if (extension == ".ply" || is_compressed(path)) {
        auto bytes = read_baked_file(path);
        if (!bytes) return bytes.error();
        const std::string_view head = std::string_view(*bytes).substr(0, 200);
        if (head.find("comment sunder state frame") != head.npos) return describe_state(bytes.take(), path);
        if (head.find(kMeshFileMagic) != head.npos) return describe_ply(bytes.take(), path, "mesh frame");
        if (is_compressed(path)) return bad_input(path, "is no frame of a bake", "unpack it with zstd -d");
    }
    return describe_mesh(path);
}

}  // namespace sunder
