// Frames per second: a number, or a ratio that is what it says however long a shot is.
#pragma once

#include <string>

#include "nodes/graph/json.h"
#include "solver/data/result.h"

namespace sunder {

/// So many frames in so many seconds: 24 in 1, or 24000 in 1001, of whole numbers in lowest terms.
class FrameRate {
public:
    FrameRate() = default;
    /// Errors: less than 1 or more than 1000 frames a second; a ratio of what is not whole or beyond 10 million.
    static Result<FrameRate> of(double frames, double seconds = 1);
    /// 24, 23.976, [24000, 1001]; what `to_json` writes.
    static Result<FrameRate> read(const Json& json);

    double per_second() const { return frames_ / seconds_; }
    /// How long some frames take, s: rounded once, so that nothing adds up.
    double seconds(double n_frames) const { return n_frames * seconds_ / frames_; }
    bool is_ratio() const { return seconds_ != 1; }
    double numerator() const { return frames_; }
    double denominator() const { return seconds_; }
    Json to_json() const;
    std::string text() const;  // "24", "23.976", "24000/1001"
    bool operator==(const FrameRate&) const = default;

private:
    double frames_ = 24, seconds_ = 1;
};

}  // namespace sunder
