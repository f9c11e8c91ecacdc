// The commands of the program: each adds itself to the command line and gives the exit status when it is run.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <functional>
#include <memory>
#include <string>

#include "nodes/graph/graph.h"

namespace sunder::cli {

/// What a parsed command line asks for.
using Run = std::function<int()>;

void add_nodes_command(CLI::App& app, Run& out_run);
void add_fracture_command(CLI::App& app, Run& out_run);
void add_bake_command(CLI::App& app, Run& out_run);
void add_export_command(CLI::App& app, Run& out_run);
void add_info_command(CLI::App& app, Run& out_run);
void add_verify_command(CLI::App& app, Run& out_run);
void add_report_command(CLI::App& app, Run& out_run);

/// "A:B", or "A" alone, of --frames.
Result<std::array<int, 2>> to_frames(const std::string& text);

}  // namespace sunder::cli
