// Words and numbers of a text file.
#pragma once

#include <charconv>
#include <string_view>

namespace sunder {

/// Cuts the next word off the front of `io_text`; empty at its end.
inline std::string_view next_word(std::string_view& io_text) {
    constexpr std::string_view kBlank = " \t\r\n\v\f";
    const size_t begin = io_text.find_first_not_of(kBlank);
    if (begin == io_text.npos) {
        io_text = {};
        return {};
    }
    const size_t end = io_text.find_first_of(kBlank, begin);
    const std::string_view word = io_text.substr(begin, end == io_text.npos ? end : end - begin);
    io_text.remove_prefix(begin + word.size());
    return word;
}

/// Cuts the next line off the front of `io_text`, without its end (\n, \r\n or \r).
inline std::string_view next_line(std::string_view& io_text) {
    const size_t end = io_text.find_first_of("\r\n");
    const std::string_view line = io_text.substr(0, end);
    size_t rest = end == io_text.npos ? io_text.size() : end + 1;
    if (end != io_text.npos && io_text[end] == '\r' && rest < io_text.size() && io_text[rest] == '\n') ++rest;
    io_text.remove_prefix(rest);
    return line;
}

/// The whole word as a number, whatever the locale; false if it is none.
template <class Number>
bool to_number(std::string_view word, Number& out) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
    return error == std::errc() && end == word.data() + word.size();
}

}  // namespace sunder
