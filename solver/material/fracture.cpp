#include "solver/material/fracture.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "solver/data/invariant.h"
#include "solver/matching/unit_schedule.h"

namespace sunder {
namespace {

// Loads that differ by less than a millionth are equal: in a symmetric body rounding must not choose the crack.
int64_t rounded(double load) { return std::llround(load * 1e6); }

// Normals have no sign of their own: the first coordinate that is not small points up.
Vec3 oriented(const Vec3& n) {
    for (int i = 0; i < 3; ++i)
        if (std::abs(n(i)) > 1e-3) return n(i) > 0 ? n : Vec3(-n);
    return n;
}

// A plane through a group, with its centre particle on one side.
struct FracturePlane {
    Vec3 point, normal;
    double tolerance;  // closer than this is on the plane, m
    int own_side;      // +1 or -1: where the centre goes

    bool parts(const Vec3& x) const { return normal.dot(x - point) * own_side < -tolerance; }
};

FracturePlane plane_through(const LiveGroups& groups, ParticleIndex g, const Vec3& normal) {
    const auto& [rest, live, shapes, particles, bond] = groups;
    FracturePlane plane{group_moments(live, shapes, particles, g).center, normal, 0, 1};
    plane.tolerance = 1e-6 * std::sqrt(shapes.group[g].positions_trace / shapes.group[g].mass);
    const double distance = normal.dot(particles[g].x - plane.point);
    if (std::abs(distance) >= plane.tolerance) {
        plane.own_side = distance > 0 ? 1 : -1;
        return plane;
    }
    double balance = 0;  // mass on the normal's side less mass on the other
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        if (live.member(s) == g) continue;
        const double mass = shapes.member_mass(live, s);
        balance += normal.dot(particles[live.member(s)].x - plane.point) > 0 ? mass : -mass;
    }
    if (std::abs(balance) > 1e-9 * shapes.group[g].mass) plane.own_side = balance > 0 ? 1 : -1;
    return plane;
}

double factor_of(const SimulationMesh& rest, EdgeId edge, std::span<const double> bond) {
    return bond.empty() ? rest.edges[edge].toughness_factor : rest.edges[edge].toughness_factor * bond[edge];
}
double factor_of(const LiveGroups& groups, uint32_t slot) {
    return factor_of(groups.rest, groups.live.edge(slot), groups.bond);
}

// Mean factor of the edges that the plane cuts; kNever where it cuts none but glued ones.
double mean_factor(const LiveGroups& groups, ParticleIndex g, const FracturePlane& plane) {
    double sum = 0, total = 0;
    for (uint32_t s = groups.live.begin(g); s < groups.live.end(g); ++s) {
        const ParticleId j = groups.live.member(s);
        if (j == g || !plane.parts(groups.particles[j].x)) continue;
        const double factor = factor_of(groups, s);
        if (factor == kNever) continue;
        const Vec3 along = groups.particles[j].x - groups.particles[g].x;
        const double weight = groups.shapes.member[s].weight * std::abs(plane.normal.dot(along)) / along.norm();
        sum += weight * factor, total += weight;
    }
    return total > 0 ? sum / total : kNever;
}

struct UnevenPlane {
    FracturePlane plane;
    double factor;  // on the group's toughness
};

// Which of the two sides of the centre the plane runs on: through the centre of mass, unless the other side is weaker.
UnevenPlane weaker_plane(const LiveGroups& groups, ParticleIndex g, const Vec3& normal) {
    const FracturePlane through = plane_through(groups, g, normal);
    FracturePlane past = through;
    past.point = groups.particles[g].x;
    past.own_side = -through.own_side;
    const double factor = mean_factor(groups, g, through), factor_past = mean_factor(groups, g, past);
    if (factor_past < factor) return {past, factor_past};
    return {through, factor};
}

// Least toughness factor of the living edges from the centre of group g; kNever if all are glued, or there are none.
// Out of line: who asks for the breaking strain of an even group saves no registers for it.
[[gnu::noinline]] double weakest_factor(const SimulationMesh& rest, const LiveTopology& live, ParticleIndex g,
                                        std::span<const double> bond) {
    double weakest = kNever;
    for (uint32_t s = live.begin(g); s < live.end(g); ++s)
        if (live.member(s) != g) weakest = std::min(weakest, factor_of(rest, live.edge(s), bond));
    return weakest;
}

double toughness_of(const Material& own, Strained how) {
    return how == Strained::pulled ? own.toughness : own.compressive_toughness;
}

}  // namespace

bool has_bond(const LiveTopology& live, std::span<const double> bond, ParticleIndex g) {
    for (uint32_t s = live.begin(g); s < live.end(g); ++s)
        if (live.member(s) != g && bond[live.edge(s)] != 1) return true;
    return false;
}

