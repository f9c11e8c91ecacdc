// Bodies for tests of the deformer: boxes of tetrahedra, cut by any labelling of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "solver/data/fragment_set.h"
#include "solver/data/simulation_mesh.h"

namespace sunder::testing {

struct TetBox {
    std::vector<Vec3> vertices;
    std::vector<std::array<uint32_t, 4>> tets;
    Vec3 centre(size_t t) const {
        Vec3 c = Vec3::Zero();
        for (uint32_t v : tets[t]) c += vertices[v] / 4;
        return c;
    }
    double volume(size_t t) const {
        const auto& [a, b, c, d] = tets[t];
        return (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).dot(vertices[d] - vertices[a]) / 6;
    }
};

/// A box of cells, each cut into the six tetrahedra around its diagonal; inner vertices are moved by `jitter` cells.
inline TetBox make_tet_box(std::array<int, 3> cells, double cell, double jitter = 0, uint32_t seed = 1) {
    TetBox box;
    std::mt19937 random(seed);
    auto noise = [&] { return (random() / 4294967296.0 - 0.5) * 2 * jitter * cell; };
    auto id = [&](int x, int y, int z) { return uint32_t((z * (cells[1] + 1) + y) * (cells[0] + 1) + x); };
    for (int z = 0; z <= cells[2]; ++z)
        for (int y = 0; y <= cells[1]; ++y)
            for (int x = 0; x <= cells[0]; ++x) {
                const std::array<int, 3> p = {x, y, z};
                Vec3 v(x * cell, y * cell, z * cell);
                for (int k = 0; k < 3; ++k) {
                    const double n = noise();
                    if (p[k] > 0 && p[k] < cells[k]) v[k] += n;  // sides of the box stay flat
                }
                box.vertices.push_back(v);
            }
    for (int z = 0; z < cells[2]; ++z)
        for (int y = 0; y < cells[1]; ++y)
            for (int x = 0; x < cells[0]; ++x) {
                std::array<int, 3> axes = {0, 1, 2};
                do {  // one tetrahedron a way along the axes from corner 000 to corner 111
                    std::array<int, 3> p = {x, y, z};
                    std::array<uint32_t, 4> t = {id(x, y, z), 0, 0, 0};
                    for (int k = 0; k < 3; ++k) ++p[axes[k]], t[k + 1] = id(p[0], p[1], p[2]);
                    box.tets.push_back(t);
                } while (std::next_permutation(axes.begin(), axes.end()));
            }
    return box;
}

struct Body {
    std::shared_ptr<FragmentSet> fragments;
    SimulationMesh rest;

