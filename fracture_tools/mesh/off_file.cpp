#include <cmath>

#include "fracture_tools/mesh/mesh_assembler.h"
#include "fracture_tools/mesh/polygon_files.h"
#include "fracture_tools/mesh/text_scanner.h"

namespace sunder {
namespace {

constexpr uint64_t kMostCorners = 10'000;  // of one polygon; cutting it up takes the square of that

/// The next line that holds something; comments are cut off.
std::string_view next_content(std::string_view& io_text) {
    while (!io_text.empty()) {
        std::string_view line = next_line(io_text);
        line = line.substr(0, line.find('#'));
        std::string_view rest = line;
        if (!next_word(rest).empty()) return line;
    }
    return {};
}

bool read_counts(std::string_view line, uint64_t& out_vertices, uint64_t& out_faces) {
    return to_number(next_word(line), out_vertices) && to_number(next_word(line), out_faces);
}

}  // namespace

Result<TriMesh> read_off(std::string_view bytes, const std::string& where, double scale) {
    std::string_view text = bytes;
    auto truncated = [&](const char* what, uint64_t k) {
        return bad_input(where, "the file ends, or is damaged, at " + std::string(what) + " " + std::to_string(k));
    };
    std::string_view line = next_content(text);
    const std::string_view magic = next_word(line);
    if (magic.size() < 3 || magic.substr(magic.size() - 3) != "OFF" || line.find("BINARY") != line.npos)
        return bad_input(where, "this is no text OFF file");
    if (std::string_view rest = line; next_word(rest).empty()) line = next_content(text);  // counts may follow at once
    uint64_t n_vertices = 0, n_faces = 0;
    if (!read_counts(line, n_vertices, n_faces)) return bad_input(where, "the file does not tell how much it holds");

    MeshAssembler assembler(false, false, false);
    std::vector<uint32_t> number;
    for (uint64_t v = 0; v < n_vertices; ++v) {
        std::string_view at = next_content(text);
        Vec3 p;
        for (int k = 0; k < 3; ++k)
            if (!to_number(next_word(at), p[k])) return truncated("vertex", v);
        p *= scale;
        if (!p.allFinite())
            return bad_input(where, "vertex " + std::to_string(v) + " has a coordinate that is no finite number");
        number.push_back(assembler.weld(p));
    }
    std::vector<FileCorner> corners;
    for (uint64_t f = 0; f < n_faces; ++f) {
        std::string_view face = next_content(text);
        uint64_t n = 0;
        if (!to_number(next_word(face), n) || n > kMostCorners) return truncated("face", f);
        corners.clear();
        for (uint64_t c = 0; c < n; ++c) {
            uint64_t v = 0;
            if (!to_number(next_word(face), v)) return truncated("face", f);
            if (v >= number.size())
                return bad_input(where, "face " + std::to_string(f) + " names vertex " + std::to_string(v) + " of " +
                                            std::to_string(number.size()));
            corners.push_back({number[v], Vec2f::Zero(), Vec3::Zero()});
        }
        assembler.add_polygon(corners, 0);
    }
    if (assembler.n_triangles() == 0) return bad_input(where, "the file has no triangles");
    return assembler.finish();
}

}  // namespace sunder
