// One fragment as a mesh of its own, and the check of all of them (prefracture.h).
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>

#include "fracture_tools/fragments/fragment_faces.h"
#include "fracture_tools/fragments/outer_layers.h"
#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/corner_normals.h"
#include "fracture_tools/mesh/counting_sort.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_rows.h"
#include "fracture_tools/mesh/parallel_chunks.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr size_t kFragmentsAChunk = 64;

/// A side of a triangle, from corner `corner` to the next one of its triangle.
struct Side {
    uint32_t low, high, corner;
    bool ascends;
};

template <class Vector>
Vector between(const Vector& a, const Vector& b) {
    return (a + b) / 2;
}
Color between(const Color& a, const Color& b) {
    return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2, (a[3] + b[3]) / 2};
}

uint32_t next_corner(uint32_t corner) { return corner - corner % 3 + (corner + 1) % 3; }
uint32_t last_corner(uint32_t corner) { return corner - corner % 3 + (corner + 2) % 3; }

std::vector<Side> sorted_sides(const std::vector<Triangle>& triangles) {
    std::vector<Side> sides;
    for (uint32_t k = 0; k < 3 * triangles.size(); ++k) {
        const uint32_t a = triangles[k / 3][k % 3], b = triangles[k / 3][next_corner(k) % 3];
        sides.push_back({std::min(a, b), std::max(a, b), k, a < b});
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.corner) < std::tie(y.low, y.high, y.corner);
    });
    return sides;
}