    std::vector<Vec3> position;  // a frame, at rest to begin with
    std::vector<Quat> orientation;
    std::vector<Mat3> plastic;
    std::vector<uint8_t> intact;
};

inline void rest_frame(Body& body) {
    body.position = body.rest.rest_position;
    body.orientation = body.rest.rest_orientation;
    body.plastic.assign(body.rest.n_particles(), Mat3::Identity());
    body.intact.assign(body.rest.n_edges(), 1);
}

/// Fragments from tetrahedra (turned the right way round) with labels 0 .. n-1; one edge an interface.
inline Body make_body(TetBox box, const std::vector<uint32_t>& label) {
    for (size_t t = 0; t < box.tets.size(); ++t)
        if (box.volume(t) < 0) std::swap(box.tets[t][2], box.tets[t][3]);
    Body body{std::make_shared<FragmentSet>(), {}, {}, {}, {}, {}};
    FragmentSet& set = *body.fragments;
    set.vertices = box.vertices;
    const uint32_t n = *std::max_element(label.begin(), label.end()) + 1;
    std::map<std::array<uint32_t, 3>, std::vector<std::pair<uint32_t, Triangle>>> faces;  // sorted vertices -> sides
    set.fragments.resize(n);
    for (size_t t = 0; t < box.tets.size(); ++t) {
        const auto [a, b, c, d] = box.tets[t];
        for (const Triangle& f : {Triangle{a, c, b}, Triangle{a, b, d}, Triangle{b, c, d}, Triangle{a, d, c}}) {
            std::array<uint32_t, 3> key = f;
            std::sort(key.begin(), key.end());
            faces[key].push_back({label[t], f});
        }
        Fragment& fragment = set.fragments[label[t]];
        fragment.volume += box.volume(t);
        fragment.centroid += box.volume(t) * box.centre(t);
    }
    for (Fragment& f : set.fragments) f.centroid /= f.volume, f.radii = Vec3::Constant(0.5 * std::cbrt(f.volume));

    std::vector<std::vector<Triangle>> outer(n);
    std::map<std::pair<uint32_t, uint32_t>, std::vector<Triangle>> cut;
    for (const auto& [key, sides] : faces) {
        if (sides.size() == 1)
            outer[sides[0].first].push_back(sides[0].second);
        else if (sides[0].first < sides[1].first)
            cut[{sides[0].first, sides[1].first}].push_back(sides[0].second);
        else if (sides[1].first < sides[0].first)
            cut[{sides[1].first, sides[0].first}].push_back(sides[1].second);
    }
    for (uint32_t i = 0; i < n; ++i) {
        set.fragments[i].outer_begin = uint32_t(set.outer_triangles.size());
        set.outer_triangles.insert(set.outer_triangles.end(), outer[i].begin(), outer[i].end());
        set.fragments[i].outer_end = uint32_t(set.outer_triangles.size());
    }
    set.outer_material.assign(set.outer_triangles.size(), 0);
    set.interior_material = 1;
    for (const auto& [pair, triangles] : cut) {
        Interface face{FragmentId(pair.first), FragmentId(pair.second)};
        face.triangle_begin = uint32_t(set.interface_triangles.size());
        for (const Triangle& t : triangles) {
            set.interface_triangles.push_back(t);
            const Vec3 area =
                (set.vertices[t[1]] - set.vertices[t[0]]).cross(set.vertices[t[2]] - set.vertices[t[0]]) / 2;
            face.area += area.norm(), face.normal += area;
        }
        face.normal.normalize();
        face.triangle_end = uint32_t(set.interface_triangles.size());
        set.interfaces.push_back(face);
        body.rest.edges.push_back({ParticleId(pair.first), ParticleId(pair.second), face.area});
    }
    for (uint32_t i = 0; i < n; ++i) {
        body.rest.rest_position.push_back(set.fragments[i].centroid);
        body.rest.rest_orientation.push_back(Quat(Eigen::AngleAxisd(0.3 * i, Vec3(1, 2, i % 5).normalized())));
        body.rest.radii.push_back(set.fragments[i].radii);
        body.rest.volume.push_back(set.fragments[i].volume);
        body.rest.mass.push_back(1000 * set.fragments[i].volume);
        body.rest.body.push_back(0);
        body.rest.fragment.push_back(i);
    }
    build_one_rings(body.rest);
    rest_frame(body);
    return body;
}

/// Labels of cubes of `block` cells, numbered x fastest.
inline std::vector<uint32_t> block_labels(const TetBox& box, const std::array<int, 3>& blocks, double size) {
    std::vector<uint32_t> label(box.tets.size());
    for (size_t t = 0; t < label.size(); ++t) {
        const Vec3 c = box.centre(t) / size;
        label[t] = uint32_t((int(c.z()) * blocks[1] + int(c.y())) * blocks[0] + int(c.x()));
    }
    return label;
}

/// k-means over tetrahedron centres; labels that are not connected by faces become labels of their own.
inline std::vector<uint32_t> kmeans_labels(const TetBox& box, int k, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<Vec3> site;
    for (int i = 0; i < k; ++i) site.push_back(box.centre(random() % box.tets.size()));
    std::vector<uint32_t> label(box.tets.size());
    for (int round = 0; round < 15; ++round) {
        std::vector<Vec3> sum(k, Vec3::Zero());
        std::vector<int> count(k, 0);
        for (size_t t = 0; t < label.size(); ++t) {
            const Vec3 c = box.centre(t);
            label[t] = uint32_t(std::min_element(site.begin(), site.end(),
                                                 [&](const Vec3& x, const Vec3& y) {
                                                     return (x - c).squaredNorm() < (y - c).squaredNorm();
                                                 }) -
                                site.begin());
            sum[label[t]] += c, ++count[label[t]];
        }
        for (int i = 0; i < k; ++i)
            if (count[i]) site[i] = sum[i] / count[i];
    }
    std::map<std::array<uint32_t, 3>, uint32_t> open;
    std::vector<uint32_t> root(label.size());
    std::iota(root.begin(), root.end(), 0u);
    auto find = [&](uint32_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (uint32_t t = 0; t < label.size(); ++t)
        for (int skip = 0; skip < 4; ++skip) {
            std::array<uint32_t, 3> key;
            for (int i = 0, j = 0; i < 4; ++i)
                if (i != skip) key[j++] = box.tets[t][i];
            std::sort(key.begin(), key.end());
            const auto [at, fresh] = open.try_emplace(key, t);
            if (!fresh && label[at->second] == label[t]) root[find(t)] = find(at->second);
        }
    std::map<uint32_t, uint32_t> number;
    for (uint32_t t = 0; t < label.size(); ++t)
        label[t] = number.try_emplace(find(t), uint32_t(number.size())).first->second;
    return label;
}

inline std::vector<uint32_t> random_labels(const TetBox& box, uint32_t k, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<uint32_t> label(box.tets.size());
    for (size_t t = 0; t < label.size(); ++t) label[t] = t < k ? uint32_t(t) : random() % k;
    return label;
}

}  // namespace sunder::testing
