#pragma once

#include <chrono>

namespace sunder {

/// Adds the wall seconds that it lives to a sum.
class Stopwatch {
public:
    explicit Stopwatch(double& io_seconds) : total_(io_seconds), start_(std::chrono::steady_clock::now()) {}
    ~Stopwatch() { total_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& total_;
    std::chrono::steady_clock::time_point start_;
};

}  // namespace sunder
