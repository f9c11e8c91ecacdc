#include "fracture_tools/voronoi/triangle_clipping.h"

#include <algorithm>

#include "fracture_tools/mesh/parallel_chunks.h"
#include "fracture_tools/mesh/point_grid.h"

namespace sunder {
namespace {

/// Chunks are small enough that a few large triangles are spread over threads, too.
constexpr size_t kLargestChunk = 256, kChunks = 64;

class Clipper {
public:
    Clipper(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram)
        : mesh_(mesh), sites_(sites), diagram_(diagram), seen_(sites.size(), kNever) {}

    /// Appends the parts of a triangle, from the one in `start` on, which is the cell of its first corner.
    void clip(uint32_t triangle, uint32_t start) {
        for (int m = 0; m < 3; ++m) corners_[m] = mesh_.positions[mesh_.triangles[triangle][m]];
        cells_.assign(1, start);
        seen_[start] = triangle;
        for (size_t k = 0; k < cells_.size(); ++k) {
            const uint32_t cell = cells_[k];
            if (!clip_by_cell(cell)) continue;
            SurfacePolygon part{triangle, cell, static_cast<uint32_t>(out.side.size()), 0};
            for (const Corner& c : polygon_) {
                out.side.push_back(c.side);
                if (is_triangle_edge(c.side) || seen_[c.side] == triangle) continue;
                seen_[c.side] = triangle;
                cells_.push_back(c.side);
            }
            part.end = static_cast<uint32_t>(out.side.size());
            out.polygons.push_back(part);
        }
    }

    /// The cell that a point lies in: from `hint` always on to a nearer site. Exact.
    uint32_t locate(const Vec3& p, uint32_t hint) {
        for (bool moved = true; moved;) {
            moved = false;
            for (uint32_t l : neighbours(hint))
                if (l < sites_.size() && nearer_site(p, sites_[hint], sites_[l], out.count) < 0) {
                    hint = l, moved = true;
                    break;
                }
        }
        return hint;
    }

    ClippedSurface out;

private:
    static constexpr uint32_t kNever = 0xffffffffu;

    struct Corner {
        LineLabel side;       // that begins here
        Bounded3 functional;  // of that side
        Bounded3 weights;     // of the triangle's corners, not normalised
    };

    std::span<const uint32_t> neighbours(uint32_t cell) const {
        const uint32_t begin = diagram_.neighbour_offset[cell], end = diagram_.neighbour_offset[cell + 1];
        return {diagram_.neighbour.data() + begin, end - begin};
    }

    /// Leaves the part of the triangle in polygon_; false when there is none.
    bool clip_by_cell(uint32_t cell) {
        polygon_.clear();
        for (int m = 0; m < 3; ++m) {
            const int opposite = (m + 2) % 3;  // of the edge from corner m to m + 1
            polygon_.push_back({kTriangleEdge + opposite, edge_functional(opposite), edge_functional(m)});
        }
        double reach = 0;  // squared distance of the farthest corner
        for (const Vec3& p : corners_) reach = std::max(reach, (p - sites_[cell]).squaredNorm());
        const Bounded3 to_cell = squared_distances(corners_, sites_[cell]);
        for (uint32_t l : neighbours(cell)) {
            if (l >= sites_.size()) continue;
            // A site more than twice as far away as each corner is nearer to none of them; 1e-9 is for rounding.
            if ((sites_[l] - sites_[cell]).squaredNorm() > 4 * (1 + 1e-9) * reach) break;
            const Bounded3 to_l = squared_distances(corners_, sites_[l]);
            const Bounded3 h = {to_l[0] - to_cell[0], to_l[1] - to_cell[1], to_l[2] - to_cell[2]};
            if (h[0].is_positive() && h[1].is_positive() && h[2].is_positive()) continue;
            if (!clip_by_line(cell, l, h)) return false;
        }
        return true;
    }

    ///       kept  | cut off          Corners on the far side of line l go. They follow one another, since the
    ///     ---p--- x ---o             polygon is convex; x and y take their place:
    ///             |l   |                 p: side before, x: side l, y: side of the last one that was cut off
    ///     -------- y --q
    bool clip_by_line(uint32_t cell, uint32_t l, const Bounded3& h) {
        const size_t n = polygon_.size();
        side_of_l_.resize(n);
        size_t n_kept = 0;
        for (size_t c = 0; c < n; ++c) {
            const Bounded d = dot(polygon_[c].weights, h);
            int sign = d.is_positive() ? 1 : -1;
            if (!d.has_sign()) {
                ++out.count.exact;
                sign = exact_side(corners_, sites_, cell, polygon_[(c + n - 1) % n].side, polygon_[c].side, l);
                if (sign == 0) ++out.count.zeros;
            }
            side_of_l_[c] = sign;
            n_kept += sign > 0;
        }
        if (n_kept == n) return true;
        if (n_kept == 0) return false;
        size_t first = 0;  // first corner cut off
        while (side_of_l_[first] > 0 || side_of_l_[(first + n - 1) % n] <= 0) ++first;
        const Corner& before = polygon_[(first + n - 1) % n];
        next_.clear();
        next_.push_back({l, h, cross(before.functional, h)});
        size_t last = first;
        while (side_of_l_[(last + 1) % n] <= 0) last = (last + 1) % n;
        const Corner& end = polygon_[last];
        next_.push_back({end.side, end.functional, cross(h, end.functional)});
        for (size_t c = (last + 1) % n; side_of_l_[c] > 0; c = (c + 1) % n) next_.push_back(polygon_[c]);
        polygon_.swap(next_);
        return true;
    }

    MeshView mesh_;
    std::span<const Vec3> sites_;
    const VoronoiDiagram& diagram_;
    std::vector<uint32_t> seen_;  // triangle that a cell was last listed for

    Corners corners_;
    std::vector<uint32_t> cells_;
    std::vector<Corner> polygon_, next_;
    std::vector<int> side_of_l_;
};

size_t chunk_size(size_t n) { return std::clamp<size_t>(n / kChunks, 1, kLargestChunk); }

}  // namespace

Result<ClippedSurface> clip_surface(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram,
                                    int threads, const Progress& progress) {
    const PointGrid grid(sites);
    const size_t n = mesh.triangles.size(), chunk = chunk_size(n);
    std::vector<ClippedSurface> parts((n + chunk - 1) / chunk);
    const bool whole =
        for_chunks(n, chunk, threads, progress, "cutting the surface", [&](size_t k, size_t begin, size_t end) {
            Clipper clipper(mesh, sites, diagram);
            for (size_t t = begin; t < end; ++t) {
                const Vec3& p = mesh.positions[mesh.triangles[t][0]];
                clipper.clip(uint32_t(t), clipper.locate(p, grid.nearest(p)));
            }
            parts[k] = std::move(clipper.out);
        });
    if (!whole) return cancelled();
    ClippedSurface all;
    for (const ClippedSurface& part : parts) {
        const auto shift = static_cast<uint32_t>(all.side.size());
        for (const SurfacePolygon& p : part.polygons)
            all.polygons.push_back({p.triangle, p.cell, p.begin + shift, p.end + shift});
        all.side.insert(all.side.end(), part.side.begin(), part.side.end());
        all.count += part.count;
    }
    return all;
}

}  // namespace sunder
