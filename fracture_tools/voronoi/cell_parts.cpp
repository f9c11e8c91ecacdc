#include "fracture_tools/voronoi/cell_parts.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

Triangle outward(const CellFace& face, uint32_t cell) {
    return face.cell == cell ? face.vertices : Triangle{face.vertices[0], face.vertices[2], face.vertices[1]};
}

/// A closed surface of one cell.
struct Shell {
    std::vector<uint32_t> faces;
    double volume = 0;          // m3, below 0 around a hollow
    Vec3 first = Vec3::Zero();  // int x dV from the reference point
};

class PartFinder {
public:
    explicit PartFinder(const CellComplex& complex)
        : complex_(complex),
          lists_(complex),
          parent_(complex.vertices.size()),
          owner_(complex.vertices.size(), kNone) {}

    /// The parts of a cell: their shells, the outer one first.
    std::vector<std::vector<Shell>> parts(uint32_t cell) {
        std::vector<Shell> shells = find_shells(cell);
        std::vector<std::vector<Shell>> parts;
        if (shells.size() == 1) {
            parts.push_back(std::move(shells));
            return parts;
        }
        std::vector<Shell> hollows;
        for (Shell& s : shells) {
            if (s.volume < 0)
                hollows.push_back(std::move(s));
            else
                parts.push_back({std::move(s)});
        }
        const size_t n_solid = parts.size();
        for (Shell& h : hollows) {
            const Vec3& p = complex_.vertices[complex_.faces[h.faces[0]].vertices[0]];
            size_t around = n_solid;
            for (size_t k = 0; k < n_solid; ++k)
                if (encloses(parts[k][0], cell, p) &&
                    (around == n_solid || parts[k][0].volume < parts[around][0].volume))
                    around = k;
            if (around < n_solid)
                parts[around].push_back(std::move(h));
            else
                parts.push_back({std::move(h)});  // flat, and turned over by rounding
        }
        return parts;
    }

private:
    std::span<const uint32_t> faces_of(uint32_t cell) const {
        return {lists_.face.data() + lists_.offset[cell], lists_.offset[cell + 1] - lists_.offset[cell]};
    }
    uint32_t root(uint32_t v) {
        while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
        return v;
    }

    /// Faces that share vertices; in order of their first faces.
    std::vector<Shell> find_shells(uint32_t cell) {
        for (uint32_t f : faces_of(cell))
            for (uint32_t v : complex_.faces[f].vertices)
                if (owner_[v] != cell) owner_[v] = cell, parent_[v] = v;
        for (uint32_t f : faces_of(cell)) {
            const auto& [a, b, c] = complex_.faces[f].vertices;
            parent_[root(b)] = root(a);
            parent_[root(c)] = root(a);
        }
        std::vector<Shell> shells;
        std::vector<uint32_t> roots;
        if (faces_of(cell).empty()) return shells;
        const Vec3 reference = complex_.vertices[complex_.faces[faces_of(cell)[0]].vertices[0]];
        for (uint32_t f : faces_of(cell)) {
            const uint32_t r = root(complex_.faces[f].vertices[0]);
            const size_t k = static_cast<size_t>(std::find(roots.begin(), roots.end(), r) - roots.begin());
            if (k == roots.size()) roots.push_back(r), shells.emplace_back();
            shells[k].faces.push_back(f);
            const auto [i, j, l] = outward(complex_.faces[f], cell);
            const Vec3 a = complex_.vertices[i] - reference, b = complex_.vertices[j] - reference,
                       c = complex_.vertices[l] - reference;
            const double v = a.dot(b.cross(c)) / 6;
            shells[k].volume += v;
            shells[k].first += v / 4 * (a + b + c) + v * reference;
        }
        return shells;
    }

