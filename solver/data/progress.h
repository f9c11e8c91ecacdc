// Progress goes down as an argument; the answer says whether to keep going.
#pragma once

#include <functional>
#include <string_view>

namespace sunder {

/// Reports a fraction in [0, 1] of one job to whoever asked for it. Copies are cheap views of the same job.
/// A default-made Progress reports to nobody and never cancels.
class Progress {
public:
    using Callback = std::function<bool(double fraction, std::string_view text)>;

    Progress() = default;
    /// `callback` must outlive every copy; it returns false to cancel.
    explicit Progress(const Callback& callback) : callback_(&callback) {}

    /// False: stop as soon as the data are whole, and return cancelled().
    bool report(double fraction, std::string_view text) const {
        return !callback_ || !*callback_ || (*callback_)(begin_ + fraction * (end_ - begin_), text);
    }

    /// The part of this job between two fractions of it, as a job of its own.
    Progress part(double begin, double end) const {
        Progress p = *this;
        p.begin_ = begin_ + begin * (end_ - begin_);
        p.end_ = begin_ + end * (end_ - begin_);
        return p;
    }

private:
    const Callback* callback_ = nullptr;
    double begin_ = 0.0, end_ = 1.0;
};

}  // namespace sunder
