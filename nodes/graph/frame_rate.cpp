#include "nodes/graph/frame_rate.h"

#include <cmath>
#include <cstdint>
#include <numeric>

namespace sunder {
namespace {

constexpr double kLargestTerm = 1e7;  // of a ratio: far beyond 60000/1001

bool is_term(double number) { return number >= 1 && number <= kLargestTerm && number == std::trunc(number); }

}  // namespace

Result<FrameRate> FrameRate::of(double frames, double seconds) {
    if (seconds != 1 && (!is_term(frames) || !is_term(seconds)))
        return bad_input("frame_rate", "a ratio takes whole numbers from 1 to 10000000", "as [24000, 1001]");
    if (!(frames / seconds >= 1 && frames / seconds <= 1000))
        return bad_input("frame_rate", "out of range", "permitted: 1 to 1000 frames per second");
    FrameRate rate;
    rate.frames_ = frames, rate.seconds_ = seconds;
    if (seconds != 1) {
        const auto common = static_cast<double>(std::gcd(static_cast<int64_t>(frames), static_cast<int64_t>(seconds)));
        rate.frames_ /= common, rate.seconds_ /= common;
    }
    return rate;
}

Result<FrameRate> FrameRate::read(const Json& json) {
    if (json.is_number()) return of(json.get<double>());
    if (json.is_array() && json.size() == 2 && json[0].is_number() && json[1].is_number())
        return of(json[0].get<double>(), json[1].get<double>());
    return bad_input("frame_rate", "takes a number or a ratio, not " + json.dump(), "24, or [24000, 1001]");
}

Json FrameRate::to_json() const {
    return is_ratio() ? Json::array({number_json(frames_), number_json(seconds_)}) : number_json(frames_);
}

std::string FrameRate::text() const {
    return is_ratio() ? number_json(frames_).dump() + "/" + number_json(seconds_).dump() : number_json(frames_).dump();
}

}  // namespace sunder
