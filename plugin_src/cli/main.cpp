// The program `sunder`: command line in, exit status out (0 done, 1 failed, 2 wrong usage, 3 bad input, 130 cancelled).
#include <cstdio>
#include <exception>
#include <new>

#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/report.h"

namespace {

std::string names_of_commands(const CLI::App& app) {
    std::string names;
    for (const CLI::App* command : app.get_subcommands({})) names += (names.empty() ? "" : ", ") + command->get_name();
    return names;
}

int run_program(int argc, char** argv) {
    using namespace sunder::cli;
    CLI::App app("Sunder: ductile fracture with oriented particles", "sunder");
    app.set_version_flag("--version", "sunder " SUNDER_VERSION);
    app.require_subcommand(1);
    app.get_formatter()->column_width(34);
    Run run;
    add_nodes_command(app, run);
    add_fracture_command(app, run);
    add_bake_command(app, run);
    add_export_command(app, run);
    add_info_command(app, run);
    add_verify_command(app, run);
    add_report_command(app, run);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
        std::string command = "sunder";
        for (const CLI::App* chosen : app.get_subcommands()) command += " " + chosen->get_name();
        std::string what = e.what();
        if (app.get_subcommands().empty() && argc > 1 && argv[1][0] != '-')
            what = std::string("'").append(argv[1]) + "' is no command (permitted: " + names_of_commands(app) + ")";
        return fail(sunder::bad_usage(what, command + " --help tells what is permitted"), command);
    }
    watch_interrupts();
    const int status = run();
    if (std::fflush(stdout) != 0 && status == kDone)
        return fail(sunder::io_error("standard output", "cannot be written"), "sunder");
    return status;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run_program(argc, argv);
    } catch (const std::bad_alloc&) {
        std::fputs("sunder: error: sunder: out of memory (fewer pieces or frames need less)\n", stderr);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "sunder: error: sunder: unexpected: %s\n", e.what());
    }
    return sunder::cli::kFailed;
}
