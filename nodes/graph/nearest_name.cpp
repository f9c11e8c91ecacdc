#include "nodes/graph/nearest_name.h"

#include <algorithm>

namespace sunder {
namespace {

/// Levenshtein distance: insertions, removals and replacements that turn one into the other.
size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<size_t> row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (size_t i = 1; i <= a.size(); ++i) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            const size_t above = row[j];
            row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
            diagonal = above;
        }
    }
    return row[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
    constexpr size_t kLongestName = 100;  // longer ones are no slip of the finger, and the distance is quadratic
    std::string nearest;
    size_t best = kLongestName;
    if (name.size() > kLongestName) return nearest;
    for (const std::string& candidate : candidates) {
        if (candidate.size() > kLongestName) continue;
        const size_t distance = edit_distance(name, candidate);
        if (distance < best && 2 * distance <= std::max(name.size(), candidate.size())) {
            best = distance;
            nearest = candidate;
        }
    }
    return nearest;
}

std::string list_text(const std::vector<std::string>& names) {
    constexpr size_t kShown = 20;
    std::string text;
    for (size_t i = 0; i < std::min(names.size(), kShown); ++i) text += (i ? ", " : "") + names[i];
    if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
    return text.empty() ? "none" : text;
}

std::string permitted_text(std::string_view name, const std::vector<std::string>& candidates) {
    const std::string nearest = nearest_name(name, candidates);
    const std::string permitted = "permitted: " + list_text(candidates);
    return nearest.empty() ? permitted : "did you mean '" + nearest + "'? " + permitted;
}

}  // namespace sunder
