#include "nodes/files/npy_file.h"

#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>

namespace sunder {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr const char* kMend =
    "save it as numpy.save(path, array) with array of float32 or float64, (frames, vertices, 3)";

// What follows "'name':" in the header, a Python dictionary that numpy writes in one way.
std::optional<std::string_view> entry(std::string_view header, std::string_view name) {
    const size_t at = header.find(name);
    if (at == std::string_view::npos) return {};
    size_t begin = at + name.size();
    while (begin < header.size() && (header[begin] == ':' || header[begin] == ' ')) ++begin;
    return header.substr(begin);
}

std::optional<std::array<size_t, 3>> shape_of(std::string_view text) {
    std::array<size_t, 3> shape{};
    if (text.empty() || text[0] != '(') return {};
    const char *p = text.data() + 1, *const end = text.data() + text.size();
    for (size_t k = 0; k < 3; ++k) {
        while (p < end && *p == ' ') ++p;
        const auto [after, error] = std::from_chars(p, end, shape[k]);
        if (error != std::errc() || after == end) return {};
        const bool last = k == 2;
        if (*after != (last ? ')' : ',') && !(last && *after == ',' && after + 1 < end && after[1] == ')')) return {};
        p = after + 1;
    }
    return shape;
}

struct Header {
    size_t begin = 0;  // of the numbers
    bool is_double = false;
    std::array<size_t, 3> shape = {};
};

Result<Header> read_header(std::string_view bytes, const std::string& where) {
    const auto fault = [&](const std::string& what) { return bad_input(where, what, kMend); };
    if (bytes.size() < 10 || bytes.substr(0, 6) != kMagic) return fault("it is no .npy file");
    const auto byte = [&](size_t i) { return size_t{static_cast<uint8_t>(bytes[i])}; };
    const bool is_long = byte(6) >= 2;
    if (is_long && bytes.size() < 12) return fault("it ends within its header");
    const size_t length = byte(8) | byte(9) << 8 | (is_long ? byte(10) << 16 | byte(11) << 24 : 0);
    Header header;
    header.begin = (is_long ? 12 : 10) + length;
    if (header.begin > bytes.size()) return fault("it ends within its header");
    const std::string_view text = bytes.substr(header.begin - length, length);
    const auto type = entry(text, "'descr'"), order = entry(text, "'fortran_order'"), shape = entry(text, "'shape'");
    if (!type || !order || !shape) return fault("its header does not tell type, order and shape");
    header.is_double = type->starts_with("'<f8'");
    if (!header.is_double && !type->starts_with("'<f4'")) return fault("its numbers are not little-endian floats");
    if (!order->starts_with("False")) return fault("its numbers are in Fortran's order");
    const auto found = shape_of(*shape);
    if (!found || (*found)[2] != 3) return fault("its shape is not (frames, vertices, 3)");
    header.shape = *found;
    return header;
}

template <class Number>
std::vector<Eigen::Matrix<Number, 3, 1>> rows_of(const char* bytes, size_t n) {
    std::vector<Eigen::Matrix<Number, 3, 1>> rows(n);
    std::memcpy(rows.front().data(), bytes, n * 3 * sizeof(Number));
    return rows;
}

}  // namespace

Result<VertexFrames> decode_npy(const std::string& bytes, const std::string& where) {
    const Result<Header> header = read_header(bytes, where);
    if (!header) return header.error();
    VertexFrames frames;
    frames.n_frames = header->shape[0], frames.n_vertices = header->shape[1];
    const size_t row = header->is_double ? 24 : 12, most = (bytes.size() - header->begin) / row;
    if (frames.n_vertices == 0 || frames.n_frames == 0) return bad_input(where, "it has no frame, or no vertex", kMend);
    if (frames.n_frames > most / frames.n_vertices) return bad_input(where, "it ends before its last frame", kMend);
    const size_t n = frames.n_frames * frames.n_vertices;
    const char* const data = bytes.data() + header->begin;
    if (header->is_double)
        frames.exact = rows_of<double>(data, n);
    else
        frames.single = rows_of<float>(data, n);
    return frames;
}

}  // namespace sunder
