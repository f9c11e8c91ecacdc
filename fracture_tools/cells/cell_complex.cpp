#include "fracture_tools/cells/cell_complex.h"

#include <algorithm>
#include <numeric>

namespace sunder {

CellFaceLists::CellFaceLists(const CellComplex& complex) : offset(complex.n_cells() + 1, 0) {
    for (const CellFace& f : complex.faces) {
        ++offset[f.cell + 1];
        if (f.neighbour != CellFace::kOutside) ++offset[f.neighbour + 1];
    }
    std::partial_sum(offset.begin(), offset.end(), offset.begin());
    face.resize(offset.back());
    std::vector<uint32_t> next(offset.begin(), offset.end() - 1);
    for (uint32_t i = 0; i < complex.faces.size(); ++i) {
        face[next[complex.faces[i].cell]++] = i;
        if (complex.faces[i].neighbour != CellFace::kOutside) face[next[complex.faces[i].neighbour]++] = i;
    }
}

CellComplex make_cell_complex(const TetMesh& mesh) {
    // Sides of the tetrahedron (a b c d), outward:      abd, acb, adc, bcd.
    constexpr int kSides[4][3] = {{0, 1, 3}, {0, 2, 1}, {0, 3, 2}, {1, 2, 3}};
    struct Side {
        Triangle sorted;
        uint32_t tet, side;
    };
    CellComplex complex;
    complex.vertices = mesh.vertices;
    std::vector<Side> sides;
    sides.reserve(4 * mesh.tets.size());
    for (uint32_t t = 0; t < mesh.tets.size(); ++t) {
        const auto& tet = mesh.tets[t];
        const Vec3 &a = mesh.vertices[tet[0]], &b = mesh.vertices[tet[1]], &c = mesh.vertices[tet[2]],
                   &d = mesh.vertices[tet[3]];
        complex.cell_volume.push_back((b - a).cross(c - a).dot(d - a) / 6);
        complex.cell_centroid.push_back((a + b + c + d) / 4);
        for (uint32_t s = 0; s < 4; ++s) {
            Triangle v = {tet[kSides[s][0]], tet[kSides[s][1]], tet[kSides[s][2]]};
            std::sort(v.begin(), v.end());
            sides.push_back({v, t, s});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.sorted, x.tet, x.side) < std::tie(y.sorted, y.tet, y.side);
    });
    constexpr uint32_t kSecond = 0xfffffffeu;  // the side that its neighbour has listed
    std::vector<uint32_t> neighbour(sides.size(), CellFace::kOutside);
    for (size_t i = 0; i + 1 < sides.size(); ++i) {
        if (sides[i].sorted != sides[i + 1].sorted) continue;
        neighbour[4 * sides[i].tet + sides[i].side] = sides[i + 1].tet;
        neighbour[4 * sides[i + 1].tet + sides[i + 1].side] = kSecond;
        ++i;
    }
    for (uint32_t t = 0; t < mesh.tets.size(); ++t)
        for (uint32_t s = 0; s < 4; ++s) {
            if (neighbour[4 * t + s] == kSecond) continue;
            const auto& tet = mesh.tets[t];
            CellFace face;
            face.vertices = {tet[kSides[s][0]], tet[kSides[s][1]], tet[kSides[s][2]]};
            face.cell = t;
            face.neighbour = neighbour[4 * t + s];
            complex.faces.push_back(face);
        }
    return complex;
}

std::vector<Vec3> drop_crumbs(TetMesh& io_mesh, double least_volume) {
    const CellComplex complex = make_cell_complex(io_mesh);
    std::vector<uint32_t> part(complex.n_cells());
    std::iota(part.begin(), part.end(), 0u);
    auto lowest = [&](uint32_t i) {
        while (part[i] != i) i = part[i] = part[part[i]];
        return i;
    };
    for (const CellFace& f : complex.faces) {
        if (f.neighbour == CellFace::kOutside) continue;
        const uint32_t a = lowest(f.cell), b = lowest(f.neighbour);
        part[std::max(a, b)] = std::min(a, b);
    }
    std::vector<double> volume(complex.n_cells(), 0);
    for (uint32_t i = 0; i < complex.n_cells(); ++i) volume[lowest(i)] += complex.cell_volume[i];
    const auto largest = static_cast<uint32_t>(std::max_element(volume.begin(), volume.end()) - volume.begin());
    std::vector<std::array<uint32_t, 4>> kept;
    std::vector<Vec3> places;
    for (uint32_t i = 0; i < complex.n_cells(); ++i) {
        const uint32_t root = lowest(i);
        const bool is_crumb = root != largest && volume[root] < least_volume;
        if (!is_crumb)
            kept.push_back(io_mesh.tets[i]);
        else if (root == i)
            places.push_back(io_mesh.vertices[io_mesh.tets[i][0]]);
    }
    io_mesh.tets = std::move(kept);
    return places;
}

}  // namespace sunder
