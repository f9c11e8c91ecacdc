// sunder bake: a graph's bake nodes, frame by frame, to files.
#include <charconv>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "nodes/bake.h"
#include "nodes/graph/strict_json.h"
#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/progress_bar.h"
#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

struct BakeOptions {
    std::string graph, folder, frames;
    std::vector<std::string> settings;
    std::optional<int> threads;
    bool resume = false, restart = false;
};

Result<int> to_frame(std::string_view text) {
    int frame = 0;
    const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), frame);
    if (text.empty() || code != std::errc() || stop != text.data() + text.size())
        return bad_usage("--frames: '" + std::string(text) + "' is no frame", "--frames A:B");
    return frame;
}

// "NODE.PARAM=VALUE"; the value is JSON, or else a text.
Status apply_setting(Graph& graph, const std::string& setting) {
    const size_t equals = setting.find('=');
    const auto target = parse_reference(std::string_view(setting).substr(0, equals));
    if (equals == std::string::npos || !target)
        return bad_usage("--set: '" + setting + "' does not set a parameter", "--set NODE.PARAM=VALUE");
    const std::string text = setting.substr(equals + 1);
    const auto value = parse_json(text, "--set");
    return graph.set(target->node, target->socket, value ? *value : Json(text));
}

// What a graph file has in it, or what was set on the command line.
Result<Graph> load_graph(const BakeOptions& options) {
    auto graph = Graph::load(options.graph);
    if (!graph) return graph.error();
    for (const std::string& setting : options.settings)
        if (Status s = apply_setting(*graph, setting); !s) return s.error();
    if (options.threads)
        if (Status s = graph->set_threads(*options.threads); !s) return s.error();
    return graph;
}

void print_frame(const BakedFrame& f) {
    const StepReport& s = f.step;
    std::printf(
        "frame %d of %d: %.3f s (simulate %.3f: predict %.3f shape %.3f contact %.3f momentum %.3f fracture %.3f; "
        "other nodes %.3f, write %.3f), "
        "%zu edges broken, %zu contacts, %zu files\n",
        f.frame, f.last_frame, f.simulate_s + f.other_nodes_s + f.write_s, f.simulate_s, s.predict_s, s.shape_s,
        s.contact_s, s.momentum_s, s.fracture_s, f.other_nodes_s, f.write_s, s.edges_broken, s.contacts, f.n_files);
    std::fflush(stdout);
}

int run_bake(const BakeOptions& options) {
    BakeSettings settings;
    settings.folder = options.folder;
    settings.start = options.resume ? BakeStart::resume : options.restart ? BakeStart::restart : BakeStart::fresh;
    if (!options.frames.empty()) {
        const auto frames = to_frames(options.frames);
        if (!frames) return fail(frames.error(), "sunder bake");
        settings.frames = *frames;
    }
    auto graph = load_graph(options);
    if (!graph) return fail(graph.error(), "sunder bake");

    ProgressBar bar;
    size_t n_done = 0;
    settings.frame_done = [&](const BakedFrame& f) {
        ++n_done;
        if (!bar.is_on_terminal()) print_frame(f);
    };
    const auto report = bake(*graph, settings, bar.progress());
    bar.clear();
    if (!report) {
        Error error = report.error();
        if (error.code == ErrorCode::cancelled) {
            error.where = options.folder;
            error.what = "cancelled after " + std::to_string(n_done) + (n_done == 1 ? " frame" : " frames");
            error.mend = "--resume goes on";
        }
        return fail(error, "sunder bake");
    }
    if (report->n_frames == 0)
        std::printf("%s: frames %d to %d are there already\n", options.folder.c_str(), report->frames[0],
                    report->frames[1]);
    else
        std::printf("%s: frames %d to %d baked, %zu files, %s\n", options.folder.c_str(), report->first_new_frame,
                    report->frames[1], report->n_files, bytes_text(report->bytes).c_str());
    for (const std::string& note : report->notes) std::printf("note: %s\n", note.c_str());
    return kDone;
}

}  // namespace

Result<std::array<int, 2>> to_frames(const std::string& text) {
    const size_t colon = text.find(':');
    const auto first = to_frame(std::string_view(text).substr(0, colon));
    const auto last = colon == std::string::npos ? first : to_frame(std::string_view(text).substr(colon + 1));
    if (!first) return first.error();
    if (!last) return last.error();
    return std::array{*first, *last};
}

void add_bake_command(CLI::App& app, Run& out_run) {
    auto options = std::make_shared<BakeOptions>();
    options->folder = "bake";
    CLI::App* command = app.add_subcommand("bake", "Evaluate every bake node of a graph, frame by frame, to files");
    command->add_option("GRAPH", options->graph, "graph file (JSON)")->required();
    command->add_option("-o,--output", options->folder, "output folder")->capture_default_str()->type_name("DIR");
    command
        ->add_option("--frames", options->frames, "frames to bake; the simulation always begins at the graph's first")
        ->type_name("A:B");
    command->add_option("--threads", options->threads, "worker threads, 0 for all cores; changes no result")
        ->type_name("N");
    command->add_option("--set", options->settings, "change a parameter, as sim.substeps=16; may be given many times")
        ->type_name("NODE.PARAM=VALUE")
        ->allow_extra_args(false);
    auto* resume = command->add_flag("--resume", options->resume, "go on after the last whole frame, to the same bits");
    command->add_flag("--restart", options->restart, "remove what an earlier bake wrote, and begin anew")
        ->excludes(resume);
    command->callback([options, &out_run] { out_run = [options] { return run_bake(*options); }; });
}

}  // namespace sunder::cli
