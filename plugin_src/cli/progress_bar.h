// A bar with time left, on a terminal only. Elsewhere progress is told in plain lines by whoever runs the job.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "nodes/graph/graph.h"

namespace sunder::cli {

class ProgressBar {
public:
    ProgressBar();
    ~ProgressBar();  // wipes the bar
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    bool is_on_terminal() const { return on_terminal_; }
    /// Draws, and stops the job once the user pressed Ctrl-C. Holds as long as the bar.
    Progress progress() const { return Progress(callback_); }
    /// Wipes the bar so that a line can be printed; the next report draws it again.
    void clear();

private:
    using Clock = std::chrono::steady_clock;
    void draw(double fraction, std::string_view text);

    bool on_terminal_;
    bool is_drawn_ = false;
    double first_fraction_ = -1;  // where this run began: a resumed bake does not begin at 0
    Clock::time_point begin_, last_drawn_;
    Progress::Callback callback_;
};

}  // namespace sunder::cli
