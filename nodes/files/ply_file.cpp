#include "nodes/files/ply_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>

namespace sunder {
namespace {

struct TypeName {
    PlyType type;
    size_t bytes;
    const char* name;
    const char* other_name;
};
constexpr std::array<TypeName, 8> kTypes = {{{PlyType::int8, 1, "char", "int8"},
                                             {PlyType::uint8, 1, "uchar", "uint8"},
                                             {PlyType::int16, 2, "short", "int16"},
                                             {PlyType::uint16, 2, "ushort", "uint16"},
                                             {PlyType::int32, 4, "int", "int32"},
                                             {PlyType::uint32, 4, "uint", "uint32"},
                                             {PlyType::float32, 4, "float", "float32"},
                                             {PlyType::float64, 8, "double", "float64"}}};

std::optional<PlyType> type_of(std::string_view word) {
    for (const TypeName& t : kTypes)
        if (word == t.name || word == t.other_name) return t.type;
    return std::nullopt;
}

std::vector<std::string> words_of(const std::string& line) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string w; stream >> w;) words.push_back(w);
    return words;
}

// Length of a list, or nothing if it is negative or written as a fraction.
std::optional<uint64_t> list_length(const char* p, PlyType type) {
    int64_t n = -1;
    switch (type) {
        case PlyType::int8:
            n = read_number<int8_t>(p);
            break;
        case PlyType::uint8:
            n = read_number<uint8_t>(p);
            break;
        case PlyType::int16:
            n = read_number<int16_t>(p);
            break;
        case PlyType::uint16:
            n = read_number<uint16_t>(p);
            break;
        case PlyType::int32:
            n = read_number<int32_t>(p);
            break;
        case PlyType::uint32:
            n = read_number<uint32_t>(p);
            break;
        default:
            break;
    }
    return n < 0 ? std::nullopt : std::optional<uint64_t>(static_cast<uint64_t>(n));
}

bool has_lists(const PlyElement& e) {
    return std::any_of(e.properties.begin(), e.properties.end(),
                       [](const PlyProperty& p) { return p.count_type.has_value(); });
}

Result<PlyProperty> parse_property(const std::vector<std::string>& words, const std::string& where) {
    if (words.size() == 3)
        if (const auto type = type_of(words[1])) return PlyProperty{words[2], *type, {}};
    if (words.size() == 5 && words[1] == "list") {
        const auto count = type_of(words[2]), type = type_of(words[3]);
        if (count && type && *count != PlyType::float32 && *count != PlyType::float64)
            return PlyProperty{words[4], *type, count};
    }
    std::string line;
    for (const std::string& w : words) line += (line.empty() ? "" : " ") + w;
    return bad_input(where, "PLY header line not understood: '" + line.substr(0, 80) + "'");
}

// Bytes of the header; fills `out`.
Result<size_t> parse_header(const std::string& bytes, const std::string& where, PlyHeader& out) {
    size_t at = 0;
    bool has_format = false;
    for (int number = 0;; ++number) {
        const size_t end = bytes.find('\n', at);
        if (number == 0 && bytes.compare(0, 3, "ply") != 0) return bad_input(where, "is not a PLY file");
        if (end == std::string::npos) return bad_input(where, "is truncated: the PLY header does not end");
        std::string line = bytes.substr(at, end - at);
        at = end + 1;
        if (!line.empty() && line.back() == '\r') line.pop_back();
        const std::vector<std::string> words = words_of(line);
        if (number == 0) {
            if (line != "ply") return bad_input(where, "is not a PLY file");
        } else if (words.empty()) {
            return bad_input(where, "has an empty line in its PLY header");
        } else if (words[0] == "end_header") {
            break;
        } else if (words[0] == "comment" || words[0] == "obj_info") {
            const size_t text = line.find_first_not_of(" \t", words[0].size());
            out.comments.push_back(text == std::string::npos ? "" : line.substr(text));
        } else if (words[0] == "format") {
            if (words.size() != 3 || words[1] != "binary_little_endian" || words[2] != "1.0")
                return bad_input(
                    where, "is PLY of another kind ('" + line.substr(0, 60) + "'); binary_little_endian 1.0 is read");
            has_format = true;
        } else if (words[0] == "element") {
            uint64_t count = 0;
            const std::string digits = words.size() == 3 ? words[2] : "";
            const auto [stop, code] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
            if (digits.empty() || code != std::errc() || stop != digits.data() + digits.size())
                return bad_input(where, "PLY header line not understood: '" + line.substr(0, 80) + "'");
            out.elements.push_back({words[1], count, {}});
        } else if (words[0] == "property" && !out.elements.empty()) {
            auto property = parse_property(words, where);
            if (!property) return property.error();
            out.elements.back().properties.push_back(property.take());
        } else {
            return bad_input(where, "PLY header line not understood: '" + line.substr(0, 80) + "'");
        }
    }
    if (!has_format) return bad_input(where, "its PLY header gives no format");
    return at;
}

