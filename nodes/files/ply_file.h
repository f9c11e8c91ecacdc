// Binary little-endian PLY: headers composed, files taken apart and checked to the last byte.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/files/byte_buffer.h"
#include "solver/data/result.h"

namespace sunder {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

size_t ply_size(PlyType type);       // bytes
const char* ply_name(PlyType type);  // char, uchar, ..., double

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float64;    // of the value, or of a list's entries
    std::optional<PlyType> count_type;  // set: a list, its length written in this type
};

struct PlyElement {
    std::string name;
    uint64_t count = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    std::vector<std::string> comments;  // one line each
    std::vector<PlyElement> elements;
};

/// Scalar properties of one type: "x y z".
std::vector<PlyProperty> ply_scalars(std::string_view names, PlyType type);

/// The header with its end line; rows follow, element after element.
void write_ply_header(ByteBuffer& io_bytes, const PlyHeader& header);

/// A PLY file in memory. Everything in it is accounted for: no row is missing, no byte is left over.
class PlyFile {
public:
    /// Errors (`where` names the file): not PLY, not binary little-endian, header not understood, truncated (which row
    /// of which element is missing), bytes left over.
    static Result<PlyFile> parse(std::string bytes, const std::string& where);

    const PlyHeader& header() const { return header_; }
    bool has_comment(std::string_view line) const;
    const PlyElement* find(std::string_view element) const;  // nullptr: there is none

    /// First byte of the rows of an element without lists, rows of row_bytes() bytes.
    const char* rows(const PlyElement& element) const;
    static size_t row_bytes(const PlyElement& element);  // element without lists

private:
    std::string bytes_;
    PlyHeader header_;
    std::vector<size_t> element_begin_;  // offset of each element's rows in bytes_
};

}  // namespace sunder
