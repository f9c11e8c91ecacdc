#include "nodes/exports/shot_export.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "nodes/bake_files/bake_folder.h"
#include "nodes/exports/shot_solids.h"
#include "nodes/files/compression.h"
#include "nodes/files/frame_number.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/output_pattern.h"
#include "nodes/graph/json.h"
#include "nodes/graph/nearest_name.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

// The node that a wire "@node.socket" comes from.
std::string source_of(const Json& wire) {
    const std::string text = wire.is_string() ? wire.get<std::string>() : "";
    return text.size() > 1 ? text.substr(1, text.rfind('.') - 1) : "";
}

// The body whose mesh a bake node writes; its own name if the graph does not tell.
std::string body_name(const Json& nodes, const std::string& bake) {
    const auto upstream = [&](const std::string& node, const char* input) {
        return nodes.contains(node) && nodes[node].contains(input) ? source_of(nodes[node][input]) : std::string();
    };
    const std::string body = upstream(upstream(bake, "mesh"), "body");
    return body.empty() ? bake : body;
}

bool is_sequence(const fs::path& file) { return file.extension() == ".ply" || file.extension() == ".obj"; }

fs::path frame_file(const fs::path& pattern, double frame) {
    return pattern.parent_path() / output_path(pattern.filename().string(), frame);
}

Status check_ending(const fs::path& file) {
    const std::string name = file.filename().string(), extension = file.extension().string();
    const bool is_pattern = name.find('#') != std::string::npos;
    if (is_shot_format(extension) && is_pattern)
        return bad_input(file.string(), "a " + extension + " file holds all frames", "leave out the ####");
    if (!is_shot_format(extension) && !is_sequence(file))
        return bad_input(file.string(), "shots are not written as '" + extension + "'",
                         "end the name in .usda, .glb, .pc2, .####.ply or .####.obj");
    if (Status s = check_output_pattern(name); is_sequence(file) && !s)
        return bad_input(file.string(), "has no run of #### for the frame", "shot.####" + extension);
    return {};
}

// All that an export of these frames writes.
std::vector<fs::path> files_of(const fs::path& file, const std::vector<double>& frames) {
    std::vector<fs::path> files = companions(file);
    if (!is_sequence(file)) files.push_back(file);
    for (double frame : frames)
        if (is_sequence(file)) files.push_back(frame_file(file, frame));
    return files;
}

// Which file it is, however it is called; links in its folder are followed, one in its place would be replaced.
fs::path true_path(const fs::path& file) {
    std::error_code code;
    return fs::weakly_canonical(fs::absolute(file, code).parent_path(), code) / file.filename();
}

// Nothing is lost to an export: neither files of the bake, nor others unless whoever asked wants them replaced.
Status check_free(const std::vector<fs::path>& files, const Manifest& manifest, const BakeExport& wanted) {
    std::set<fs::path> own = {true_path(wanted.bake / kManifestName)};
    for (const std::string& path : listed_paths(manifest)) own.insert(true_path(wanted.bake / path));
    std::error_code code;
    for (const fs::path& file : files) {
        if (own.contains(true_path(file)))
            return bad_input(file.string(), "is a file of the bake itself", "give another name or folder");
        if (!wanted.overwrite && fs::exists(fs::symlink_status(file, code)))
            return bad_input(file.string(), "is there already", "--overwrite replaces it");
    }
    return {};
}

// Those whose frames can be read again, in the order of the graph.
std::vector<std::string> mesh_nodes(const Manifest& manifest) {
    std::vector<std::string> names;
    const Json& nodes = manifest.graph["nodes"];
    for (const ManifestFile& file : manifest.frames.front().files)
        if (nodes.contains(file.node) && nodes[file.node]["type"] == "bake_mesh" &&
            uncompressed_path(file.path).ends_with(".ply"))
            names.push_back(file.node);
    return names;
}

// Of a bake node, a frame; of a bake by an earlier Sunder one.
int steps_of(const Json& node) {
    const auto steps = node.find("subframes");
    return steps != node.end() && steps->is_number_integer() ? std::max(1, steps->get<int>()) : 1;
}

Result<std::vector<fs::path>> paths_of(const Manifest& manifest, const std::string& node, const fs::path& folder,
                                       const std::vector<double>& frames) {
    std::map<double, std::string> baked;
    for (const ManifestFrame& frame : manifest.frames)
        frame.for_each_file([&](double at, const ManifestFile& file) {
            if (file.node == node) baked[at] = file.path;
        });
    std::vector<fs::path> paths;
    for (const double frame : frames) {
        const auto found = baked.find(frame);
        if (found == baked.end())
            return bad_input((folder / kManifestName).string(),
                             "lists no file of node '" + node + "' at frame " + frame_text(frame),
                             "bake again with --restart");
        paths.push_back(folder / found->second);
    }
    return paths;
}

