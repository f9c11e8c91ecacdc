// sunder fracture: pre-fracture alone, or a look at what is wrong with a mesh. Its options are the parameters of the
// nodes that do the work.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "nodes/exports/fragment_folder.h"
#include "nodes/files/file_io.h"
#include "nodes/graph/registry.h"
#include "nodes/graph/strict_json.h"
#include "nodes/types/mesh_fault_report.h"
#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/progress_bar.h"
#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

constexpr const char* kReader = "mesh";  // names of the two nodes, as errors tell them
constexpr const char* kCutter = "fracture";

struct FractureOptions {
    std::string mesh;
    std::optional<std::string> folder;
    bool only_checks = false, as_json = false;
    std::map<std::string, std::map<std::string, std::string>> parameters;  // node -> parameter -> text
};

Status set_up(Graph& graph, const FractureOptions& options) {
    if (Status s = graph.add_node(kReader, "mesh_file"); !s) return s;
    if (Status s = graph.add_node(kCutter, "prefracture"); !s) return s;
    if (Status s = graph.connect({kReader, "mesh"}, {kCutter, "mesh"}); !s) return s;
    if (Status s = graph.set(kReader, "path", options.mesh); !s) return s;
    for (const auto& [node, parameters] : options.parameters)
        for (const auto& [name, text] : parameters) {
            if (text.empty()) continue;
            const auto value = parse_json(text, name);
            if (Status s = graph.set(node, name, value ? *value : Json(text)); !s) return s;
        }
    return {};
}

Status write_faces(const MeshFaultReport& report, const std::optional<std::string>& folder) {
    if (!folder || report.faces.view().empty()) return {};
    if (Status s = make_folders(*folder); !s) return s;
    const Result<FileStamp> written = write_file(std::filesystem::path(*folder) / "faults.ply", report.faces.view());
    return written ? Status() : Status(written.error());
}

/// Lists the faults, and cuts the mesh to see what repair does about them; writes no pieces.
int run_check(const FractureOptions& options) {
    Graph graph;
    if (Status s = set_up(graph, options); !s) return fail(s.error(), "sunder fracture");
    ProgressBar bar;
    const auto mesh = graph.evaluate(kReader, "mesh", graph.frame_range()[0], bar.progress().part(0, 0.1));
    if (!mesh) return fail((bar.clear(), mesh.error()), "sunder fracture");
    MeshFaultReport report = report_mesh_faults(*std::get<std::shared_ptr<const TriMesh>>(*mesh));
    const auto cut = graph.evaluate(kCutter, "fragments", graph.frame_range()[0], bar.progress().part(0.1, 1));
    bar.clear();
    if (!cut && cut.error().code == ErrorCode::cancelled) return fail(cut.error(), "sunder fracture");
    if (Status s = write_faces(report, options.folder); !s) return fail(s.error(), *options.folder);

    const std::string prefix = std::string("node '") + kCutter + "': ";
    Json told = Json::array();
    if (cut)
        for (const std::string& w : std::get<std::shared_ptr<const FragmentSet>>(*cut)->warnings)
            told.push_back(w.starts_with(prefix) ? w.substr(prefix.size()) : w);
    if (options.as_json) {
        report.json["can_be_cut"] = bool(cut);
        report.json["repairs"] = told;
        if (!cut) report.json["error"] = cut.error().text();
        std::printf("%s\n", report.json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    } else {
        std::printf("%s: %zu triangles, %s\n", options.mesh.c_str(), report.json["triangles"].get<size_t>(),
                    report.n_faults == 0 ? "no faults" : "with faults:");
        for (const std::string& line : report.table) std::printf("%s\n", line.c_str());
        for (const Json& line : told) std::printf("repair: %s\n", line.get<std::string>().c_str());
    }
    if (!cut) return fail(cut.error(), "sunder fracture");
    return kDone;
}

int run_fracture(const FractureOptions& options) {
    Graph graph;
    if (Status s = set_up(graph, options); !s) return fail(s.error(), "sunder fracture");
    ProgressBar bar;
    constexpr double kCuttingShare = 0.9;
    auto value = graph.evaluate(kCutter, "fragments", graph.frame_range()[0], bar.progress().part(0, kCuttingShare));
    if (!value) return fail((bar.clear(), value.error()), "sunder fracture");
    FragmentSet set = *std::get<std::shared_ptr<const FragmentSet>>(*value);
    set.source_path = options.mesh;
    const std::string folder = options.folder.value_or("fragments");
    const Status written = write_fragments(set, folder, bar.progress().part(kCuttingShare, 1));
    bar.clear();
    if (!written) return fail(written.error(), "sunder fracture");
    for (const std::string& warning : set.warnings)
        std::fprintf(stderr, "sunder: warning: %s: %s\n", options.mesh.c_str(), warning.c_str());
    std::printf("%s: %zu fragments, %zu interfaces\n", folder.c_str(), set.fragments.size(), set.interfaces.size());
    return kDone;
}

// Every parameter of a node type that is not asked for in another way becomes an option, underscores as dashes.
void add_parameters(CLI::App* command, const char* node, const char* type, FractureOptions& io_options) {
    for (const ParameterDescription& p : standard_registry().find(type)->description.parameters) {
        if (p.type == ParameterType::path) continue;
        std::string name = p.name;
        std::replace(name.begin(), name.end(), '_', '-');
        std::string help = p.sentence + (p.unit.empty() ? "" : ", " + p.unit);
        if (const std::string range = range_text(p); !range.empty()) help += "; " + range;
        for (const JsonValue& c : p.choices) help += (&c == &p.choices.front() ? "; " : "|") + c.text();
        help += " [" + p.default_value.text() + "]";
        command->add_option("--" + name, io_options.parameters[node][p.name], help)
            ->type_name(std::string(name_of(p.type)));
    }
}

}  // namespace

void add_fracture_command(CLI::App& app, Run& out_run) {
    auto options = std::make_shared<FractureOptions>();
    CLI::App* command =
        app.add_subcommand("fracture", "Cut a mesh into fragments: fragments.json and one closed mesh a fragment");
    command->add_option("MESH", options->mesh, "mesh file")->required();
    command
        ->add_option("-o,--output", options->folder,
                     "output folder [fragments]; with --check the faulty faces are written there as faults.ply")
        ->type_name("DIR");
    auto* check = command->add_flag("--check", options->only_checks,
                                    "list the mesh's faults and what repair does about them, write no pieces; exit "
                                    "status 0 if it can be cut, else 3");
    command->add_flag("--json", options->as_json, "with --check: the list as JSON")->needs(check);
    add_parameters(command, kCutter, "prefracture", *options);
    add_parameters(command, kReader, "mesh_file", *options);
    command->callback([options, &out_run] {
        if (options->folder && options->folder->empty())
            throw CLI::ValidationError("--output", "no output folder is given");
        out_run = [options] { return options->only_checks ? run_check(*options) : run_fracture(*options); };
    });
}

}  // namespace sunder::cli
