// Finer triangles on break surfaces (interior.h: refine_interfaces).
#include <algorithm>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "fracture_tools/fragments/interior.h"
#include "fracture_tools/mesh/mesh_rows.h"

namespace sunder {
namespace {

/// Each pass halves the edges that are too long, those of borders first; more would be a thousandth of the longest.
constexpr int kMostPasses = 24;
constexpr int kMostSweeps = 8;
/// Edges between triangles that meet at less than this stay where they are.
constexpr double kFlatCosine = 0.999;
/// Sum of the cotangents opposite of an edge below which it is turned; 0 would be Delaunay to rounding.
constexpr double kTurnBelow = -1e-6;

uint64_t edge_key(uint32_t v, uint32_t w) { return (uint64_t{std::min(v, w)} << 32) | std::max(v, w); }

/// New vertices on edges, by the ends of the edge.
using Middles = std::unordered_map<uint64_t, uint32_t>;  // looked up only: its order has no effect

struct PartCorner {
    uint32_t vertex;
    Vec3 weight;  // of the corners of the triangle that it is a part of
};
using Part = std::array<PartCorner, 3>;

/// Cuts a triangle at the middles of its sides, the longest side first.
void cut_at_middles(const std::vector<Vec3>& points, const Middles& middles, const Part& whole,
                    std::vector<Part>& out) {
    int side = -1;
    double longest = 0;
    for (int c = 0; c < 3; ++c) {
        const uint32_t v = whole[c].vertex, w = whole[(c + 1) % 3].vertex;
        if (!middles.contains(edge_key(v, w))) continue;
        if (const double length = (points[w] - points[v]).squaredNorm(); side < 0 || length > longest)
            longest = length, side = c;
    }
    if (side < 0) return out.push_back(whole);
    const PartCorner &a = whole[side], &b = whole[(side + 1) % 3], &c = whole[(side + 2) % 3];
    const PartCorner m{middles.at(edge_key(a.vertex, b.vertex)), 0.5 * (a.weight + b.weight)};
    cut_at_middles(points, middles, {a, m, c}, out);
    cut_at_middles(points, middles, {m, b, c}, out);
}

/// Ends of the edges of interfaces that are too long, ascending: of their borders as long as there are any. (In a strip
/// narrower than `longest` they are all; with the edges across it cut as well it would fill with ever smaller
/// triangles.)
std::vector<uint64_t> long_edges(double longest, const FragmentSet& set) {
    auto is_long = [&](uint64_t e) {
        return (set.vertices[e >> 32] - set.vertices[e & 0xffffffffu]).squaredNorm() > longest * longest;
    };
    std::vector<uint64_t> border, within, edges;
    for (const Interface& i : set.interfaces) {
        edges.clear();
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t)
            for (int c = 0; c < 3; ++c)
                edges.push_back(edge_key(set.interface_triangles[t][c], set.interface_triangles[t][(c + 1) % 3]));
        std::sort(edges.begin(), edges.end());
        for (size_t first = 0, last; first < edges.size(); first = last) {
            for (last = first; last < edges.size() && edges[last] == edges[first];) ++last;
            if (is_long(edges[first])) (last - first == 1 ? border : within).push_back(edges[first]);
        }
    }
    std::vector<uint64_t>& out = border.empty() ? within : border;
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return std::move(out);
}

/// New vertices in the middle of the interface edges that are to be split.
Middles split_long_edges(double longest, FragmentSet& io_set) {
    Middles middles;
    for (uint64_t e : long_edges(longest, io_set)) {
        middles.emplace(e, static_cast<uint32_t>(io_set.vertices.size()));
        io_set.vertices.push_back(0.5 * (io_set.vertices[e >> 32] + io_set.vertices[e & 0xffffffffu]));
    }
    return middles;
}

Part whole_triangle(const Triangle& t) {
    return {PartCorner{t[0], Vec3::UnitX()}, PartCorner{t[1], Vec3::UnitY()}, PartCorner{t[2], Vec3::UnitZ()}};
}

/// Numbers between those of the three corners of a triangle, row after row.
void mix(const float* rows, size_t n, const Eigen::Vector3f& w, float* out) {
    for (size_t k = 0; k < n; ++k) out[k] = w[0] * rows[k] + w[1] * rows[n + k] + w[2] * rows[2 * n + k];
}

template <class T>
T mixed(const T* corners, const Eigen::Vector3f& w) {
    T out;
    mix(corners->data(), sizeof(T) / sizeof(float), w, out.data());
    return out;
}

/// What a part of triangle t has of a layer.
void append_part(const MeshLayer& layer, uint32_t t, const Part& part, MeshLayer& io_layer) {
    std::array<float, LayerId::kWidest> row;
    const size_t n = layer.width;
    for (size_t c = 0; c < (layer.domain == LayerDomain::face ? 1 : 3); ++c) {
        if (layer.domain == LayerDomain::face)
            std::copy_n(layer.row(t), n, row.begin());
        else if (layer.is_blended())
            mix(layer.row(3 * t), n, part[c].weight.cast<float>(), row.data());
        else
            std::copy_n(layer.row(3 * t + nearest_corner(part[c].weight)), n, row.begin());
        io_layer.values.insert(io_layer.values.end(), row.begin(), row.begin() + n);
    }
}

/// The outer surface with vertices where interfaces have them, and all that its corners have.
void cut_outer(const Middles& middles, FragmentSet& io_set) {
    const std::vector<Triangle> triangles = std::move(io_set.outer_triangles);
    const std::vector<int32_t> material = std::move(io_set.outer_material);
    const std::vector<Vec2f> uvs = std::move(io_set.outer_corner_uvs);
    const std::vector<Vec3f> normals = std::move(io_set.outer_corner_normals);
    const std::vector<Color> colors = std::move(io_set.outer_corner_colors);
    const std::vector<MeshLayer> layers = std::move(io_set.outer_layers);
    io_set.outer_triangles.clear(), io_set.outer_material.clear(), io_set.outer_corner_uvs.clear();
    io_set.outer_corner_normals.clear(), io_set.outer_corner_colors.clear();
    io_set.outer_layers = empty_layers(layers);

    std::vector<Part> parts;
    for (Fragment& f : io_set.fragments) {
        const uint32_t begin = f.outer_begin, end = f.outer_end;
        f.outer_begin = static_cast<uint32_t>(io_set.outer_triangles.size());
        for (uint32_t t = begin; t < end; ++t) {
            parts.clear();
            cut_at_middles(io_set.vertices, middles, whole_triangle(triangles[t]), parts);
            for (const Part& p : parts) {
                io_set.outer_triangles.push_back({p[0].vertex, p[1].vertex, p[2].vertex});
                io_set.outer_material.push_back(material[t]);
                for (size_t k = 0; k < layers.size(); ++k) append_part(layers[k], t, p, io_set.outer_layers[k]);
                for (const PartCorner& corner : p) {
                    const Eigen::Vector3f w = corner.weight.cast<float>();
                    const uint32_t c = 3 * t;
                    if (!uvs.empty()) io_set.outer_corner_uvs.push_back(mixed(&uvs[c], w));
                    if (!normals.empty()) {
                        const Vec3f n = w[0] * normals[c] + w[1] * normals[c + 1] + w[2] * normals[c + 2];
                        io_set.outer_corner_normals.push_back(w.maxCoeff() == 1 ? n : n.normalized());
                    }
                    if (!colors.empty()) io_set.outer_corner_colors.push_back(mixed(&colors[c], w));
                }
            }
        }
        f.outer_end = static_cast<uint32_t>(io_set.outer_triangles.size());
    }
}

void cut_interfaces(const Middles& middles, FragmentSet& io_set) {
    const std::vector<Triangle> triangles = std::move(io_set.interface_triangles);
    io_set.interface_triangles.clear();
    std::vector<Part> parts;
    for (Interface& i : io_set.interfaces) {
        parts.clear();
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t)
            cut_at_middles(io_set.vertices, middles, whole_triangle(triangles[t]), parts);
        i.triangle_begin = static_cast<uint32_t>(io_set.interface_triangles.size());
        for (const Part& p : parts) io_set.interface_triangles.push_back({p[0].vertex, p[1].vertex, p[2].vertex});
        i.triangle_end = static_cast<uint32_t>(io_set.interface_triangles.size());
    }
}

