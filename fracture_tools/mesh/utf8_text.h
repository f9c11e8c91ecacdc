// Names out of files whose encoding nobody tells.
#pragma once

#include <string>
#include <string_view>

namespace sunder {

/// Whether `text` is UTF-8 (RFC 3629, section 4): neither cut off nor longer than need be, without surrogates.
inline bool is_utf8(std::string_view text) {
    for (size_t i = 0; i < text.size();) {
        const auto byte = [&](size_t k) { return static_cast<unsigned char>(text[k]); };
        const unsigned char lead = byte(i);
        const size_t length = lead < 0x80   ? 1
                              : lead < 0xc2 ? 0
                              : lead < 0xe0 ? 2
                              : lead < 0xf0 ? 3
                              : lead < 0xf5 ? 4
                                            : 0;
        if (length == 0 || text.size() - i < length) return false;
        for (size_t k = 1; k < length; ++k)
            if ((byte(i + k) & 0xc0) != 0x80) return false;
        const unsigned char second = length > 1 ? byte(i + 1) : 0;
        if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) || (lead == 0xf0 && second < 0x90) ||
            (lead == 0xf4 && second > 0x8f))
            return false;
        i += length;
    }
    return true;
}

/// UTF-8 stays; other bytes are taken as Latin-1, the first 256 characters of Unicode.
inline std::string to_utf8(std::string text) {
    if (is_utf8(text)) return text;
    std::string converted;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= 0x80) converted += static_cast<char>(0xc0 | (byte >> 6));
        converted += byte < 0x80 ? c : static_cast<char>(0x80 | (byte & 0x3f));
    }
    return converted;
}

}  // namespace sunder
