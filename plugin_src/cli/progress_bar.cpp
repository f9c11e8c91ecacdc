#include "plugin_src/cli/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

constexpr int kBarWidth = 30;  // characters
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr double kFirstGuess = 2.0;  // s of work before time left is worth telling

bool is_terminal() {
    const char* kind = std::getenv("TERM");
    return ::isatty(STDERR_FILENO) && kind && std::strcmp(kind, "dumb") != 0;
}

size_t terminal_width() {
    winsize size{};
    return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 10 ? size.ws_col : 80;
}

}  // namespace

ProgressBar::ProgressBar() : on_terminal_(is_terminal()), begin_(Clock::now()), last_drawn_(begin_ - kRedraw) {
    callback_ = [this](double fraction, std::string_view text) {
        if (on_terminal_) draw(fraction, text);
        return !is_interrupted();
    };
}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
    if (!is_drawn_) return;
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
    is_drawn_ = false;
}

void ProgressBar::draw(double fraction, std::string_view text) {
    const auto now = Clock::now();
    if (first_fraction_ < 0) first_fraction_ = fraction;
    if (is_drawn_ && now - last_drawn_ < kRedraw) return;
    last_drawn_ = now;
    fraction = std::clamp(fraction, 0.0, 1.0);
    const double spent = std::chrono::duration<double>(now - begin_).count();
    std::string left;
    if (spent > kFirstGuess && fraction > first_fraction_)
        left = ", " + duration_text(spent * (1 - fraction) / (fraction - first_fraction_)) + " left";

    const int filled = static_cast<int>(fraction * kBarWidth);
    char percent[16];
    std::snprintf(percent, sizeof percent, " %3d %% ", static_cast<int>(fraction * 100));
    std::string line = "[" + std::string(static_cast<size_t>(filled), '#') +
                       std::string(static_cast<size_t>(kBarWidth - filled), '.') + "]" + percent + std::string(text) +
                       left;
    if (is_interrupted()) line += " (stopping)";
    const size_t width = terminal_width() - 1;
    if (line.size() > width) line.resize(width);
    std::fprintf(stderr, "\r%s\x1b[K", line.c_str());
    std::fflush(stderr);
    is_drawn_ = true;
}

}  // namespace sunder::cli
