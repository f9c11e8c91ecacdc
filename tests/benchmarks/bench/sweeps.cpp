// A bar of 320 particles for a given number of frames of one method: to be run under an instruction counter.
// Apart from the benchmark, because CGAL does not start where rounding modes are emulated.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/benchmarks/bench/scene_parts.h"

int main(int argc, char** argv) {
    using namespace sunder;
    const std::string_view method = argc == 3 ? argv[2] : "";
    if (method != "jacobi" && method != "projective") {
        std::fprintf(stderr, "usage: sunder_sweeps FRAMES jacobi|projective\n");
        return 2;
    }
    bench::BenchScene s = bench::twisted_bar(4, 20);
    s.settings.method = method == "jacobi" ? Method::jacobi : Method::projective;
    const auto solver = bench::must(Solver::create(s.scene, 1));
    FrameState state = solver->initial_state(s.input.materials);
    for (int frame = 0; frame < std::atoi(argv[1]); ++frame) {
        s.drive(frame, s.input);
        if (const auto report = solver->advance(s.input, s.settings, state); !report) {
            std::fprintf(stderr, "sunder: error: %s\n", report.error().text().c_str());
            return 1;
        }
    }
    return 0;
}
