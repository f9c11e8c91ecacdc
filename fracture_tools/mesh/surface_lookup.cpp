#include "fracture_tools/mesh/surface_lookup.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace sunder {
namespace {

constexpr uint32_t kLeafSize = 4;

double squared_distance(const Aabb& box, const Vec3& p) {
    return (box.min - p).cwiseMax(p - box.max).cwiseMax(0).squaredNorm();
}

/// Share of the way from a to b that is nearest to p, in [0, 1].
double nearest_share(const Vec3& p, const Vec3& a, const Vec3& b) {
    const double length = (b - a).squaredNorm();
    return length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0.0;
}

}  // namespace

SurfacePoint nearest_on_triangle(const Vec3& query, const Vec3& a, const Vec3& b, const Vec3& c) {
    const std::array<Vec3, 3> corner = {a, b, c};
    SurfacePoint best;
    best.distance = std::numeric_limits<double>::infinity();
    auto offer = [&](const Vec3& weights) {
        const Vec3 p = weights[0] * a + weights[1] * b + weights[2] * c;
        const double d = (p - query).norm();
        if (d < best.distance) best = {0, weights, p, d};
    };
    // Inside the triangle's prism the foot of the perpendicular is nearest, else a point of the border.
    const Vec3 n = (b - a).cross(c - a);
    if (const double nn = n.squaredNorm(); nn > 0) {
        const double v = (query - a).cross(c - a).dot(n) / nn, w = (b - a).cross(query - a).dot(n) / nn;
        if (v >= 0 && w >= 0 && v + w <= 1) offer(Vec3(1 - v - w, v, w));
    }
    if (best.distance == std::numeric_limits<double>::infinity())
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            const double s = nearest_share(query, corner[k], corner[next]);
            Vec3 weights = Vec3::Zero();
            weights[k] = 1 - s;
            weights[next] = s;
            offer(weights);
        }
    return best;
}

SurfaceLookup::SurfaceLookup(MeshView mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (const Triangle& t : mesh.triangles)
        middle_.push_back((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3);
    nodes_.push_back({{}, 0, static_cast<uint32_t>(order_.size()), 0});
    build(0);
}

void SurfaceLookup::build(uint32_t node) {
    const uint32_t begin = nodes_[node].begin, end = nodes_[node].end;
    Aabb box, middles;
    for (uint32_t k = begin; k < end; ++k) {
        for (uint32_t v : mesh_.triangles[order_[k]]) box.extend(mesh_.positions[v]);
        middles.extend(middle_[order_[k]]);
    }
    nodes_[node].box = box;
    if (end - begin <= kLeafSize) return;
    int axis = 0;
    (middles.max - middles.min).maxCoeff(&axis);
    const uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end, [&](uint32_t x, uint32_t y) {
        return std::pair(middle_[x][axis], x) < std::pair(middle_[y][axis], y);
    });
    const auto left = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({{}, begin, half, 0});
    build(left);
    const auto right = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({{}, half, end, 0});
    nodes_[node].right = right;
    build(right);
}

SurfacePoint SurfaceLookup::nearest(const Vec3& query) const {
    SurfacePoint best;
    best.distance = std::numeric_limits<double>::infinity();
    std::array<uint32_t, 96> stack;  // halving 2^32 triangles is 32 levels deep
    size_t depth = 0;
    // The left child of a node follows it when it is built: node + 1.
    if (!order_.empty()) stack[depth++] = 0;
    while (depth > 0) {
        const uint32_t index = stack[--depth];
        const Node& node = nodes_[index];
        if (squared_distance(node.box, query) > best.distance * best.distance) continue;
        if (node.right != 0) {
            uint32_t near = index + 1, far = node.right;
            if (squared_distance(nodes_[far].box, query) < squared_distance(nodes_[near].box, query))
                std::swap(near, far);
            stack[depth++] = far;
            stack[depth++] = near;
            continue;
        }
        for (uint32_t k = node.begin; k < node.end; ++k) {
            const uint32_t t = order_[k];
            const auto& [a, b, c] = mesh_.triangles[t];
            SurfacePoint p = nearest_on_triangle(query, mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]);
            p.triangle = t;
            if (p.distance < best.distance || (p.distance == best.distance && t < best.triangle)) best = p;
        }
    }
    return best;
}

}  // namespace sunder
