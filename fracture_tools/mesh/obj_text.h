// OBJ text as assimp (5.2) reads it rightly.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sunder {

/// Of the numbers of a vertex assimp counts those that begin with a digit or a sign: one like ".5" it passes over, and
/// leaves out the vertex with it, so that all that follow have other numbers; of a comment behind them it counts the
/// words. A line that begins with blanks it passes over. Hence the same text with zeros before such points, and without
/// such comments and blanks; or none where it has none of these.
std::optional<std::string> mended_obj(std::string_view text);

}  // namespace sunder