    /// By the solid angle that the shell covers, seen from p (van Oosterom & Strackee 1983).
    bool encloses(const Shell& shell, uint32_t cell, const Vec3& p) const {
        double angle = 0;
        for (uint32_t f : shell.faces) {
            const auto [i, j, k] = outward(complex_.faces[f], cell);
            const Vec3 a = complex_.vertices[i] - p, b = complex_.vertices[j] - p, c = complex_.vertices[k] - p;
            const double la = a.norm(), lb = b.norm(), lc = c.norm();
            angle += 2 * math::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        return angle > 2 * std::numbers::pi;
    }

    const CellComplex& complex_;
    CellFaceLists lists_;
    std::vector<uint32_t> parent_, owner_;  // of each vertex, for the cell at hand
};

}  // namespace

void split_into_parts(CellComplex& io_complex) {
    const auto n_cells = static_cast<uint32_t>(io_complex.cell_site.size());
    io_complex.cell_volume.assign(n_cells, 0);
    PartFinder finder(io_complex);
    std::vector<std::array<uint32_t, 2>> part_at(io_complex.faces.size());  // of the face's cell and neighbour
    std::vector<double> volume;
    std::vector<Vec3> centroid, site;
    for (uint32_t cell = 0; cell < n_cells; ++cell)
        for (const auto& shells : finder.parts(cell)) {
            const auto part = static_cast<uint32_t>(volume.size());
            double v = 0;
            Vec3 first = Vec3::Zero();
            for (const Shell& s : shells) {
                v += s.volume, first += s.first;
                for (uint32_t f : s.faces) part_at[f][io_complex.faces[f].cell != cell] = part;
            }
            volume.push_back(v);
            centroid.push_back(v > 0 ? Vec3(first / v)
                                     : io_complex.vertices[io_complex.faces[shells[0].faces[0]].vertices[0]]);
            site.push_back(io_complex.cell_site[cell]);
        }
    for (size_t f = 0; f < part_at.size(); ++f) {
        CellFace& face = io_complex.faces[f];
        face.cell = part_at[f][0];
        if (face.neighbour != CellFace::kOutside) face.neighbour = part_at[f][1];
    }
    io_complex.cell_volume = std::move(volume);
    io_complex.cell_centroid = std::move(centroid);
    io_complex.cell_site = std::move(site);
}

uint32_t merge_small_cells(const CellComplex& complex, double least_share, std::vector<uint32_t>& out_label) {
    const auto n = static_cast<uint32_t>(complex.n_cells());
    std::vector<std::map<uint32_t, double>> shared(n);  // area with each neighbour, m2
    for (const CellFace& f : complex.faces) {
        if (f.neighbour == CellFace::kOutside) continue;
        const double area = complex.face_area(f);
        shared[f.cell][f.neighbour] += area;
        shared[f.neighbour][f.cell] += area;
    }
    std::vector<double> volume = complex.cell_volume;
    auto is_small = [&](uint32_t i) {
        double area = 0, around = 0;
        for (const auto& [other, a] : shared[i]) area += a, around += a * volume[other];
        return volume[i] <= 0 || volume[i] * area < least_share * around;
    };
    std::set<std::pair<double, uint32_t>> small;
    for (uint32_t i = 0; i < n; ++i)
        if (is_small(i)) small.emplace(volume[i], i);
    std::vector<uint32_t> merged = disjoint_sets(n);
    while (!small.empty()) {
        const uint32_t from = small.begin()->second;
        small.erase(small.begin());
        uint32_t to = kNone;
        for (const auto& [other, area] : shared[from])
            if (to == kNone || area > shared[from][to]) to = other;
        if (to == kNone) continue;  // a separate part of the solid
        small.erase({volume[to], to});
        volume[to] += volume[from];
        unite(merged, from, to);
        for (const auto& [other, area] : shared[from]) {
            shared[other].erase(from);
            if (other != to) shared[to][other] += area, shared[other][to] += area;
        }
        shared[from].clear();
        if (is_small(to)) small.emplace(volume[to], to);
        for (const auto& [other, area] : shared[to])
            if (is_small(other)) small.emplace(volume[other], other);
    }
    out_label.resize(n);
    uint32_t n_labels = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t first = lowest(merged, i);
        out_label[i] = first == i ? n_labels++ : out_label[first];
    }
    return n_labels;
}

}  // namespace sunder