double breaking_strain(const LiveGroups& groups, const Material& own, ParticleIndex g, Strained how,
                       const Vec3& direction) {
    const double toughness = toughness_of(own, how);
    return is_uneven(groups.rest, groups.live, groups.bond, g)
               ? toughness * weaker_plane(groups, g, oriented(direction)).factor
               : toughness;
}

double breaking_strain(const SimulationMesh& rest, const LiveTopology& live, const Material& own, ParticleIndex g,
                       Strained how, std::span<const double> bond) {
    const double toughness = toughness_of(own, how);
    return is_uneven(rest, live, bond, g) ? toughness * weakest_factor(rest, live, g, bond) : toughness;
}

double breaking_strain(const SimulationMesh& rest, const LiveTopology& live, const Material& own, ParticleIndex g,
                       std::span<const double> bond) {
    const Strained weaker = own.compressive_toughness < own.toughness ? Strained::pressed : Strained::pulled;
    return breaking_strain(rest, live, own, g, weaker, bond);
}

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

GroupStrain uneven_group_strain(const Vec3& e, const Mat3& directions, const Quat& rotation, const Material& material,
                                const LiveGroups& groups, ParticleIndex g) {
    GroupStrain worst;
    for (int i = 0; i < 3; ++i) {
        const Strained how = e(i) > 0 ? Strained::pulled : Strained::pressed;
        const double strain = std::abs(e(i)),
                     least = breaking_strain(groups.rest, groups.live, material, g, how, groups.bond);
        if (!(strain > worst.load * least)) continue;  // no plane can be worse
        const Vec3 normal = rotation * directions.col(i);
        const double load = strain / breaking_strain(groups, material, g, how, normal);
        if (load > worst.load) worst = {load, e(i), normal};
    }
    return worst;
}

namespace {

// What group g cuts, if its load is `enough` and the most of its one-ring.
void cut_group(const LiveGroups& groups, std::span<const GroupStrain> strains, ParticleIndex g, double enough,
               double time, std::vector<BrokenEdge>& io_cuts) {
    const auto& [rest, live, shapes, particles, bond] = groups;
    const int64_t own = rounded(strains[g].load);
    if (own < rounded(enough)) return;
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        const ParticleId j = live.member(s);
        const int64_t other = rounded(strains[j].load);
        if (other > own || (other == own && j < g)) return;
    }
    const Vec3 normal = oriented(strains[g].normal);
    const bool uneven = is_uneven(rest, live, bond, g);
    const UnevenPlane at =
        uneven ? weaker_plane(groups, g, normal) : UnevenPlane{plane_through(groups, g, normal), 1.0};
    const double reach = strains[g].load * at.factor;  // strain over the group's own toughness
    for (uint32_t s = live.begin(g); s < live.end(g); ++s)
        if (live.member(s) != g && at.plane.parts(particles[live.member(s)].x) &&
            (!uneven || factor_of(groups, s) < reach))
            io_cuts.push_back(
                {live.edge(s), time, strains[g].strain, std::abs(strains[g].strain) / strains[g].load, {}});
}

}  // namespace

std::vector<BrokenEdge> edges_to_cut(const LiveGroups& groups, std::span<const GroupStrain> strains, double leading,
                                     double time, const WorkerPool& workers) {
    const LiveTopology& live = groups.live;
    SUNDER_ASSERT(strains.size() == live.ends().size() && groups.shapes.group.size() == strains.size());
    SUNDER_ASSERT(leading >= 0 && leading <= 1);
    std::vector<double> most(live.n_pieces(), 1.0);
    for (uint32_t g = 0; g < strains.size(); ++g) most[live.piece(g)] = std::max(most[live.piece(g)], strains[g].load);
    std::mutex mutex;
    std::vector<BrokenEdge> cuts;
    workers.for_range(strains.size(), kGroupGrain, [&](size_t first, size_t last) {
        std::vector<BrokenEdge> own;
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g)
            if (strains[g].load > 1.0 && live.count(g) > 1)
                cut_group(groups, strains, g, 1.0 + leading * (most[live.piece(g)] - 1.0), time, own);
        const std::lock_guard lock(mutex);
        cuts.insert(cuts.end(), own.begin(), own.end());
    });
    // Two groups may cut the same edge only if neither is in the other's ring: cannot be, but edges come out unordered.
    std::sort(cuts.begin(), cuts.end(), [](const BrokenEdge& a, const BrokenEdge& b) { return a.edge < b.edge; });
    return cuts;
}

}  // namespace sunder
