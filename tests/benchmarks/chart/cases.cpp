#include "tests/benchmarks/chart/cases.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace sunder::chart {

Outcome outcome(const MovedBar& bar, double value, double reference) {
    const double error = std::abs(value / reference - 1);
    return {value,           reference,     std::isfinite(error) ? error : std::numeric_limits<double>::infinity(),
            bar.simulated_s, bar.frame_cpu, bar.total_substeps};
}

std::vector<std::vector<double>> reference_rows(const std::string& file) {
    std::ifstream in(SUNDER_TEST_DATA "/" + file);
    if (!in) throw std::runtime_error("cannot read " SUNDER_TEST_DATA "/" + file);
    std::vector<std::vector<double>> rows;
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0]))) continue;
        std::ranges::replace(line, ',', ' ');
        std::istringstream numbers(line);
        std::vector<double> row;
        for (double v; numbers >> v;) row.push_back(v);
        rows.push_back(row);
    }
    return rows;
}

}  // namespace sunder::chart
