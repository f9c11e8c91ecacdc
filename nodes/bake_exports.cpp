#include "nodes/bake_exports.h"

#include "nodes/exports/shot_export.h"
#include "nodes/files/output_pattern.h"
#include "nodes/graph/node.h"

namespace sunder {

Result<std::optional<WantedExport>> wanted_export(const Graph& graph, const std::string& node,
                                                  const std::string& pattern) {
    const auto format = graph.parameter(node, "export");
    if (!format || *format == "none") return std::optional<WantedExport>();
    const std::string extension = "." + format->get<std::string>();
    if (!pattern.ends_with(".ply"))
        return node_error(node, "export", "is made from PLY frames, and the path ends otherwise",
                          "end the path in .ply");
    const auto wires = graph.wires({node, "mesh"});
    if (wires && !wires->empty() && extension != ".usda")
        if (const auto topology = graph.parameter(wires->front().node, "topology"); topology && *topology == "compact")
            return node_error(node, "export", extension + " has no room for faces that appear as the body tears",
                              "set topology of node '" + wires->front().node + "' to constant, or export usda");
    return std::optional(WantedExport{node, shot_path(pattern, extension)});
}

std::vector<std::string> files_of(const WantedExport& wanted) {
    std::vector<std::string> files = {wanted.path};
    for (const auto& path : companions(wanted.path)) files.push_back(path.string());
    return files;
}

bool exports_are_whole(const Manifest& manifest, const BakeFolder& folder) {
    BakeCheck unused;
    return !manifest.exports.empty() && verify_exports(manifest, folder.path(), unused);
}

Result<WrittenExports> write_exports(const std::vector<WantedExport>& wanted, const BakeFolder& folder,
                                     const std::string& graph_folder, Manifest& io_manifest, const Progress& progress) {
    io_manifest.exports.clear();
    for (const WantedExport& w : wanted)
        for (const std::string& path : files_of(w)) io_manifest.exports.push_back({w.node, path, {}});
    if (Status s = folder.write_manifest(io_manifest); !s) return s.error();

    WrittenExports made;
    for (size_t k = 0; k < wanted.size(); ++k) {
        const auto shot =
            baked_shot(io_manifest, folder.path(), {.node = wanted[k].node, .graph_folder = graph_folder});
        if (!shot) return shot.error();
        const auto file = folder.prepare(wanted[k].path);
        if (!file) return file.error();
        const double n = static_cast<double>(wanted.size());
        const auto written = export_shot(*shot, {.file = *file},
                                         progress.part(static_cast<double>(k) / n, static_cast<double>(k + 1) / n));
        if (!written) {
            Error error = written.error();
            error.node = wanted[k].node, error.parameter = "export";
            return error;
        }
        if (!written->note.empty()) made.notes.push_back(wanted[k].path + ": " + written->note);
        for (const auto& [path, stamp] : written->files) {
            made.stamps.push_back(stamp);
            for (ManifestFile& f : io_manifest.exports)
                if (folder.path() / f.path == path) f.stamp = stamp;
        }
    }
    if (Status s = folder.write_manifest(io_manifest); !s) return s.error();
    return made;
}

}  // namespace sunder
