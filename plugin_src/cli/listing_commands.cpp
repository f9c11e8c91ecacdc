// sunder nodes, sunder info, sunder verify: commands that only look.
#include <cstdio>
#include <string>

#include "nodes/bake_files/manifest.h"
#include "nodes/file_info.h"
#include "nodes/graph/json.h"
#include "nodes/graph/registry.h"
#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/progress_bar.h"
#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

struct Listing {
    bool as_json = false, as_markdown = false;
};

void print_sockets(const char* heading, const std::vector<SocketDescription>& sockets, bool are_inputs) {
    for (const SocketDescription& s : sockets) {
        const std::string kind = std::string(s.many ? "list of " : "") + std::string(name_of(s.type)) +
                                 (are_inputs && !s.required ? ", may be left out" : "");
        std::printf("  %-7s %-22s %-30s %s\n", heading, s.name.c_str(), kind.c_str(), s.sentence.c_str());
    }
}

void print_parameter(const ParameterDescription& p) {
    std::string kind(name_of(p.type));
    for (const JsonValue& c : p.choices) kind += (&c == &p.choices.front() ? " " : "|") + c.text();
    if (p.automatic) kind += std::string(" or ") + kAutomatic;
    if (const std::string range = range_text(p); !range.empty()) kind += ", " + range;
    if (!p.unit.empty()) kind += " " + p.unit;
    const std::string needs = p.needs.empty() ? "" : ", needs " + needs_text(p);
    std::printf("  %-7s %-22s %-30s %s [%s%s%s]\n", "", p.name.c_str(), kind.c_str(), p.sentence.c_str(),
                p.default_value.text().c_str(), p.animatable ? ", animatable" : "", needs.c_str());
}

void print_node(const NodeDescription& d) {
    std::printf("%s (%s): %s\n", d.type.c_str(), d.category.c_str(), d.sentence.c_str());
    print_sockets("in", d.inputs, true);
    print_sockets("out", d.outputs, false);
    for (const ParameterGroup& group : d.groups()) {
        if (!group.label.empty()) std::printf("    %s\n", group.label.c_str());
        for (const ParameterDescription* p : group.parameters) print_parameter(*p);
    }
    std::printf("\n");
}

int run_nodes(const Listing& listing) {
    if (listing.as_json)
        std::printf("%s\n", descriptions_to_json().dump(2).c_str());
    else if (listing.as_markdown)
        std::printf("%s", node_reference_markdown().c_str());
    else
        for (const NodeType& type : standard_registry().types()) print_node(type.description);
    return kDone;
}

int run_info(const std::string& path) {
    const auto lines = describe_path(path);
    if (!lines) return fail(lines.error(), path);
    for (const std::string& line : *lines) std::printf("%s\n", line.c_str());
    return kDone;
}

int run_verify(const std::string& folder) {
    ProgressBar bar;
    const auto check = verify_bake(folder, bar.progress());
    bar.clear();
    if (!check) return fail(check.error(), folder);
    int status = kDone;
    for (const std::string& fault : check->faults) {
        Error error = bad_input(folder, fault);
        if (&fault == &check->faults.back())
            error.mend = "--resume goes on with a bake that is not complete, --restart bakes anew";
        status = fail(error, folder);
    }
    if (status == kDone)
        std::printf("%s: whole, %zu files, %s\n", folder.c_str(), check->n_files, bytes_text(check->bytes).c_str());
    return status;
}

}  // namespace

void add_nodes_command(CLI::App& app, Run& out_run) {
    auto listing = std::make_shared<Listing>();
    CLI::App* command = app.add_subcommand("nodes", "List node types with sockets and parameters");
    auto* json = command->add_flag("--json", listing->as_json, "as JSON");
    command->add_flag("--markdown", listing->as_markdown, "as the reference of the documents")->excludes(json);
    command->callback([listing, &out_run] { out_run = [listing] { return run_nodes(*listing); }; });
}

void add_info_command(CLI::App& app, Run& out_run) {
    auto path = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand("info", "Tell what a mesh, graph, bake folder or frame file holds");
    command->add_option("PATH", *path, "file or folder")->required();
    command->callback([path, &out_run] { out_run = [path] { return run_info(*path); }; });
}

void add_verify_command(CLI::App& app, Run& out_run) {
    auto folder = std::make_shared<std::string>();
    CLI::App* command =
        app.add_subcommand("verify", "Check a bake against its manifest: sizes, hashes, missing frames");
    command->add_option("DIR", *folder, "bake folder")->required();
    command->callback([folder, &out_run] { out_run = [folder] { return run_verify(*folder); }; });
}

}  // namespace sunder::cli
