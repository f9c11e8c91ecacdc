// Visits to contacts, eight side by side (contact_kernels.cpp), in single precision and in an island's own units:
// lengths in a typical small one, masses in the lightest that is there, so that squares of numbers stay in range. What
// passes over them move is kept by slot: one for each movable and piece that a round touches.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

constexpr uint32_t kContactLanes = 8;

/// What passes move a movable by, and how pushes do (see PushDivision); l and m: the units of its island.
struct alignas(32) RoundMovable {
    float moved[3] = {}, own = 0;          // l; 1/m
    float lever[3] = {}, orbit_share = 0;  // l; -
};

/// The same of a piece.
struct alignas(64) RoundPiece {
    float shift[3] = {}, whole = 0;  // l; 1/m
    float turn[3] = {}, Jxx = 0;     // of the particles' centres about the piece's, rad; J: inverse inertia, 1/(m l2)
    float spin[3] = {}, Jyy = 0;     // of the particles about their own centres, rad
    float Jzz = 0, Jxy = 0, Jxz = 0, Jyz = 0;
};

/// Of a movable since the start of the substep, where the round began. Two that fly side by side went nearly as far:
/// what one moved less than the other wants all digits.
struct alignas(64) RoundBegan {
    double shift[4] = {};  // l; the last: unused
    float turned[4] = {};  // rad
};

/// Batches name records by where their numbers begin: slot times stride, which costs visits no multiplication.
constexpr uint32_t kMovableStride = sizeof(RoundMovable) / sizeof(float),
                   kPieceStride = sizeof(RoundPiece) / sizeof(float);

/// A contact as a round takes it up. One of zeros stands for none, with the slots of a collider.
struct alignas(16) RoundContact {
    float normal[3] = {}, missing = 0;                   // gap, l; see BatchStart
    float arm_a[3] = {}, friction = 0;                   // l; -
    float arm_b[3] = {}, rolling_arm = 0;                // l
    float motion[3] = {}, counts = 0;                    // l, see BatchStart; 1
    float friction_impulse[3] = {}, normal_impulse = 0;  // m l
    float rolling_impulse[3] = {}, unused = 0;           // m l2
    uint32_t movable[2] = {}, piece[2] = {};             // of a and of b, see kMovableStride
};

/// What contacts of a batch ask for at the start of a substep, from round to round.
struct alignas(32) BatchStart {
    float missing[8];    // of the gap, l
    float motion[3][8];  // of a less that of b by what is no movable's: minus the collider's, l
};

/// Eight contacts that are solved side by side, or fewer (BatchForm). Lanes without a contact are zero, with the
/// slots of a collider.
struct alignas(64) ContactBatch {
    uint32_t movable[2][8], piece[2][8];  // of a and of b, see kMovableStride; those of colliders never move
    float arm[2][3][8];                   // from the movables' centres to the touching points, l
    float normal[3][8];
    float missing[8];                        // of the gap, where nothing moves since the round began, l
    float inverse_mass[8], mass[8];          // along the normal, 1/m and m; 0: is let alone
    float motion[3][8], rolled[3][8];        // a's less b's where the round began, l and rad
    float along_normal[3][8];                // that motion by a unit impulse along the normal, 1/m
    float slip_mass[8];                      // the least along any tangent, m
    float rolling_inertia[8];                // the least about any axis, m l2; 0: nothing to roll against
    float friction[8], rolling_arm[8];       // -; l
    float rolling_weight[8];                 // 1 / rolling_arm^2, or 0
    float normal_impulse[8], impulse[6][8];  // m l; friction, m l, and rolling, m l2
    // The last pass changed the impulses by `change`; `direction` is what passes moved them by, followed so far.
    float normal_change[8], change[6][8];
    float normal_direction[8], direction[6][8];
};

/// How far a pass follows the direction of those before it.
struct Following {
    double share = 0;
    bool keeps = true;  // else the direction is forgotten
};

struct PassResult {
    double largest = 0;  // change of a gap, l
    double size = 0;     // squared length of the change, as displacements weigh it, m l2
};

/// What spares a visit work.
struct BatchForm {
    uint8_t width = kContactLanes;  // contacts are in the first 1, 4 or 8 lanes; what is in others is never read
    bool rigid = false;             // all that they push moves as a whole, and by itself
};

struct ContactArrays {
    RoundMovable* movables;
    RoundPiece* pieces;
    const RoundBegan* began;
    const RoundContact* contacts;
    const uint32_t* contact_of_lane;  // eight a batch
    BatchStart* starts;
    ContactBatch* batches;
    uint8_t* idle;  // batches without impulses, and none to follow
    const BatchForm* form;
};

struct ContactKernels {
    /// Takes contacts into their lanes, and finds what stays while pushes divide as they do.
    void (*describe)(const ContactArrays&, size_t begin, size_t end);
    /// From `starts` and `began`: motion, rolled and missing; nothing to follow; and which are idle.
    void (*start)(const ContactArrays&, size_t begin, size_t end);
    /// Moves things by the impulses that are there.
    void (*give)(const ContactArrays&, size_t begin, size_t end);
    /// One turn of each of these batches: gap >= wanted gap, friction within its cone, rolling resistance within its
    /// bound.
    PassResult (*pass)(const ContactArrays&, const uint32_t* batches, size_t n, Following);
    /// What contacts do with their impulses when their turn comes, for all that they push: it is linear in them.
    void (*follow_movables)(RoundMovable*, float* io_before, float* io_direction, size_t n, Following);
    void (*follow_pieces)(RoundPiece*, float* io_before, float* io_direction, size_t n, Following);
    void (*follow_rigid)(RoundPiece*, float* io_before, float* io_direction, size_t n, Following);
};

// Of a movable, of a piece and of a rigid one, that `follow` follows.
constexpr size_t kMovedNumbers = 4, kPieceMovedNumbers = 12, kRigidMovedNumbers = 4;

extern const ContactKernels kContactKernelsPortable, kContactKernelsAvx2, kContactKernelsAvx512;

/// Those for this processor.
const ContactKernels& contact_kernels();

}  // namespace sunder
