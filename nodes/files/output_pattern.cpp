#include "nodes/files/output_pattern.h"

#include <cmath>
#include <cstdlib>

namespace sunder {

Status check_output_pattern(const std::string& pattern) {
    const auto refuse = [](std::string what) {
        return bad_input("", std::move(what), "a path below the output folder, as mesh/bunny.####.ply");
    };
    if (pattern.empty()) return refuse("the path is empty");
    if (pattern.find('\\') != std::string::npos || pattern.find(':') != std::string::npos)
        return refuse("the path '" + pattern + "' holds a \\ or :");
    for (size_t begin = 0; begin <= pattern.size();) {
        const size_t end = std::min(pattern.find('/', begin), pattern.size());
        const std::string part = pattern.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..")
            return refuse("the path '" + pattern + "' leaves the output folder");
        begin = end + 1;
    }
    const size_t first = pattern.find('#');
    if (first == std::string::npos) return refuse("the path '" + pattern + "' has no #### for the frame");
    const size_t after = pattern.find_first_not_of('#', first);
    if (after != std::string::npos && pattern.find_first_of("#/", after) != std::string::npos)
        return refuse("the path '" + pattern + "' needs one run of #, in the file's name");
    return {};
}

std::string output_path(const std::string& pattern, double frame) {
    constexpr double kParts = 1000;  // of a frame, that names tell apart
    const double parts = std::round(frame * kParts), whole = std::floor(parts / kParts);
    const bool is_negative = whole < 0;
    const size_t first = pattern.find('#');
    const size_t after = std::min(pattern.find_first_not_of('#', first), pattern.size());
    std::string digits = std::to_string(std::abs(static_cast<long>(whole)));
    const size_t width = after - first - (is_negative ? 1 : 0);
    if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
    const std::string behind = std::to_string(static_cast<long>(kParts + parts - whole * kParts)).substr(1);
    return pattern.substr(0, first) + (is_negative ? "-" : "") + digits + (behind == "000" ? "" : "_" + behind) +
           pattern.substr(after);
}

std::string shot_path(const std::string& pattern, const std::string& extension) {
    std::string stem = pattern.substr(0, pattern.rfind('.'));
    const size_t first = stem.find('#');
    stem.erase(first, stem.find_last_of('#') + 1 - first);
    while (!stem.empty() && (stem.back() == '.' || stem.back() == '_' || stem.back() == '-')) stem.pop_back();
    if (stem.empty() || stem.back() == '/') stem += "shot";
    return stem + extension;
}

std::string file_name_of(const std::string& node) {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string name;
    for (unsigned char c : node)
        if (std::isalnum(c) || c == '_' || c == '-')
            name += static_cast<char>(c);
        else
            name += '%', name += kDigits[c >> 4], name += kDigits[c & 15];
    return name;
}

}  // namespace sunder
