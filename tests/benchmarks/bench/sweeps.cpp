// A bar of 320 particles for a given number of frames of one method, or a sheet of 600: to be run under an instruction
// counter.
// Apart from the benchmark, because CGAL does not start where rounding modes are emulated.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {
namespace {

BenchScene scene_of(std::string_view what) {
    if (what.starts_with("sheet")) {
        const bool flows = what.find("flows") != what.npos, as_blocks = what.find("blocks") != what.npos;
        return hanging_sheet(!as_blocks, flows ? 0.01 : kNever);
    }
    BenchScene s = twisted_bar(4, 20);
    s.settings.method = what == "jacobi" ? Method::jacobi : Method::projective;
    return s;
}

}  // namespace
}  // namespace sunder::bench

int main(int argc, char** argv) {
    using namespace sunder;
    const std::string_view what = argc == 3 ? argv[2] : "";
    constexpr std::string_view kKnown[] = {"jacobi",       "projective",  "sheet",
                                           "sheet_blocks", "sheet_flows", "sheet_flows_blocks"};
    if (std::ranges::find(kKnown, what) == std::end(kKnown)) {
        std::fprintf(stderr, "usage: sunder_sweeps FRAMES jacobi|projective|sheet[_flows][_blocks]\n");
        return 2;
    }
    bench::BenchScene s = bench::scene_of(what);
    const auto solver = bench::must(Solver::create(s.scene, 1));
    FrameState state = solver->initial_state(s.input.materials);
    for (int frame = 0; frame < std::atoi(argv[1]); ++frame) {
        if (s.drive) s.drive(frame, s.input);
        if (const auto report = solver->advance(s.input, s.settings, state); !report) {
            std::fprintf(stderr, "sunder: error: %s\n", report.error().text().c_str());
            return 1;
        }
    }
    return 0;
}
