// Visits to contacts, four side by side (contact_kernels.inl). What passes over them move is kept by slot: one for each
// movable and piece that a round touches.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

/// What passes move a movable by, and how pushes do (see PushDivision).
struct alignas(64) RoundMovable {
    double moved[3] = {}, own = 0;          // m; 1/kg
    double lever[3] = {}, orbit_share = 0;  // m; -
};

/// The same of a piece.
struct alignas(64) RoundPiece {
    double shift[3] = {}, whole = 0;  // m; 1/kg
    double turn[3] = {}, Jxx = 0;     // of the particles' centres about the piece's, rad; J: inverse inertia, 1/(kg m2)
    double spin[3] = {}, Jyy = 0;     // of the particles about their own centres, rad
    double Jzz = 0, Jxy = 0, Jxz = 0, Jyz = 0;
};

/// Of a movable since the start of the substep, where the round began.
struct alignas(64) RoundBegan {
    double shift[3] = {}, unused0 = 0;   // m
    double turned[3] = {}, unused1 = 0;  // rad
};

/// Four contacts that are solved side by side. Lanes without a contact are zero, with the slots of a collider.
struct alignas(64) ContactBatch {
    uint32_t movable[2][4], piece[2][4];  // slots of a and of b; those of colliders never move
    double arm[2][3][4];                  // from the movables' centres to the touching points, m
    double normal[3][4];
    double missing[4];                        // of the gap, where nothing moves since the round began, m
    double inverse_mass[4], mass[4];          // along the normal, 1/kg and kg; 0: is let alone
    double motion[3][4], rolled[3][4];        // a's less b's where the round began, m and rad
    double along_normal[3][4];                // that motion by a unit impulse along the normal, 1/kg
    double slip_mass[4];                      // the least along any tangent, kg
    double rolling_inertia[4];                // the least about any axis, kg m2; 0: nothing to roll against
    double friction[4], rolling_arm[4];       // -; m
    double rolling_weight[4];                 // 1 / rolling_arm^2, or 0
    double normal_impulse[4], impulse[6][4];  // kg m; friction, kg m, and rolling, kg m2
    // The last pass changed the impulses by `change`; `direction` is what passes moved them by, followed so far.
    double normal_change[4], change[6][4];
    double normal_direction[4], direction[6][4];
};

/// How far a pass follows the direction of those before it.
struct Following {
    double share = 0;
    bool keeps = true;  // else the direction is forgotten
};

struct PassResult {
    double largest = 0;  // change of a gap, m
    double size = 0;     // squared length of the change, as displacements weigh it, kg m2
};

struct ContactArrays {
    RoundMovable* movables;
    RoundPiece* pieces;
    const RoundBegan* began;
    ContactBatch* batches;
    uint8_t* idle;  // batches without impulses, and none to follow
};

struct ContactKernels {
    /// From slots, arms, normals and rolling arms: what stays while pushes divide as they do.
    void (*describe)(const ContactArrays&, size_t begin, size_t end);
    /// From `began`: motion and rolled, and takes what was closed off `missing`.
    void (*start)(const ContactArrays&, size_t begin, size_t end);
    /// Moves things by the impulses that are there.
    void (*give)(const ContactArrays&, size_t begin, size_t end);
    /// One turn of each of these batches: gap >= wanted gap, friction within its cone, rolling resistance within its
    /// bound.
    PassResult (*pass)(const ContactArrays&, const uint32_t* batches, size_t n, Following);
    /// What contacts do with their impulses when their turn comes, for all that they push: it is linear in them.
    void (*follow_movables)(RoundMovable*, double* io_before, double* io_direction, size_t n, Following);
    void (*follow_pieces)(RoundPiece*, double* io_before, double* io_direction, size_t n, Following);
};

constexpr size_t kMovedNumbers = 4, kPieceMovedNumbers = 12;  // of a movable and of a piece, that `follow` follows

extern const ContactKernels kContactKernelsPortable;
extern const ContactKernels kContactKernelsAvx2;  // only where SUNDER_HAS_AVX2 is defined

}  // namespace sunder
