// How the space around each particle moves with it: what the skin blends.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "solver/data/math.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

/// x -> linear * x + offset, from rest to world.
struct Affine {
    Mat3 linear = Mat3::Identity();
    Vec3 offset = Vec3::Zero();

    Vec3 apply(const Vec3& x) const { return linear * x + offset; }
};

/// What the skin blends at a vertex x of the weights w:
///
///     sum w_i carried_i(x)  +  Q sum w_i turned_i(x),     Q: the rotation of the vertex, that of sum w_i (+-) turn_i
///
/// with the sign of each that is nearer to the heaviest one. Particle i alone moves x by carried_i + R_i turned_i. Of
/// blocks `turned` is zero, and all is blended as in the paper. Of what lies one fragment thick it is the arm
/// x - rest_i as the particle stretches it: all of it across the thickness, half of it in the sheet,
///
///     turned_i = R_i^T L_i C_i (x - rest_i),     C = N + (1 - N) / 2,     N: the projection across the thickness.
///
/// Blended matrices shorten what they turn differently, a sheet folded by 150 degrees to a quarter of its thickness;
/// blended rotations turn it. In the sheet the mean of both ends' rotations leads along the arc in between, so that
/// neighbours agree on where it is.
struct ParticleMaps {
    std::vector<Affine> carried;  // (n_particles)
    std::vector<Affine> turned;   // (n_particles), or empty: nothing is thin
    std::vector<Quat> turn;       // R_i, since rest (as `turned`)

    bool bend() const { return !turned.empty(); }
    /// M_i: x -> position_i + L_i (x - rest_position_i)
    Affine whole(size_t i) const;
};

/// d/dt of the same, 1/s and m/s; `turn` is the rate of the quaternion's four numbers, 1/s.
struct ParticleMapRates {
    std::vector<Affine> carried, turned;
    std::vector<Quat> turn;
};

/// Rest data of one body, as the transforms need it.
class ParticleTransforms {
public:
    explicit ParticleTransforms(const SimulationMesh& rest);

    /// Gives for particle i the map  x -> position_i + L_i (x - rest_position_i),  L_i = (I + E_i) R_i F_P,
    /// with R_i = orientation * rest_orientation^-1, in the parts that the skin blends. (n_particles)
    ///
    /// E is the elastic part, fitted to the particle's ring through intact edges:
    ///
    ///     E = sum w (y - q) q^T (sum w q q^T + s I)^-1,  q = R_i F_P (rest_j - rest_i),  y = position_j - position_i
    ///
    /// with w = interface area / rest distance and s a small share of the trace, so that what the ring does not tell
    /// (a pair, a plate) stays undeformed. The paper blends rigid transforms; those show a body that is stretched by
    /// 20 % wrong by 4 % of the particle spacing on its surface, which lies outside of the particles, and creased at
    /// every fragment; with E both errors fall, see docs/theory.md. Where the ring moves as R_i F_P tells, at rest,
    /// stress-free or alone, E = 0: nothing pops when edges break there, and a lone fragment moves by itself.
    ///
    /// Of what lies one fragment thick, y - q is y less where an even turn from R_i to R_j leads: bending is no
    /// stretch, and leaves no E that a break would let go of. Across the thickness a ring tells nothing: there q is
    /// left out and L = R_i F_P, or where a sheet is curved at rest, E would take what bends it for what thickens it.
    void evaluate(std::span<const Vec3> position, std::span<const Quat> orientation,
                  std::span<const Mat3> plastic_deformation, std::span<const uint8_t> edge_intact, ParticleMaps& out,
                  const RangeRunner& run = run_serially);

    /// Gives d/dt of the maps that the last `evaluate` gave, which saw these positions and edges: the derivative of
    /// its formula along `velocity` (m/s) and `angular_velocity` (rad/s, world), 1/s and m/s. F_P stands still: a state
    /// does not tell how fast it flows, and where it does E shrinks as F_P grows, so that (I + E) R F_P follows the
    /// ring all the same. (n_particles)
    void rates(std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity,
               std::span<const uint8_t> edge_intact, ParticleMapRates& out, const RangeRunner& run = run_serially);

private:
    bool bends(size_t i) const { return !share_.empty() && !share_[i].isZero(0); }
    Affine about_particle(size_t i, const Mat3& linear, const Vec3& position) const;
    Vec3 arc(size_t i, const Edge& e) const;
    Vec3 arc_rate(size_t i, const Edge& e, std::span<const Vec3> angular_velocity) const;

    std::vector<Vec3> rest_position_;
    std::vector<Quat> rest_orientation_;
    std::vector<Edge> edges_;
    std::vector<double> edge_weight_;                // interface area / rest distance, m  (n_edges)
    std::vector<uint32_t> ring_offset_, ring_edge_;  // edges of a particle, ascending     (n_particles + 1)
    std::vector<Mat3> share_;                        // C, zero of blocks                  (n_particles), or empty
    std::vector<Quat> turn_;                         // R_i                                (n_particles)
    std::vector<Mat3> plain_;                        // R_i F_P                            (n_particles)
    std::vector<Mat3> spanned_;                      // the same of what the ring tells    (n_particles)
    std::vector<Mat3> elastic_;                      // E before it is limited             (n_particles)
    std::vector<Mat3> linear_;                       // L                                  (n_particles)
    std::vector<Mat3> qq_;                           // sum of a particle's ring           (n_particles)
};

}  // namespace sunder
