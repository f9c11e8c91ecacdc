#include "plugin_src/cli/report.h"

#include <csignal>
#include <cstdio>

namespace sunder::cli {
namespace {

volatile std::sig_atomic_t interrupted = 0;  // set by the signal handler, which can reach nothing else

extern "C" void on_interrupt(int signal_number) {
    interrupted = 1;
    std::signal(signal_number, SIG_DFL);
}

}  // namespace

int fail(const Error& error, const std::string& where) {
    const std::string place = error.where.empty() ? where + ": " : "";
    std::fprintf(stderr, "sunder: error: %s%s\n", place.c_str(), error.text().c_str());
    switch (error.code) {
        case ErrorCode::bad_usage:
            return kWrongUsage;
        case ErrorCode::bad_input:
            return kBadInput;
        case ErrorCode::cancelled:
            return kCancelled;
        case ErrorCode::io:
        case ErrorCode::numerical:
        case ErrorCode::internal:
            break;
    }
    return kFailed;
}

void watch_interrupts() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);  // a file size limit then comes as an error of write()
}

bool is_interrupted() { return interrupted != 0; }

std::string bytes_text(uint64_t bytes) {
    const char* const units[] = {"bytes", "kB", "MB", "GB", "TB"};
    double value = static_cast<double>(bytes);
    int unit = 0;
    while (value >= 1000 && unit < 4) value /= 1000, ++unit;
    char text[40];
    std::snprintf(text, sizeof text, unit ? "%.1f %s" : "%.0f %s", value, units[unit]);
    return text;
}

std::string duration_text(double seconds) {
    const long s = static_cast<long>(seconds + 0.5);
    char text[40];
    if (s < 60)
        std::snprintf(text, sizeof text, "%ld s", s);
    else if (s < 3600)
        std::snprintf(text, sizeof text, "%ld:%02ld", s / 60, s % 60);
    else
        std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
    return text;
}

}  // namespace sunder::cli
