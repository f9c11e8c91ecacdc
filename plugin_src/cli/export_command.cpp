// sunder export: a bake as one file that other programs read, or as a sequence.
#include <cstdio>
#include <string>

#include "nodes/exports/shot_export.h"
#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/progress_bar.h"
#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

struct ExportOptions {
    BakeExport wanted;
    std::string bake, file, frames, graph_folder;
};

int run_export(const ExportOptions& options) {
    BakeExport wanted = options.wanted;
    wanted.bake = options.bake, wanted.settings.file = options.file;
    if (!options.graph_folder.empty()) wanted.choice.graph_folder = options.graph_folder;
    if (!options.frames.empty()) {
        const auto frames = to_frames(options.frames);
        if (!frames) return fail(frames.error(), "sunder export");
        wanted.choice.frames = *frames;
    }
    ProgressBar bar;
    const auto report = export_bake(wanted, bar.progress());
    bar.clear();
    if (!report) return fail(report.error(), options.file);
    uint64_t bytes = 0;
    for (const auto& [unused, stamp] : report->files) bytes += stamp.size;
    std::printf("%s: frames %d to %d, %zu files, %s\n", options.file.c_str(), report->frames[0], report->frames[1],
                report->files.size(), bytes_text(bytes).c_str());
    if (!report->note.empty()) std::printf("note: %s\n", report->note.c_str());
    return kDone;
}

}  // namespace

void add_export_command(CLI::App& app, Run& out_run) {
    auto options = std::make_shared<ExportOptions>();
    CLI::App* command = app.add_subcommand("export", "Write a bake as .usda, .glb, .pc2, or as .ply or .obj frames");
    command->add_option("BAKE", options->bake, "bake folder")->required();
    command->add_option("-o,--output", options->file, "file; its ending tells the format, #### stands for the frame")
        ->required()
        ->type_name("FILE");
    command
        ->add_option(
            "--node", options->wanted.choice.node,
            "bake_mesh node whose mesh alone is written; all of them, with rigid bodies and colliders, unless given")
        ->type_name("NAME");
    command->add_option("--frames", options->frames, "frames to write; all that are baked unless given")
        ->type_name("A:B");
    command
        ->add_option("--tolerance", options->wanted.settings.tolerance,
                     ".glb: how far a vertex may be from its rigid fragment, as a share of its body's size")
        ->capture_default_str()
        ->type_name("SHARE");
    command
        ->add_option("--graph-folder", options->graph_folder,
                     "where the graph file lay, which names the meshes of colliders; the bake folder unless given")
        ->type_name("DIR");
    command->add_flag("--overwrite", options->wanted.overwrite, "replace files that are there");
    command->callback([options, &out_run] { out_run = [options] { return run_export(*options); }; });
}

}  // namespace sunder::cli
