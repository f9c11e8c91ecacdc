// Numbers, tuples, arrays and names as USD writes them in text (openusd.org, usda).
#pragma once

#include <cctype>
#include <charconv>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace sunder {

inline void put(std::string& out, float value) {
    char text[32];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);  // shortest that reads back the same
}
inline void put(std::string& out, double value) {
    char text[32];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}
inline std::string number_text(double value) {
    std::string text;
    put(text, value);
    return text;
}
template <class Integer>
void put_integer(std::string& out, Integer value) {
    char text[24];
    out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

template <class Vector>
void put_tuple(std::string& out, const Vector& v) {
    for (int k = 0; k < v.size(); ++k) out += k ? ", " : "(", put(out, v[k]);
    out += ')';
}

// "[a, b, c]", `put_one(i)` writing entry i of n.
template <class PutOne>
void put_array(std::string& out, size_t n, PutOne&& put_one) {
    out += '[';
    for (size_t i = 0; i < n; ++i) {
        if (i) out += ", ";
        put_one(i);
    }
    out += ']';
}

template <class Vector>
void put_tuples(std::string& out, const std::vector<Vector>& values) {
    put_array(out, values.size(), [&](size_t i) { put_tuple(out, values[i]); });
}

/// "text" in quotes; control characters become blanks.
inline std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += static_cast<unsigned char>(c) < ' ' || c == 0x7f ? ' ' : c;
    }
    return out + '"';
}

/// Prim names: letters, digits, _; not a digit first; each once.
class PrimNames {
public:
    PrimNames(std::set<std::string> taken = {}) : taken_(std::move(taken)) {}

    std::string make(std::string name) {
        for (char& c : name)
            if (!std::isalnum(static_cast<unsigned char>(c)) || static_cast<unsigned char>(c) >= 128) c = '_';
        if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) name.insert(0, "_");
        std::string unique = name;
        for (int n = 2; !taken_.insert(unique).second; ++n) unique = name + "_" + std::to_string(n);
        return unique;
    }

private:
    std::set<std::string> taken_;
};

}  // namespace sunder
