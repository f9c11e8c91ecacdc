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

/// Rest data of one body, as the transforms need it.
class ParticleTransforms {
public:
    explicit ParticleTransforms(const SimulationMesh& rest);

    /// Gives for particle i the map  x -> position_i + (I + E_i) R_rel F_P (x - rest_position_i),
    /// with R_rel = orientation * rest_orientation^-1. (n_particles)
    ///
    /// E is the elastic part, fitted to the particle's ring through intact edges:
    ///
    ///     E = sum w (y - q) q^T (sum w q q^T + s I)^-1,  q = R_rel F_P (rest_j - rest_i),  y = position_j - position_i
    ///
    /// with w = interface area / rest distance and s a small share of the trace, so that what the ring does not tell
    /// (a pair, a plate) stays undeformed. The paper blends rigid transforms; those show a body that is stretched by
    /// 20 % wrong by 4 % of the particle spacing on its surface, which lies outside of the particles, and creased at
    /// every fragment; with E both errors fall, see docs/theory.md. Where the ring moves as R_rel F_P tells, at rest,
    /// stress-free or alone, E = 0: nothing pops when edges break there, and a lone fragment moves by itself.
    void evaluate(std::span<const Vec3> position, std::span<const Quat> orientation,
                  std::span<const Mat3> plastic_deformation, std::span<const uint8_t> edge_intact,
                  std::vector<Affine>& out, const RangeRunner& run = run_serially);

    /// Gives d/dt of the maps that the last `evaluate` gave, which saw these positions and edges: the derivative of
    /// its formula along `velocity` (m/s) and `angular_velocity` (rad/s, world), 1/s and m/s. F_P stands still: a state
    /// does not tell how fast it flows, and where it does E shrinks as F_P grows, so that (I + E) R F_P follows the
    /// ring all the same. (n_particles)
    void rates(std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity,
               std::span<const uint8_t> edge_intact, std::vector<Affine>& out, const RangeRunner& run = run_serially);

private:
    std::vector<Vec3> rest_position_;
    std::vector<Quat> rest_orientation_;
    std::vector<Edge> edges_;
    std::vector<double> edge_weight_;                // interface area / rest distance, m  (n_edges)
    std::vector<uint32_t> ring_offset_, ring_edge_;  // edges of a particle, ascending     (n_particles + 1)
    std::vector<Mat3> plain_;                        // R_rel F_P                          (n_particles)
    std::vector<Mat3> elastic_;                      // E before it is limited             (n_particles)
    std::vector<Mat3> qq_;                           // sum of a particle's ring           (n_particles)
};

}  // namespace sunder
