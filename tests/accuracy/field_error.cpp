// Judges the solver against the continuum references in seconds:
//
//     field_error [--case stretch,twist,bend,j2] [--n 4] [--neighbours 6] [--nu 0] [--yield 0.02,0.04,0.06]
//                 [--flow-rate 100] [--most 90] [--load twist] [--substeps 2] [--iterations 2] [--method projective]
//                 [--damping 5] [--frame-rate 24]
//
// Options that may be lists (case, n, neighbours, nu, yield) are run in every combination; one line each.
#include <chrono>
#include <cstring>
#include <map>
#include <sstream>

#include "tests/accuracy/bar_cases.h"

namespace {

using namespace sunder;
using namespace sunder::test;

std::vector<std::string> list(const std::string& text) {
    std::vector<std::string> items;
    std::stringstream stream(text);
    for (std::string item; std::getline(stream, item, ',');) items.push_back(item);
    return items;
}

Load load_named(const std::string& name) {
    if (name == "stretch") return Load::stretch;
    if (name == "twist") return Load::twist;
    if (name == "bend") return Load::bend;
    throw std::runtime_error("no case is called '" + name + "' (stretch, twist, bend, j2)");
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void run_elastic(const BarSetup& setup) {
    const auto start = std::chrono::steady_clock::now();
    LoadedBar bar(setup);
    bar.drive(reference_amount(setup.load), 0.5);
    const double settled = bar.settle();
    const Reference reference = read_reference(setup.load, setup.poisson_ratio, setup.n);
    const FieldError error = field_error(bar.bar(), setup.n, reference);
    std::printf(
        "%-16s n %2d  %2d nbr   L2 %6.3f %%  max %6.3f %%   reaction %6.3f of the reference's   %s %.2f s   (%.1f s)\n",
        reference_name(setup.load, setup.poisson_ratio).c_str(), setup.n, setup.neighbours, 100 * error.l2,
        100 * error.max, bar.reaction() / reference.reaction, settled < 0 ? "NOT AT REST in" : "at rest in",
        settled < 0 ? 20.0 : settled, seconds_since(start));
    std::fflush(stdout);
}

void run_plastic(const BarSetup& setup, double most) {
    const auto start = std::chrono::steady_clock::now();
    const PlasticOutcome outcome = load_and_unload(setup, most);
    const double let_go = load_and_let_go(setup, most);
    std::printf(
        "j2 %s %g deg yield %.3f  n %2d  %2d nbr   residual %6.2f deg, let go %6.2f   moment at full load %7.2f N m   "
        "(%.1f s)\n",
        setup.load == Load::bend ? "bend" : "twist", most, setup.yield, setup.n, setup.neighbours, outcome.residual,
        let_go, outcome.moment, seconds_since(start));
    std::fflush(stdout);
}

int run(std::map<std::string, std::string> options) {
    BarSetup setup;
    setup.settings.substeps = std::stoi(options["substeps"]);
    setup.settings.iterations = std::stoi(options["iterations"]);
    setup.settings.damping = std::stod(options["damping"]);
    setup.flow_rate = std::stod(options["flow-rate"]);
    setup.frame_rate = std::stod(options["frame-rate"]);
    const std::string method = options["method"];
    if (method == "jacobi")
        setup.settings.method = Method::jacobi;
    else if (method == "gauss_seidel")
        setup.settings.method = Method::gauss_seidel;
    else if (method != "projective")
        throw std::runtime_error("no method is called '" + method + "'");

    for (const std::string& name : list(options["case"]))
        for (const std::string& neighbours : list(options["neighbours"]))
            for (const std::string& n : list(options["n"])) {
                setup.n = std::stoi(n), setup.neighbours = std::stoi(neighbours);
                if (name == "j2") {
                    setup.load = load_named(options["load"]), setup.poisson_ratio = 0;
                    for (const std::string& yield : list(options["yield"])) {
                        setup.yield = std::stod(yield);
                        run_plastic(setup, std::stod(options["most"]));
                    }
                    continue;
                }
                setup.load = load_named(name), setup.yield = kNever;
                for (const std::string& nu : list(options["nu"])) {
                    setup.poisson_ratio = std::stod(nu);
                    run_elastic(setup);
                }
            }
    return 0;
}

}  // namespace

int main(int argc, char** argv) try {
    std::map<std::string, std::string> options = {{"case", "stretch,twist,bend"},
                                                  {"n", "4"},
                                                  {"neighbours", "6"},
                                                  {"nu", "0"},
                                                  {"yield", "0.02,0.04,0.06"},
                                                  {"flow-rate", "100"},
                                                  {"most", "90"},
                                                  {"load", "twist"},
                                                  {"substeps", "2"},
                                                  {"iterations", "2"},
                                                  {"method", "projective"},
                                                  {"damping", "5"},
                                                  {"frame-rate", "24"}};
    for (int i = 1; i < argc; i += 2) {
        const std::string name = std::strncmp(argv[i], "--", 2) == 0 ? argv[i] + 2 : "";
        if (!options.count(name) || i + 1 >= argc) throw std::runtime_error(std::string("what is '") + argv[i] + "'?");
        options[name] = argv[i + 1];
    }
    return run(options);
} catch (const std::exception& e) {
    std::fprintf(stderr, "field_error: %s\n", e.what());
    return 2;
}
