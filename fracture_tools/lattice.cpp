#include "fracture_tools/lattice.h"

#include <string>

#include "fracture_tools/fragments/interfaces.h"
#include "fracture_tools/fragments/prefracture.h"

namespace sunder {
namespace {

constexpr int kMaxCellsAlongAxis = 1000;
constexpr int64_t kMaxCells = 4'000'000;

/// The regular numbering of cells and corners, x fastest.
struct Grid {
    std::array<int, 3> cells;
    Vec3 origin, cell_size;

    uint32_t cell(int x, int y, int z) const {
        return static_cast<uint32_t>((int64_t(z) * cells[1] + y) * cells[0] + x);
    }
    uint32_t vertex(int x, int y, int z) const {
        return static_cast<uint32_t>((int64_t(z) * (cells[1] + 1) + y) * (cells[0] + 1) + x);
    }
    bool has_cell(int x, int y, int z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < cells[0] && y < cells[1] && z < cells[2];
    }
    /// Corners of the cell's square face on the `side` (0 low, 1 high) of `axis`, counter-clockwise from outside.
    std::array<uint32_t, 4> face(int x, int y, int z, int axis, int side) const {
        const std::array<int, 3> base = {x, y, z};
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        constexpr int kAround[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        std::array<uint32_t, 4> corners;
        for (int c = 0; c < 4; ++c) {
            const int* step = kAround[side == 1 ? c : 3 - c];
            std::array<int, 3> p = base;
            p[axis] += side;
            p[u] += step[0];
            p[v] += step[1];
            corners[c] = vertex(p[0], p[1], p[2]);
        }
        return corners;
    }
};

void append_square(const std::array<uint32_t, 4>& corners, std::vector<Triangle>& io_triangles) {
    io_triangles.push_back({corners[0], corners[1], corners[2]});
    io_triangles.push_back({corners[0], corners[2], corners[3]});
}

std::vector<Vec3> grid_vertices(const Grid& grid) {
    std::vector<Vec3> vertices;
    vertices.reserve(size_t(grid.cells[0] + 1) * (grid.cells[1] + 1) * (grid.cells[2] + 1));
    for (int z = 0; z <= grid.cells[2]; ++z)
        for (int y = 0; y <= grid.cells[1]; ++y)
            for (int x = 0; x <= grid.cells[0]; ++x)
                vertices.push_back(grid.origin + grid.cell_size.cwiseProduct(Vec3(x, y, z)));
    return vertices;
}

void append_cell_surface(const Grid& grid, int x, int y, int z, FragmentSet& io_set) {
    Fragment fragment;
    fragment.outer_begin = static_cast<uint32_t>(io_set.outer_triangles.size());
    const std::array<int, 3> at = {x, y, z};
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            if (at[axis] == (side == 1 ? grid.cells[axis] - 1 : 0))
                append_square(grid.face(x, y, z, axis, side), io_set.outer_triangles);
    fragment.outer_end = static_cast<uint32_t>(io_set.outer_triangles.size());
    io_set.fragments.push_back(fragment);
}

/// Joins the cell to those of its neighbours that have a higher number; offsets ascend with that number.
void append_interfaces(const Grid& grid, int x, int y, int z, int neighbours, FragmentSet& io_set) {
    const int max_steps = neighbours == 6 ? 1 : neighbours == 18 ? 2 : 3;
    const Vec3 middle = grid.origin + grid.cell_size.cwiseProduct(Vec3(x + 0.5, y + 0.5, z + 0.5));
    for (int dz = 0; dz <= 1; ++dz)
        for (int dy = dz > 0 ? -1 : 0; dy <= 1; ++dy)
            for (int dx = dz > 0 || dy > 0 ? -1 : 1; dx <= 1; ++dx) {
                const int steps = std::abs(dx) + std::abs(dy) + std::abs(dz);
                if (steps > max_steps || !grid.has_cell(x + dx, y + dy, z + dz)) continue;
                Interface face;
                face.a = FragmentId(grid.cell(x, y, z));
                face.b = FragmentId(grid.cell(x + dx, y + dy, z + dz));
                face.normal = grid.cell_size.cwiseProduct(Vec3(dx, dy, dz)).normalized();
                face.centroid = middle + 0.5 * grid.cell_size.cwiseProduct(Vec3(dx, dy, dz));
                face.triangle_begin = static_cast<uint32_t>(io_set.interface_triangles.size());
                if (steps == 1)
                    append_square(grid.face(x, y, z, dx != 0 ? 0 : dy != 0 ? 1 : 2, 1), io_set.interface_triangles);
                face.triangle_end = static_cast<uint32_t>(io_set.interface_triangles.size());
                io_set.interfaces.push_back(face);
            }
}

}  // namespace

Status LatticeSettings::check(const std::string& where) const {
    if (!size.allFinite() || size.minCoeff() <= 0 || size.maxCoeff() > 1e6)
        return bad_input(where, "size must be above 0 and at most 1e6 m along each axis");
    if (!center.allFinite()) return bad_input(where, "center must be finite");
    int64_t product = 1;
    for (int n : cells) {
        if (n < 1 || n > kMaxCellsAlongAxis)
            return bad_input(where, "cells must be 1 to 1000 along each axis, not " + std::to_string(n));
        product *= n;
    }
    if (product > kMaxCells) return bad_input(where, "there are more than 4 million cells", "use fewer cells");
    if (neighbours != 6 && neighbours != 18 && neighbours != 26)
        return bad_input(where, "neighbours must be 6, 18 or 26, not " + std::to_string(neighbours));
    return {};
}

Result<FragmentSet> make_lattice(const LatticeSettings& settings, const std::string& where) {
    if (Status s = settings.check(where); !s) return s.error();
    Grid grid;
    grid.cells = settings.cells;
    grid.origin = settings.center - 0.5 * settings.size;
    grid.cell_size = settings.size.cwiseQuotient(Vec3(grid.cells[0], grid.cells[1], grid.cells[2]));

    FragmentSet set;
    set.vertices = grid_vertices(grid);
    set.fragments.reserve(size_t(grid.cells[0]) * grid.cells[1] * grid.cells[2]);
    for (int z = 0; z < grid.cells[2]; ++z)
        for (int y = 0; y < grid.cells[1]; ++y)
            for (int x = 0; x < grid.cells[0]; ++x) {
                append_cell_surface(grid, x, y, z, set);
                append_interfaces(grid, x, y, z, settings.neighbours, set);
            }
    set.outer_material.assign(set.outer_triangles.size(), 0);
    const Vec3& s = settings.size;
    set.source_volume = s.prod();
    set.source_area = 2 * (s.x() * s.y() + s.y() * s.z() + s.z() * s.x());
    measure_fragments(set);
    assign_interface_uvs(set);
    return set;
}

}  // namespace sunder
