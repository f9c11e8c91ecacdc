// Runs a scene and writes what its deformers read, for sunder_replay.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/benchmarks/bench/scene_parts.h"
#include "tests/benchmarks/bench/skin_recording.h"

namespace sunder::bench {
namespace {

void record(const NamedScene& named, int frames, const std::string& path) {
    SkinRecording r;
    BenchScene& s = r.scene;
    s = named.make();
    if (s.skins.empty()) throw std::runtime_error(std::string(named.name) + ": it has no meshes");
    const auto solver = must(Solver::create(s.scene, 0));
    s.scene = solver->scene();
    FrameState state = solver->initial_state(s.input.materials);
    FrameInput input = s.input;
    if (frames == 0) frames = s.frames;
    for (int frame = 0; frame < s.warm_up + frames; ++frame) {
        if (s.drive) s.drive(frame, input);
        if (const auto report = solver->advance(input, s.settings, state); !report)
            throw std::runtime_error(report.error().text());
        if (frame >= s.warm_up) r.frames.push_back(state);
    }
    write_recording(r, path);
}

}  // namespace
}  // namespace sunder::bench

int main(int argc, char** argv) {
    using namespace sunder::bench;
    CLI::App app("Writes what the deformers of a benchmark scene read, frame by frame", "sunder_record");
    std::string scene, path;
    int frames = 0;
    std::vector<std::string> names;
    for (const NamedScene& named : all_scenes()) names.push_back(named.name);
    app.add_option("SCENE", scene, "one with meshes: paper, bunnies")->required()->check(CLI::IsMember(names));
    app.add_option("FILE", path, "written")->required();
    app.add_option("--frames", frames, "[the scene's own]")->check(CLI::Range(1, 100000));
    CLI11_PARSE(app, argc, argv);
    try {
        for (const NamedScene& named : all_scenes())
            if (named.name == scene) record(named, frames, path);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "sunder: error: %s\n", e.what());
        return 1;
    }
    return 0;
}