/// Pairs the sides of one edge so that each pair encloses a wedge of the solid. Seen along the edge from low to high,
/// with angles counter-clockwise, a descending side has the solid after it, an ascending one before it:
///
///      \ solid /            Two wedges meet in the edge (o): their sides are paired as brackets are,
///       d     a             d ( ... a ), going round.
///          o
void pair_around_edge(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                      std::span<const Side> sides, std::vector<std::pair<uint32_t, uint32_t>>& out) {
    if (sides.size() == 2) {
        out.emplace_back(sides[0].corner, sides[1].corner);
        return;
    }
    const Vec3 along = (positions[sides[0].high] - positions[sides[0].low]).normalized();
    auto to_third = [&](const Side& s) {
        const uint32_t third = last_corner(s.corner);
        return Vec3(positions[triangles[third / 3][third % 3]] - positions[s.low]);
    };
    const Vec3 u = (to_third(sides[0]) - along * along.dot(to_third(sides[0]))).normalized(), v = along.cross(u);
    std::vector<std::pair<double, const Side*>> around;
    for (const Side& s : sides) around.emplace_back(math::atan2(to_third(s).dot(v), to_third(s).dot(u)), &s);
    std::stable_sort(around.begin(), around.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    std::vector<const Side*> open;
    for (size_t round = 0; round < 2; ++round)  // what opens before the start of the circle closes in the second round
        for (auto& [angle, side] : around) {
            if (!side) continue;
            if (!side->ascends) {
                if (round == 0) open.push_back(side);
            } else if (!open.empty()) {
                out.emplace_back(open.back()->corner, side->corner);
                open.pop_back();
                side = nullptr;
            }
        }
}

/// Vertices come apart where the surface only touches itself: corners share one exactly when they hang together by
/// paired sides.
void part_pinches(TriMesh& io_mesh) {
    const std::vector<Side> sides = sorted_sides(io_mesh.triangles);
    std::vector<std::pair<uint32_t, uint32_t>> pairs;
    bool has_crowded_edge = false;
    for (size_t i = 0, j; i < sides.size(); i = j) {
        for (j = i; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;) ++j;
        has_crowded_edge |= j - i > 2;
        if (j - i > 1) pair_around_edge(io_mesh.positions, io_mesh.triangles, {&sides[i], j - i}, pairs);
    }
    std::vector<uint32_t> fan = disjoint_sets(3 * io_mesh.triangles.size());
    for (const auto& [p, q] : pairs) {
        unite(fan, p, next_corner(q));
        unite(fan, next_corner(p), q);
    }
    std::vector<Vec3> positions;
    std::vector<uint32_t> number(fan.size());
    for (uint32_t c = 0; c < fan.size(); ++c) {
        uint32_t& vertex = io_mesh.triangles[c / 3][c % 3];
        if (lowest(fan, c) == c) {
            number[c] = static_cast<uint32_t>(positions.size());
            positions.push_back(io_mesh.positions[vertex]);
        }
        vertex = number[lowest(fan, c)];
    }
    io_mesh.positions = std::move(positions);
    if (!has_crowded_edge) return;

    // Both ends of a parted edge may still be one vertex each, where the surface goes round. A vertex in the middle of
    // all but one of the pairs then tells the edges apart.
    auto edge_of = [&](const std::pair<uint32_t, uint32_t>& pair) {
        const uint32_t a = io_mesh.triangles[pair.first / 3][pair.first % 3];
        const uint32_t b = io_mesh.triangles[pair.first / 3][next_corner(pair.first) % 3];
        return std::pair(std::min(a, b), std::max(a, b));
    };
    std::stable_sort(pairs.begin(), pairs.end(), [&](const auto& x, const auto& y) { return edge_of(x) < edge_of(y); });
    std::vector<std::pair<uint32_t, uint32_t>> doubled;
    for (size_t i = 1; i < pairs.size(); ++i)
        if (edge_of(pairs[i]) == edge_of(pairs[i - 1])) doubled.push_back(pairs[i]);
    // corner -> vertex in the middle of the side that begins there
    std::vector<std::pair<uint32_t, uint32_t>> middle;
    for (const auto& [p, q] : doubled) {
        const Vec3 &a = io_mesh.positions[io_mesh.triangles[p / 3][p % 3]],
                   &b = io_mesh.positions[io_mesh.triangles[q / 3][q % 3]];
        middle.emplace_back(p, static_cast<uint32_t>(io_mesh.positions.size()));
        middle.emplace_back(q, static_cast<uint32_t>(io_mesh.positions.size()));
        io_mesh.positions.push_back(0.5 * (a + b));
    }
    std::sort(middle.begin(), middle.end());
    auto split_at = [&](uint32_t corner, uint32_t vertex) {  // (a b c), side a-b: (a m c) stays, (m b c) is new
        const uint32_t t = corner / 3, a = corner % 3, b = (a + 1) % 3;
        Triangle added = io_mesh.triangles[t];
        added[a] = vertex;
        io_mesh.triangles[t][b] = vertex;
        io_mesh.triangles.push_back(added);
        for_triangle_lists(io_mesh, [&](auto& io_values, size_t n) { append_row(io_values, n, t); });
        auto split_corners = [&](auto& io_values, size_t n, bool is_blended) {
            if (io_values.empty()) return;
            const size_t first = io_values.size();
            for (uint32_t c = 0; c < 3; ++c) append_row(io_values, n, 3 * t + c);
            for (size_t k = 0; k < n; ++k) {
                auto half = io_values[(3 * t + a) * n + k];
                if (is_blended) half = between(half, io_values[(3 * t + b) * n + k]);
                io_values[first + a * n + k] = half;
                io_values[(3 * t + b) * n + k] = half;
            }
        };
        split_corners(io_mesh.corner_uvs, 1, true);
        split_corners(io_mesh.corner_normals, 1, true);
        split_corners(io_mesh.corner_colors, 1, true);
        for (MeshLayer& layer : io_mesh.layers)
            if (layer.domain == LayerDomain::corner) split_corners(layer.values, layer.width, layer.is_blended());
        return static_cast<uint32_t>(io_mesh.triangles.size() - 1);
    };
    for (size_t i = 0, j; i < middle.size(); i = j) {
        // Sides of one triangle ascend by corner: after side a-b was cut at m, side b-c belongs to (m b c), side c-a to
        // (a m c).
        uint32_t at[3] = {middle[i].first / 3, middle[i].first / 3, middle[i].first / 3};
        for (j = i; j < middle.size() && middle[j].first / 3 == middle[i].first / 3; ++j) {
            const uint32_t c = middle[j].first % 3;
            const uint32_t added = split_at(3 * at[c] + c, middle[j].second);
            if (at[(c + 1) % 3] == at[c]) at[(c + 1) % 3] = added;
        }
    }
}

/// Gives triangles of the set's vertices the vertices that they use, once for each fan where they only touch.
void take_vertices(const FragmentSet& set, TriMesh& io_mesh) {
    std::vector<uint32_t> used;
    for (const Triangle& t : io_mesh.triangles) used.insert(used.end(), t.begin(), t.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (uint32_t v : used) io_mesh.positions.push_back(set.vertices[v]);
    for (Triangle& t : io_mesh.triangles)
        for (uint32_t& v : t) v = static_cast<uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
    part_pinches(io_mesh);
}

/// Adds a triangle of the set to the mesh; `corner` are entries of the attribute arrays.
struct PieceBuilder {
    const FragmentSet& set;
    bool has_uvs, has_normals;
    TriMesh mesh;

    explicit PieceBuilder(const FragmentSet& s)
        : set(s),
          has_uvs(!s.outer_corner_uvs.empty() || !s.interface_corner_uvs.empty()),
          has_normals(!s.outer_corner_normals.empty()) {
        mesh.material_names = s.material_names;
        mesh.layers = empty_layers(s.outer_layers);
        for (MeshLayer& layer : mesh.layers)  // by corner until the vertices are known
            if (layer.domain == LayerDomain::point) layer.domain = LayerDomain::corner;
        if (mesh.material_names.size() == size_t(s.interior_material)) mesh.material_names.push_back("interior");
    }

    void add(const Triangle& t, const std::array<uint32_t, 3>& corner, bool is_outer, int32_t material) {
        mesh.triangles.push_back(t);
        mesh.triangle_material.push_back(material);
        const auto& uvs = is_outer ? set.outer_corner_uvs : set.interface_corner_uvs;
        const Vec3f own = (set.vertices[t[1]] - set.vertices[t[0]])
                              .cross(set.vertices[t[2]] - set.vertices[t[0]])
                              .normalized()
                              .cast<float>();
        for (uint32_t c : corner) {
            if (has_uvs) mesh.corner_uvs.push_back(uvs.empty() ? Vec2f(0, 0) : uvs[c]);
            if (has_normals) mesh.corner_normals.push_back(is_outer ? set.outer_corner_normals[c] : own);
            if (!set.outer_corner_colors.empty())
                mesh.corner_colors.push_back(is_outer ? set.outer_corner_colors[c] : Color{1, 1, 1, 1});
        }
        for (size_t k = 0; k < mesh.layers.size(); ++k) {
            const MeshLayer& from = set.outer_layers[k];
            std::vector<float>& to = mesh.layers[k].values;
            const bool is_of_face = from.domain == LayerDomain::face;
            for (size_t i = 0; i < (is_of_face ? 1 : 3); ++i) {
                const LayerRow row =
                    is_outer ? row_of(from, is_of_face ? corner[0] / 3 : corner[i]) : row_inside(set, from, corner[i]);
                to.insert(to.end(), row.begin(), row.begin() + from.width);
            }
        }
    }
    void add_outer(uint32_t t) {
        add(set.outer_triangles[t], {3 * t, 3 * t + 1, 3 * t + 2}, true, set.outer_material[t]);
    }
    void add_interface(uint32_t t, bool as_a) {
        const auto& [p, q, r] = set.interface_triangles[t];
        if (as_a)
            add({p, q, r}, {3 * t, 3 * t + 1, 3 * t + 2}, false, set.interior_material);
        else
            add({p, r, q}, {3 * t, 3 * t + 2, 3 * t + 1}, false, set.interior_material);
    }

    /// Break surfaces, all triangles from `first` on, get the normals that the set's smooth angle gives them.
    void smooth_interior(uint32_t first) {
        if (!has_normals) return;
        const MeshView interior(set.vertices, std::span(mesh.triangles).subspan(first));
        const std::vector<Vec3f> normals = smooth_corner_normals(interior, set.interior_smooth_angle);
        std::copy(normals.begin(), normals.end(), mesh.corner_normals.begin() + 3 * std::ptrdiff_t{first});
    }

    /// A vertex has what the first outer triangle with it has there.
    void gather_points(MeshLayer& io_layer) const {
        io_layer.domain = LayerDomain::point;
        const MeshLayer of_corners = std::move(io_layer);
        io_layer = MeshLayer(static_cast<const LayerId&>(of_corners));
        io_layer.values.assign(mesh.positions.size() * io_layer.width, io_layer.inside());
        for (size_t c = 3 * mesh.triangles.size(); c-- > 0;)
            if (mesh.triangle_material[c / 3] != set.interior_material)
                std::copy_n(of_corners.row(c), io_layer.width,
                            io_layer.values.data() + mesh.triangles[c / 3][c % 3] * io_layer.width);
    }

    TriMesh finish() {
        take_vertices(set, mesh);
        for (size_t k = 0; k < mesh.layers.size(); ++k)
            if (set.outer_layers[k].domain == LayerDomain::point) gather_points(mesh.layers[k]);
        return std::move(mesh);
    }
};

Error bad_fragment(size_t i, std::string what) {
    return {ErrorCode::internal,
            std::move(what),
            "fragment " + std::to_string(i),
            "another seed or number of pieces may do",
            {},
            {}};
}

Status check_fragment(const FragmentSet& set, const FragmentFaces& faces, std::span<const uint32_t> own, size_t i) {
    const Fragment& f = set.fragments[i];
    if (!(f.volume > 0) || !(f.radii.minCoeff() > 0)) return bad_fragment(i, "the fragment has no volume");
    TriMesh mesh;
    for (uint32_t k : own) mesh.triangles.push_back(faces.triangles[k]);
    mesh.triangle_material.resize(own.size());
    take_vertices(set, mesh);
    const MeshReport report = check_mesh(mesh);
    if (!report.is_solid())
        return bad_fragment(
            i, "the fragment is not closed: " + (report.faults.empty() ? "no volume" : report.faults.front()));
    if (std::abs(report.volume - f.volume) > kMeasureError * f.volume)
        return bad_fragment(i, "the fragment's volume is not that of its surface");
    return {};
}

}  // namespace

FragmentMeshes::FragmentMeshes(const FragmentSet& set) : set_(set), begin_(set.fragments.size() + 1, 0) {
    for (const Interface& face : set.interfaces) ++begin_[face.a.index() + 1], ++begin_[face.b.index() + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    interface_.resize(begin_.back());
    std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (uint32_t k = 0; k < set.interfaces.size(); ++k)
        for (const FragmentId side : {set.interfaces[k].a, set.interfaces[k].b}) interface_[next[side.index()]++] = k;
}

TriMesh FragmentMeshes::mesh(FragmentId fragment) const {
    PieceBuilder piece(set_);
    const Fragment& f = set_.fragments[fragment.index()];
    for (uint32_t t = f.outer_begin; t < f.outer_end; ++t) piece.add_outer(t);
    for (uint32_t k = begin_[fragment.index()]; k < begin_[fragment.index() + 1]; ++k) {
        const Interface& face = set_.interfaces[interface_[k]];
        for (uint32_t t = face.triangle_begin; t < face.triangle_end; ++t) piece.add_interface(t, face.a == fragment);
    }
    piece.smooth_interior(f.outer_end - f.outer_begin);
    return piece.finish();
}

TriMesh fragment_mesh(const FragmentSet& set, FragmentId fragment) { return FragmentMeshes(set).mesh(fragment); }

Status check_fragments(const FragmentSet& set, int threads) {
    const Result<FragmentFaces> faces = make_fragment_faces(set);
    if (!faces) return faces.error();
    const size_t n = set.fragments.size();
    const Groups faces_of = group_by(faces->n_faces(), uint32_t(n), [&](uint32_t k) { return faces->fragment[k]; });
    std::vector<Status> found((n + kFragmentsAChunk - 1) / kFragmentsAChunk);
    for_chunks(n, kFragmentsAChunk, threads, {}, "", [&](size_t chunk, size_t begin, size_t end) {
        for (size_t i = begin; i < end && found[chunk]; ++i)
            found[chunk] = check_fragment(set, *faces, faces_of[uint32_t(i)], i);
    });
    for (const Status& s : found)
        if (!s) return s;
    double sum = 0;
    for (const Fragment& f : set.fragments) sum += f.volume;
    if (set.source_volume > 0 && std::abs(sum - set.source_volume) > kMaxVolumeError * set.source_volume)
        return Error{
            ErrorCode::internal,
            "the fragments have " + std::to_string(100 * sum / set.source_volume) + " % of the volume that was cut",
            "fragments",
            "use more cells per piece",
            {},
            {}};
    return {};
}

}  // namespace sunder