double cotangent(const Vec3& at, const Vec3& b, const Vec3& c) {
    const double area = (b - at).cross(c - at).norm();
    return (b - at).dot(c - at) / std::max(area, 1e-300);
}

/// Turns edges within an interface (Lawson 1977): of the two diagonals of a flat quadrangle
///
///        d             the one with the smaller angles opposite of it; never onto an edge
///     a --- b          that is there already.
///        c
class EdgeTurner {
public:
    EdgeTurner(const std::vector<Vec3>& points, std::unordered_set<uint64_t>& io_edges)
        : points_(points), edges_(io_edges) {}

    void turn(std::span<Triangle> io_triangles) {
        for (int sweep = 0; sweep < kMostSweeps; ++sweep)
            if (!turn_once(io_triangles)) return;
    }

private:
    struct Side {
        uint64_t edge;
        uint32_t triangle, corner;
    };

    bool turn_once(std::span<Triangle> io_triangles) {
        sides_.clear();
        for (uint32_t t = 0; t < io_triangles.size(); ++t)
            for (uint32_t c = 0; c < 3; ++c)
                sides_.push_back({edge_key(io_triangles[t][c], io_triangles[t][(c + 1) % 3]), t, c});
        std::sort(sides_.begin(), sides_.end(), [](const Side& x, const Side& y) {
            return std::pair(x.edge, x.triangle) < std::pair(y.edge, y.triangle);
        });
        touched_.assign(io_triangles.size(), 0);
        bool any = false;
        for (size_t i = 0, j; i < sides_.size(); i = j) {
            for (j = i; j < sides_.size() && sides_[j].edge == sides_[i].edge;) ++j;
            const Side &x = sides_[i], &y = sides_[j - 1];
            if (j - i != 2 || touched_[x.triangle] || touched_[y.triangle]) continue;
            if (!turn_side(io_triangles[x.triangle], x.corner, io_triangles[y.triangle], y.corner)) continue;
            touched_[x.triangle] = touched_[y.triangle] = 1;
            any = true;
        }
        return any;
    }