Error truncated(const std::string& where, const PlyElement& e, uint64_t row) {
    return bad_input(
        where, "is truncated: " + e.name + " " + std::to_string(row) + " of " + std::to_string(e.count) + " is missing",
        "write it again; a bake goes on with --resume");
}

// Offset behind the rows of an element with lists.
Result<size_t> walk_rows(const std::string& bytes, size_t at, const PlyElement& e, const std::string& where) {
    for (uint64_t row = 0; row < e.count; ++row)
        for (const PlyProperty& p : e.properties) {
            uint64_t n = 1;
            if (p.count_type) {
                if (bytes.size() - at < ply_size(*p.count_type)) return truncated(where, e, row);
                const auto length = list_length(bytes.data() + at, *p.count_type);
                if (!length)
                    return bad_input(where, e.name + " " + std::to_string(row) + " has a list of negative length");
                n = *length;
                at += ply_size(*p.count_type);
            }
            if ((bytes.size() - at) / ply_size(p.type) < n) return truncated(where, e, row);
            at += n * ply_size(p.type);
        }
    return at;
}

}  // namespace

size_t ply_size(PlyType type) { return kTypes[static_cast<size_t>(type)].bytes; }
const char* ply_name(PlyType type) { return kTypes[static_cast<size_t>(type)].name; }

std::vector<PlyProperty> ply_scalars(std::string_view names, PlyType type) {
    std::vector<PlyProperty> properties;
    for (const std::string& name : words_of(std::string(names))) properties.push_back({name, type, {}});
    return properties;
}

void write_ply_header(ByteBuffer& bytes, const PlyHeader& header) {
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& c : header.comments) text += "comment " + c + "\n";
    for (const PlyElement& e : header.elements) {
        text += "element " + e.name + " " + std::to_string(e.count) + "\n";
        for (const PlyProperty& p : e.properties) {
            text += "property ";
            if (p.count_type) text += std::string("list ") + ply_name(*p.count_type) + " ";
            text += std::string(ply_name(p.type)) + " " + p.name + "\n";
        }
    }
    bytes.text(text + "end_header\n");
}

Result<PlyFile> PlyFile::parse(std::string bytes, const std::string& where) {
    PlyFile file;
    const auto header_bytes = parse_header(bytes, where, file.header_);
    if (!header_bytes) return header_bytes.error();
    size_t at = *header_bytes;
    for (const PlyElement& e : file.header_.elements) {
        file.element_begin_.push_back(at);
        if (e.properties.empty() && e.count > 0)
            return bad_input(where, "its PLY element " + e.name + " has no properties");
        if (has_lists(e)) {
            const auto end = walk_rows(bytes, at, e, where);
            if (!end) return end.error();
            at = *end;
        } else if (e.count > 0) {
            const uint64_t fitting = (bytes.size() - at) / row_bytes(e);
            if (fitting < e.count) return truncated(where, e, fitting);
            at += e.count * row_bytes(e);
        }
    }
    if (at != bytes.size())
        return bad_input(where, "has " + std::to_string(bytes.size() - at) + " bytes more than its header announces");
    file.bytes_ = std::move(bytes);
    return file;
}

bool PlyFile::has_comment(std::string_view line) const {
    return std::find(header_.comments.begin(), header_.comments.end(), line) != header_.comments.end();
}

const PlyElement* PlyFile::find(std::string_view element) const {
    for (const PlyElement& e : header_.elements)
        if (e.name == element) return &e;
    return nullptr;
}

const char* PlyFile::rows(const PlyElement& element) const {
    return bytes_.data() + element_begin_[static_cast<size_t>(&element - header_.elements.data())];
}

size_t PlyFile::row_bytes(const PlyElement& element) {
    size_t n = 0;
    for (const PlyProperty& p : element.properties) n += ply_size(p.type);
    return n;
}

}  // namespace sunder
