// How the particles of a piece move beyond it, four at a time (piece_frame_kernels.cpp).
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

/// Particles of a piece, four a block: block b holds places [4 b, 4 b + 4) of `member`.
struct PieceMembers {
    const uint32_t* member;             // particles (n)
    size_t n;                           // >= 1
    const double *position, *velocity;  // of all particles, records of three, m, m/s
    const double* radius;               // of all particles, m
};

/// Where a piece is, and how it goes on as a whole.
struct FrameMotion {
    double center[3], velocity[3], spin[3];  // m, m/s, rad/s
    double back[9];                          // from the world into the piece's frame, row after row
    double duration;                         // s
    double bend;                             // of a reach: what turning adds to it (piece_frame.cpp), -
};

struct PieceFrameKernels {
    /// Adds to io_sum what blocks [begin, end) add up to, x and v as seen from the first member: x (3 numbers, m), v
    /// (3, m/s), x cross v (3, m2/s), xx, yy, zz, xy, xz, yz of x x^T (6, m2).
    void (*rigid_motion)(const PieceMembers&, size_t begin, size_t end, double* io_sum);
    /// Adds (x - center) r^T to io_sum (9, row after row, m2); `remembered`: r of each place, records of three, m.
    void (*turn)(const PieceMembers&, const double* center, const double* remembered, size_t begin, size_t end,
                 double* io_sum);
    /// Boxes of members through the step in the piece's frame: lower and upper corner of each place, six numbers, m.
    void (*boxes)(const PieceMembers&, const FrameMotion&, size_t begin, size_t end, double* o_boxes);
    /// o_left[b]: a bit for each member of the block whose box `grown` (as `boxes` writes them) does not hold.
    void (*who_left)(const PieceMembers&, const FrameMotion&, const double* grown, size_t begin, size_t end,
                     uint8_t* o_left);
};

extern const PieceFrameKernels kPieceFrameKernelsPortable, kPieceFrameKernelsAvx2, kPieceFrameKernelsAvx512;

}  // namespace sunder
