// Which fragments lie alone through the thickness of their body, as in sheets and rods, and which way that is.
#pragma once

#include <vector>

#include "solver/data/simulation_mesh.h"

namespace sunder {

/// How a fragment lies in its body: alone through the thickness, one of a few, or one of many. 0: neighbours leave a
/// direction of it unspanned, and it is not thin.
inline constexpr uint8_t kThin = 1, kSlender = 2, kThick = 3;

/// How far a fragment's interfaces span its own axes: t_k sum_e A_e (n_e . e_k)^2 / V, t_k = sqrt(12 rho_k^2) its
/// extent along e_k; 2 where a neighbour of its own section lies on either side, 0 where none does.
class Cover {
public:
    explicit Cover(const SimulationMesh& rest, ParticleIndex g);
    void add(const SimulationMesh& rest, ParticleIndex g, ParticleIndex neighbour, double area);
    bool spans(int k) const { return cover_[k] > kSpanned; }
    /// No neighbour to speak of reaches beyond the fragment along e_k.
    bool is_free(int k) const { return cover_[k] < kFree; }
    /// 0 .. 3
    int directions() const { return spans(0) + spans(1) + spans(2); }
    /// All three, and none between the axes is free: three neighbours in a slanting plane span each axis, and no more
    /// than that plane.
    bool spans_all() const;
    int least() const;
    int most() const;

private:
    static constexpr double kSpanned = 0.5;  // half a neighbour of the fragment's own section
    static constexpr double kFree = 0.1;
    Mat3 to_axes_;
    Vec3 extent_per_volume_, cover_ = Vec3::Zero();
    Vec3 between_ = Vec3::Zero();  // of the axes other than each: their cover of what lies between
};

/// Second moments of a fragment along its own axes, over its volume, m2: those of a box of its radii.
inline Vec3 section_moments(const SimulationMesh& rest, ParticleIndex g) {
    return rest.radii[g].cwiseProduct(rest.radii[g]) / 3;
}

/// 1 where interfaces leave a direction of the whole one-ring at rest unspanned, and of at least half of its
/// neighbours' rings (n_particles): a slim fragment among others is no sheet. A lone particle is not thin.
std::vector<uint8_t> thin_groups(const SimulationMesh& rest);

/// kThin as above; 0 where interfaces leave a direction unspanned; kSlender where a fragment lies in a bar, a frame, a
/// shell or a thick plate: within four sizes of those about it none has two others between it and the surface, so that
/// four at most lie through the thickness, the body there is twice as long, and half of the neighbours lie so, too;
/// else kThick (n_particles).
std::vector<uint8_t> bending_groups(const SimulationMesh& rest);

/// 1 where a fragment and its neighbours at rest lie flat, or in a row: the least second moment of their centres is
/// under 0.35 of the largest. So they do in plates and walls one or two fragments thick (n_particles).
std::vector<uint8_t> flat_groups(const SimulationMesh& rest);

/// The directions through the thickness, that interfaces leave unspanned, as a projection in rest axes: across a sheet,
/// the section of a rod; zero where it is not thin (n_particles).
std::vector<Mat3> across_thickness(const SimulationMesh& rest);

}  // namespace sunder
