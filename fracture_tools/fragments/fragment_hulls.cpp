#include "fracture_tools/fragments/fragment_hulls.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fracture_tools/fragments/fragment_triangles.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr int kDirections = 128;

// Spread evenly over the sphere along a spiral.
Vec3 direction(int k) {
    const double z = 1 - (2.0 * k + 1) / kDirections, radius = std::sqrt(1 - z * z);
    const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const auto [sine, cosine] = math::sincos(angle);
    return {radius * cosine, radius * sine, z};
}

}  // namespace

void find_hulls(const FragmentSet& set, SimulationMesh& io_mesh) {
    std::vector<Vec3> directions(kDirections);
    for (int k = 0; k < kDirections; ++k) directions[k] = direction(k);

    std::vector<std::vector<uint32_t>> vertices(set.fragments.size());
    const auto take = [&](size_t f, const Triangle& t) { vertices[f].insert(vertices[f].end(), t.begin(), t.end()); };
    for_each_fragment_triangle(set, take);

    io_mesh.hull_offset.assign(1, 0);
    io_mesh.hull_point.clear();
    for (size_t f = 0; f < vertices.size(); ++f) {
        std::vector<uint32_t>& own = vertices[f];
        std::ranges::sort(own);
        own.erase(std::ranges::unique(own).begin(), own.end());
        const auto place = [&](uint32_t v) -> Vec3 { return set.vertices[v] - io_mesh.rest_position[f]; };
        std::vector<uint32_t> outermost;
        for (const Vec3& d : directions) {
            const auto along = [&](uint32_t v) { return d.dot(place(v)); };
            if (!own.empty()) outermost.push_back(*std::ranges::max_element(own, {}, along));
        }
        std::ranges::sort(outermost);
        outermost.erase(std::ranges::unique(outermost).begin(), outermost.end());
        for (uint32_t v : outermost) io_mesh.hull_point.push_back(place(v).cast<float>());
        io_mesh.hull_offset.push_back(static_cast<uint32_t>(io_mesh.hull_point.size()));
    }
}

}  // namespace sunder
