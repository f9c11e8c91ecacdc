#include "fracture_tools/mesh/sharp_edges.h"

#include <algorithm>
#include <numbers>
#include <tuple>
#include <vector>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kVisible = 15, kSharp = 40;  // degrees
constexpr double kAlone = 0.5;                // length of visible edges against that of sharp ones
constexpr double kLong = 2;                   // cells
/// Less sharp length than this share of the box's diagonal is a flaw of the mesh (folded slivers), not its design.
constexpr double kLeastLength = 0.5;

struct EdgeLengths {
    double sharp = 0, visible = 0;  // above kSharp; between kVisible and kSharp, m
    size_t n = 0;                   // of both

    void add(double angle, double length) {
        if (angle <= kVisible) return;
        (angle > kSharp ? sharp : visible) += length;
        ++n;
    }
};

EdgeLengths measure_edges(const MeshView& mesh) {
    struct Side {
        uint32_t low, high, triangle;
    };
    std::vector<Side> sides;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const auto [low, high] = std::minmax(mesh.triangles[t][c], mesh.triangles[t][(c + 1) % 3]);
            sides.push_back({low, high, t});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.triangle) < std::tie(y.low, y.high, y.triangle);
    });
    auto normal = [&](uint32_t t) {
        const auto& [a, b, c] = mesh.triangles[t];
        return Vec3((mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]));
    };
    EdgeLengths lengths;
    for (size_t i = 0; i + 1 < sides.size(); ++i) {
        if (sides[i].low != sides[i + 1].low || sides[i].high != sides[i + 1].high) continue;
        const Vec3 p = normal(sides[i].triangle), q = normal(sides[i + 1].triangle);
        const double angle = math::atan2(p.cross(q).norm(), p.dot(q)) * 180 / std::numbers::pi;
        lengths.add(angle, (mesh.positions[sides[i].high] - mesh.positions[sides[i].low]).norm());
    }
    return lengths;
}

}  // namespace

double choose_sharp_angle(const MeshView& mesh, double cell_size) {
    const EdgeLengths edges = measure_edges(mesh);
    Aabb box;
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) box.extend(mesh.positions[v]);
    if (edges.sharp + edges.visible < kLeastLength * box.diagonal()) return 0;
    if ((edges.sharp + edges.visible) / double(edges.n) > kLong * cell_size) return kVisible;
    return edges.sharp >= kLeastLength * box.diagonal() && edges.visible <= kAlone * edges.sharp ? kSharp : 0;
}

}  // namespace sunder
