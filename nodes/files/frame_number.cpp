#include "nodes/files/frame_number.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace sunder {

std::string frame_text(double frame) {
    if (frame == std::trunc(frame) && std::abs(frame) < 1e15) return std::to_string(static_cast<int64_t>(frame));
    std::array<char, 32> text = {};
    const auto [end, code] = std::to_chars(text.data(), text.data() + text.size(), frame);
    return code == std::errc() ? std::string(text.data(), end) : std::to_string(frame);
}

}  // namespace sunder
