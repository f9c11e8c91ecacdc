// Large meshes out of small ones.
#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// The same surface with each triangle split in four, `times` over; positions and triangles only.
inline TriMesh finer_mesh(TriMesh mesh, int times) {
    for (int k = 0; k < times; ++k) {
        TriMesh fine;
        fine.positions = mesh.positions;
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.positions.size()));
            if (is_new) fine.positions.push_back(0.5 * (mesh.positions[a] + mesh.positions[b]));
            return at->second;
        };
        for (const Triangle& t : mesh.triangles) {
            const uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
            for (const Triangle& part : {Triangle{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}})
                fine.triangles.push_back(part);
        }
        mesh = std::move(fine);
    }
    return mesh;
}

}  // namespace sunder
