// Skinned vertices of one frame after the other: only those whose particles moved are worked out again.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/shared_array.h"
#include "fracture_tools/skin/skinning.h"

namespace sunder {

/// A particle's map as the inner loop reads it: columns of the linear part, then the offset, each padded to four.
struct alignas(32) AffineColumns {
    double column[4][4];

    static AffineColumns of(const Affine& a);
};

/// The same of what turns as the vertex does.
struct alignas(32) TurningColumns {
    AffineColumns turned;
    double turn[4];  // x, y, z, w
};

/// Maps or their rates; the others are empty where nothing is thin.
struct ParticleColumns {
    std::vector<AffineColumns> carried;
    std::vector<TurningColumns> turning;
    std::vector<uint8_t> turns;  // 1: `turning` is not zero
};

/// cof(L), which carries normals, in columns padded to four.
struct alignas(16) NormalMap {
    float column[3][4];
};

/// What the frame asks for besides positions.
enum class SkinExtras { none, normal_maps };

/// The linear blend of Choi 2014, section 4, with what turns as the vertex does (ParticleMaps), and its derivative:
///
///     x_v = (sum w_j carried_j)(rest_v) + Q_v (sum w_j turned_j)(rest_v)
///
/// summed in the order of the influences. A vertex keeps its bits as long as the maps of its particles keep theirs.
class SkinMotion {
public:
    /// `most_vertices`: as many as there will ever be; what nobody writes to takes no memory.
    SkinMotion(SkinExtras extras, size_t most_vertices) : extras_(extras), most_vertices_(most_vertices) {}

    /// `particle`: maps from rest (n_particles); `rate`: d/dt of them, or empty. `is_rebound`: vertices are not those
    /// of the last call. Returns whether anything differs from the last call, so that vertices are to be moved.
    bool take(bool is_rebound, const ParticleMaps& particle, const ParticleMapRates& rate);

    /// Told of each chunk, moved or not, as soon as its vertices are in place, by the thread that put them there. The
    /// maps are those of its vertices that moved, for as long as the call lasts; none unless asked for.
    using Placed = std::function<void(size_t chunk, std::span<const NormalMap> normal_map)>;

    /// Of the vertices of a chunk, which the skin has just put in place where they moved: what goes beside it.
    using Corrected = std::function<void(size_t chunk, std::span<const uint8_t> moved, std::span<Vec3> io_position,
                                         std::span<Vec3> io_velocity)>;

    /// Moves vertices by the maps that were taken.
    void move(const SkinBinding& binding, const RangeRunner& run, const Placed& placed = {},
              const Corrected& correct = {});

    /// In double: normals of small triangles far from the origin need it. (n_vertices x 3), m
    std::span<const Vec3> positions() const { return position_; }
    std::span<const Vec3> velocities() const { return velocity_; }  // (n_vertices x 3), m/s; empty without rates
    /// Which vertices may differ from the last call. (n_vertices)
    std::span<const uint8_t> moved() const { return moved_; }
    bool all_moved() const { return all_moved_; }
    /// Counts calls that changed something.
    uint64_t frame() const { return frame_; }
    /// Frame in which a chunk of the binding changed last.
    uint64_t changed(size_t chunk) const { return chunk_changed_[chunk]; }

    /// The blend's linear part at one vertex, of the maps of the last call.
    Mat3 linear_at(const SkinBinding& binding, size_t vertex) const;

private:
    void move_chunk(const SkinBinding& binding, size_t chunk, NormalMap* out_normal_map);

    const SkinExtras extras_;
    const size_t most_vertices_;
    ParticleMaps particle_;  // of the last call
    ParticleMapRates rate_;
    ParticleColumns map_, map_rate_;
    std::vector<uint8_t> particle_moved_;
    bool all_moved_ = false;
    uint64_t frame_ = 0;
    std::vector<Vec3> position_, velocity_;
    std::vector<uint8_t> moved_;
    std::vector<uint64_t> chunk_changed_;
};

}  // namespace sunder
