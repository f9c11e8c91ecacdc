// A frame that moves and turns with a piece, and what its particles do in it.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/piece_frame_kernels.h"
#include "solver/data/ids.h"
#include "solver/data/math.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Particles at the start of a step, and what they would do alone.
struct ParticleMotion {
    std::span<const Vec3> position, velocity;  // m, m/s (n_particles)
    std::span<const double> radius;            // of the ball that holds it and what its contacts reach (n_particles), m
    double duration = 0;                       // h, s
};

/// Those that this processor is best at.
const PieceFrameKernels& piece_frame_kernels();

/// At the centre of a piece, with its rigid motion through the step. Its particles are shared out among threads; sums
/// over them run in stored order, however many there are.
class PieceFrame {
public:
    /// `member`: 1 or more; `turn`: of the frame.
    PieceFrame(const PieceFrameKernels& kernels, const ParticleMotion& motion, std::span<const ParticleId> member,
               const Quat& turn, const WorkerPool& workers);

    /// Turns the frame so that members are nearest to where they are `remembered` (as member, about their centre, m).
    void turn_to(std::span<const Vec3> remembered);
    void set_turn(const Quat& turn);

    const Quat& turn() const { return turn_; }
    /// Of the place-th member in the frame, m.
    Vec3 position(size_t place) const;
    /// Holds the place-th member through the step, in the frame, m.
    Aabb box(size_t place) const;
    /// Those of all members.
    void find_boxes(std::vector<Aabb>& out) const;
    /// Places of members whose boxes are not within `grown` (as member, m), ascending.
    void find_who_left(std::span<const Aabb> grown, std::vector<uint32_t>& out) const;

private:
    size_t n_blocks() const { return (particles_.n + 3) / 4; }
    void find_rigid_motion(const Vec3& origin, const Vec3& common_velocity);

    const PieceFrameKernels& kernels_;
    const WorkerPool& workers_;
    PieceMembers particles_;
    FrameMotion motion_;
    Quat turn_;
};

}  // namespace sunder
