#include "fracture_tools/fragments/simulation_mesh_builder.h"

#include <algorithm>
#include <string>

#include "fracture_tools/fragments/fragment_hulls.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

Status check_settings(const SimulationMeshSettings& settings) {
    if (!(settings.density > 0) || !std::isfinite(settings.density))
        return bad_input("simulation mesh", "density must be above 0 kg/m3");
    if (!(settings.min_radius_share > 0 && settings.min_radius_share <= 1))
        return bad_input("simulation mesh", "the smallest radius must be a share above 0 and at most 1 of the largest");
    return {};
}

std::vector<double> bareness_of(const FragmentSet& set) {
    std::vector<double> bareness;
    for (const Fragment& f : set.fragments) {
        Vec3 bare = Vec3::Zero();
        for (uint32_t t = f.outer_begin; t < f.outer_end; ++t) {
            const auto& [a, b, c] = set.outer_triangles[t];
            bare += 0.5 * (set.vertices[b] - set.vertices[a]).cross(set.vertices[c] - set.vertices[a]);
        }
        const double size = math::cbrt(f.volume);
        bareness.push_back(bare.norm() / (size * size));
    }
    return bareness;
}

}  // namespace

Result<SimulationMesh> build_simulation_mesh(const FragmentSet& set, const SimulationMeshSettings& settings) {
    if (Status s = check_settings(settings); !s) return s.error();
    if (set.fragments.empty()) return bad_input("simulation mesh", "there are no fragments");

    SimulationMesh mesh;
    const size_t n = set.fragments.size();
    for (size_t i = 0; i < n; ++i) {
        const Fragment& fragment = set.fragments[i];
        const double largest = fragment.radii.maxCoeff();
        if (!(fragment.volume > 0) || !(largest > 0) || !std::isfinite(largest) || !fragment.centroid.allFinite())
            return bad_input("fragment " + std::to_string(i), "it has no volume", "fracture into fewer pieces");
        if (!(fragment.density_factor > 0) || !std::isfinite(fragment.density_factor))
            return bad_input("fragment " + std::to_string(i), "its density factor is not above 0");
        mesh.rest_position.push_back(fragment.centroid);
        mesh.rest_orientation.push_back(fragment.orientation);
        mesh.radii.push_back(fragment.radii.cwiseMax(settings.min_radius_share * largest));
        mesh.volume.push_back(fragment.volume);
        mesh.mass.push_back(settings.density * fragment.density_factor * fragment.volume);
        mesh.yield_factor.push_back(fragment.yield_factor);
        mesh.toughness_factor.push_back(fragment.toughness_factor);
        mesh.fragment.push_back(static_cast<uint32_t>(i));
    }
    mesh.body.assign(n, 0);
    mesh.bareness = bareness_of(set);
    find_hulls(set, mesh);
    for (size_t k = 0; k < set.interfaces.size(); ++k) {
        const Interface& face = set.interfaces[k];
        if (!(face.a < face.b) || face.b.index() >= n)
            return bad_input("interface " + std::to_string(k), "it joins no two fragments");
        if (face.joins)
            mesh.edges.push_back(
                {ParticleId(face.a.value), ParticleId(face.b.value), face.area, face.toughness_factor});
    }
    for (std::vector<double>* factors : {&mesh.yield_factor, &mesh.toughness_factor})
        if (std::all_of(factors->begin(), factors->end(), [](double f) { return f == 1; })) factors->clear();
    auto before = [](const Edge& p, const Edge& q) { return std::pair(p.a, p.b) < std::pair(q.a, q.b); };
    std::sort(mesh.edges.begin(), mesh.edges.end(), before);
    for (size_t k = 1; k < mesh.edges.size(); ++k)
        if (!before(mesh.edges[k - 1], mesh.edges[k]))
            return bad_input("fragment " + std::to_string(mesh.edges[k].a),
                             "it has two interfaces with fragment " + std::to_string(mesh.edges[k].b));
    build_one_rings(mesh);
    return mesh;
}

}  // namespace sunder