Result<ExportReport> export_sequence(const Shot& shot, const ExportSettings& settings, const Progress& progress) {
    if (shot.meshes.size() != 1)
        return bad_input(settings.file.string(),
                         "a sequence holds one mesh, the shot has " + std::to_string(shot.meshes.size()),
                         "choose one with --node");
    ExportReport report;
    for (size_t i = 0; i < shot.frames.size(); ++i) {
        if (!progress.report(double(i) / double(shot.frames.size()), "exporting")) return cancelled();
        auto frame = shot.meshes[0].read(i);
        if (!frame) return frame.error();
        const fs::path file = frame_file(settings.file, shot.frames[i]);
        const auto bytes = encode_mesh(file.string(), frame->mesh, material_names_of(shot.meshes[0], *frame));
        if (!bytes) return bytes.error();
        const auto stamp = write_file(file, bytes->view());
        if (!stamp) return stamp.error();
        report.files.emplace_back(file, *stamp);
    }
    return report;
}

}  // namespace

Result<Shot> baked_shot(const Manifest& manifest, const fs::path& folder, const ShotChoice& choice) {
    const std::string& node = choice.node;
    auto looks = read_looks(folder);
    if (!looks) return looks.error();
    Shot shot;
    if (const Json& graph = manifest.graph; graph.contains("frame_rate"))
        if (const auto rate = FrameRate::read(graph["frame_rate"])) shot.frame_rate = *rate;
    if (manifest.frames.empty()) return bad_input(folder.string(), "holds no whole frame yet", "bake it");
    const std::array<int, 2> whole = {manifest.frames.front().frame, manifest.frames.back().frame};
    const auto [first, last] = choice.frames.value_or(whole);
    if (first > last || first < whole[0] || last > whole[1])
        return bad_input(folder.string(),
                         "frames " + std::to_string(first) + " to " + std::to_string(last) + " are not all baked",
                         "baked: " + std::to_string(whole[0]) + " to " + std::to_string(whole[1]));
    const Json& nodes = manifest.graph["nodes"];
    const std::vector<std::string> known = mesh_nodes(manifest);
    int steps = 0;  // that all meshes of the shot have
    for (const std::string& name : known)
        if (node.empty() || node == name) steps = std::gcd(steps, steps_of(nodes[name]));
    shot.subframes = std::max(steps, 1);
    for (int f = first; f <= last; ++f)
        for (int step = 0; step < (f < last ? shot.subframes : 1); ++step)
            shot.frames.push_back(sub_frame(f, step, shot.subframes));
    for (const std::string& name : known) {
        if (!node.empty() && node != name) continue;
        auto paths = paths_of(manifest, name, folder, shot.frames);
        if (!paths) return paths.error();
        const std::string body = body_name(nodes, name);
        const Look& look = (*looks)[body];
        shot.meshes.push_back({.name = look.name.empty() ? body : look.name,
                               .read = [paths = paths.take()](size_t i) -> Result<MeshFrame> {
                                   auto bytes = read_baked_file(paths[i]);
                                   if (!bytes) return bytes.error();
                                   return decode_mesh_ply(bytes.take(), paths[i].string());
                               },
                               .look = look});
    }
    if (known.empty())
        return bad_input(folder.string(), "holds no mesh frames in PLY, from which exports are made",
                         "bake with a bake_mesh node whose path ends in .ply");
    if (shot.meshes.empty())
        return bad_input(folder.string(), "has no bake_mesh node '" + node + "'", permitted_text(node, known));
    if (choice.has_solids)
        shot.solids = [source = SolidSource{manifest, folder, choice.graph_folder.value_or(folder), looks.take(),
                                            shot.frames}](double extent) { return shot_solids(source, extent); };
    return shot;
}

Result<Shot> with_solids(const Shot& shot, Deforming colliders, std::string& out_note) {
    Shot all = shot;
    if (!shot.solids) return all;
    Aabb box;
    for (const ShotMesh& mesh : shot.meshes) {
        const auto first = mesh.read(0);
        if (!first) return first.error();
        for (const Vec3f& p : first->mesh.positions) box.extend(p.cast<double>());
    }
    auto solids = shot.solids(box.diagonal());
    if (!solids) return solids.error();
    for (ShotMesh& mesh : solids->meshes) {
        if (mesh.is_surface && colliders == Deforming::left_out)
            solids->notes.push_back("'" + mesh.name + "' is left out, for it deforms");
        else
            all.meshes.push_back(std::move(mesh));
    }
    for (const std::string& note : solids->notes) out_note += (out_note.empty() ? "" : "; ") + note;
    return all;
}