    bool turn_side(Triangle& io_x, uint32_t corner_x, Triangle& io_y, uint32_t corner_y) {
        const uint32_t a = io_x[corner_x], b = io_x[(corner_x + 1) % 3], d = io_x[(corner_x + 2) % 3],
                       c = io_y[(corner_y + 2) % 3];
        if (io_y[corner_y] != b || c == d) return false;
        const Vec3 &pa = points_[a], &pb = points_[b], &pc = points_[c], &pd = points_[d];
        if (!(cotangent(pd, pa, pb) + cotangent(pc, pa, pb) < kTurnBelow)) return false;
        const Vec3 n = (pb - pa).cross(pd - pa), m = (pa - pb).cross(pc - pb), sum = n + m;
        const Vec3 first = (pc - pa).cross(pd - pa), second = (pb - pc).cross(pd - pc);  // of a c d and c b d
        // Slivers have no normal to speak of: they go by the whole quadrangle's.
        const double least = 1e-3 * sum.norm();
        if (n.norm() > least && m.norm() > least && n.dot(m) < kFlatCosine * n.norm() * m.norm()) return false;
        if (!(first.dot(sum) > 1e-6 * sum.squaredNorm() && second.dot(sum) > 1e-6 * sum.squaredNorm())) return false;
        if (!edges_.insert(edge_key(c, d)).second) return false;
        edges_.erase(edge_key(a, b));
        io_x = {a, c, d};
        io_y = {c, b, d};
        return true;
    }

    const std::vector<Vec3>& points_;
    std::unordered_set<uint64_t>& edges_;  // looked up only
    std::vector<Side> sides_;
    std::vector<uint8_t> touched_;
};

void turn_edges(FragmentSet& io_set) {
    std::unordered_set<uint64_t> edges;
    for (const auto* triangles : {&io_set.outer_triangles, &io_set.interface_triangles})
        for (const Triangle& t : *triangles)
            for (int c = 0; c < 3; ++c) edges.insert(edge_key(t[c], t[(c + 1) % 3]));
    EdgeTurner turner(io_set.vertices, edges);
    for (const Interface& i : io_set.interfaces)
        turner.turn(std::span(io_set.interface_triangles).subspan(i.triangle_begin, i.triangle_end - i.triangle_begin));
}

}  // namespace

Status refine_interfaces(double longest, const Progress& progress, FragmentSet& io_set) {
    for (int pass = 0; pass < kMostPasses; ++pass) {
        if (!progress.report(0, "making break surfaces finer")) return cancelled();
        const Middles middles = split_long_edges(longest, io_set);
        if (middles.empty()) return {};
        cut_outer(middles, io_set);
        cut_interfaces(middles, io_set);
        turn_edges(io_set);
    }
    return {};
}

}  // namespace sunder
