#include "solver/fracture.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

// +1 or -1: on which side of the plane the group's centre particle goes. `on_the_plane`: closer than this, m.
int side_of_center(const LiveTopology& live, const GroupShapes& shapes, std::span<const MovingParticle> particles,
                   uint32_t g, const Vec3& on_plane, const Vec3& normal, double on_the_plane) {
    const double distance = normal.dot(particles[g].x - on_plane);
    if (std::abs(distance) >= on_the_plane) return distance > 0 ? 1 : -1;
    double balance = 0;  // mass on the normal's side less mass on the other
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        if (live.member(s) == g) continue;
        balance +=
            normal.dot(particles[live.member(s)].x - on_plane) > 0 ? shapes.member[s].mass : -shapes.member[s].mass;
    }
    return std::abs(balance) > 1e-9 * shapes.group[g].mass ? (balance > 0 ? 1 : -1) : 1;
}

// Loads that differ by less than a millionth are equal: in a symmetric body rounding must not choose the crack.
int64_t rounded(double load) { return std::llround(load * 1e6); }

// Normals have no sign of their own: the first coordinate that is not small points up.
Vec3 oriented(const Vec3& n) {
    for (int i = 0; i < 3; ++i)
        if (std::abs(n(i)) > 1e-3) return n(i) > 0 ? n : Vec3(-n);
    return n;
}

}  // namespace

GroupStrain group_strain(const Vec3& e, const Mat3& directions, const Quat& rotation, const Material& material) {
    int largest, smallest;
    const double tension = e.maxCoeff(&largest), compression = -e.minCoeff(&smallest);
    const double tension_load = tension / material.toughness,
                 compression_load = compression / material.compressive_toughness;
    GroupStrain s;
    const bool pulled = tension_load >= compression_load;
    s.load = pulled ? tension_load : compression_load;
    s.strain = pulled ? tension : -compression;
    s.normal = rotation * directions.col(pulled ? largest : smallest);
    return s;
}

std::vector<BrokenEdge> edges_to_cut(const LiveTopology& live, const GroupShapes& shapes,
                                     std::span<const MovingParticle> particles, std::span<const GroupStrain> strains,
                                     double leading, double time) {
    std::vector<double> most(live.n_pieces(), 1.0);
    for (uint32_t g = 0; g < strains.size(); ++g) most[live.piece(g)] = std::max(most[live.piece(g)], strains[g].load);
    std::vector<BrokenEdge> cuts;
    for (uint32_t g = 0; g < strains.size(); ++g) {
        if (strains[g].load <= 1.0 || live.count(g) == 1) continue;
        const double enough = 1.0 + leading * (most[live.piece(g)] - 1.0);
        if (rounded(strains[g].load) < rounded(enough)) continue;
        bool most_loaded = true;
        for (uint32_t s = live.begin(g); s < live.end(g) && most_loaded; ++s) {
            const uint32_t j = live.member(s);
            const int64_t own = rounded(strains[g].load), other = rounded(strains[j].load);
            most_loaded = other < own || (other == own && j >= g);
        }
        if (!most_loaded) continue;

        const Vec3 normal = oriented(strains[g].normal);
        const Vec3 center = group_moments(live, shapes, particles, g).center;
        const double on_the_plane = 1e-6 * std::sqrt(shapes.group[g].positions_trace / shapes.group[g].mass);
        const int own_side = side_of_center(live, shapes, particles, g, center, normal, on_the_plane);
        for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
            if (live.member(s) == g) continue;
            const double distance = normal.dot(particles[live.member(s)].x - center);
            if (distance * own_side < -on_the_plane) cuts.push_back({live.edge(s), time, strains[g].strain});
        }
    }
    // Two groups may cut the same edge only if neither is in the other's ring: cannot be, but edges come out unordered.
    std::sort(cuts.begin(), cuts.end(), [](const BrokenEdge& a, const BrokenEdge& b) { return a.edge < b.edge; });
    return cuts;
}

}  // namespace sunder