std::vector<Surface> surfaces_of(const ShotMesh& mesh, const MeshFrame& first) {
    constexpr std::array<double, 4> kBreak = {0.5, 0.42, 0.36, 1};
    std::vector<Surface> surfaces;
    for (size_t m = 0; m < first.materials.size(); ++m) {
        const bool is_interior = mesh.poses.empty() && !mesh.is_surface && m + 1 == first.materials.size();
        Surface surface;
        if (is_interior)
            surface = mesh.look.interior.value_or(Surface{.name = {}, .color = kBreak});
        else if (m < mesh.look.surfaces.size())
            surface = mesh.look.surfaces[m];
        if (surface.name.empty()) surface.name = first.materials[m];
        surface.takes_vertex_colors &= !is_interior && !first.mesh.corner_colors.empty();
        surfaces.push_back(std::move(surface));
    }
    for (size_t c = 0; c < first.mesh.corner_colors.size(); ++c) {
        Surface& surface = surfaces[static_cast<size_t>(first.mesh.triangle_material[c / 3])];
        surface.takes_vertex_alpha |= surface.takes_vertex_colors && first.mesh.corner_colors[c][3] != 1;
    }
    return surfaces;
}

FragmentSet material_names_of(const ShotMesh& mesh, const MeshFrame& first) {
    FragmentSet names;
    names.interior_material = first.interior_material();
    for (const Surface& surface : surfaces_of(mesh, first)) names.material_names.push_back(surface.name);
    names.material_names.pop_back();
    return names;
}

bool is_shot_format(const std::string& extension) {
    return extension == ".usda" || extension == ".glb" || extension == ".pc2";
}

std::vector<fs::path> companions(const fs::path& file) {
    if (file.extension() != ".pc2") return {};
    return {fs::path(file).replace_extension(".obj")};
}

Status check_constant_topology(const VisualMesh& first, const VisualMesh& mesh, const std::string& name, double frame,
                               const std::string& format) {
    if (mesh.positions.size() == first.positions.size() && mesh.triangles == first.triangles) return {};
    return bad_input("body '" + name + "'",
                     "its faces change at frame " + frame_text(frame) + ", which " + format + " cannot hold",
                     "bake with the deformer's topology 'constant', or export .usda");
}

namespace {

Result<ExportReport> export_by_ending(const Shot& shot, const ExportSettings& settings, const Progress& progress) {
    if (Status s = check_ending(settings.file); !s) return s.error();
    const std::string extension = settings.file.extension().string();
    if (extension == ".usda") return export_usda(shot, settings, progress);
    if (extension == ".glb") return export_glb(shot, settings, progress);
    if (extension == ".pc2") return export_pc2(shot, settings, progress);
    return export_sequence(shot, settings, progress);
}

}  // namespace

Result<ExportReport> export_shot(const Shot& shot, const ExportSettings& settings, const Progress& progress) {
    auto report = export_by_ending(shot, settings, progress);
    if (report) report->frames = {static_cast<int>(shot.frames.front()), static_cast<int>(shot.frames.back())};
    return report;
}

Result<ExportReport> export_bake(const BakeExport& wanted, const Progress& progress) {
    const fs::path& file = wanted.settings.file;
    if (file.empty()) return bad_usage("no file is given", "as shot.usda");
    if (!(wanted.settings.tolerance >= 0)) return bad_usage("the tolerance is negative", "a share of the body's size");
    if (Status s = check_ending(file); !s) return s.error();
    std::error_code code;
    if (!fs::is_directory(wanted.bake, code))
        return bad_input(wanted.bake.string(), "is no bake folder", "sunder bake GRAPH -o DIR makes one");
    const auto manifest = read_manifest(wanted.bake);
    if (!manifest) return manifest.error();
    ShotChoice choice = wanted.choice;
    choice.has_solids = choice.node.empty();
    const auto shot = baked_shot(*manifest, wanted.bake, choice);
    if (!shot) return shot.error();
    if (Status s = check_free(files_of(file, shot->frames), *manifest, wanted); !s) return s.error();
    if (file.has_parent_path())
        if (Status s = make_folders(file.parent_path()); !s) return s.error();
    return export_shot(*shot, wanted.settings, progress);
}

}  // namespace sunder
