// State frames on disk: one binary PLY holds one FrameState, bit for bit, and which particles its arrays speak of.
//
//   particle    x y z qw qx qy qz vx vy vz wx wy wz fp00..fp22 yield strain (double), body fragment (int)
//   edge        a b (int), intact (uchar)
//   group       qw qx qy qz: optimal rotation of each particle's group, warm start of the next one (double)
//   rigid_body  x y z qw qx qy qz vx vy vz wx wy wz (double)
//   broken_edge edge (int), time strain (double): broken in the frame that ended here
//   contact     a b (int), px py pz force fx fy fz tx ty tz (double): what the next substep's contacts start from
//   clock       frame (int), time (double); where time is scaled, simulated_frame, time_scale (double); between two
//               frames of the output, frame is a double, too
//   rest        still_time load (double), asleep (uchar): of particles, then rigid bodies
//   rest_condition  low high (int): hashes of what acts on sleepers
//   bending     kp00 ... kp22, layer0 ... layer28 (double): of the same particles; where a body bends by its curvature
//   damage      damage hold (double) of the edges, and stiffness  factor (double) of the particles: where edges fade
//   cause       toughness (double), kind (uchar), by (int): of broken_edge; where edges broke
//   inactive    what (uchar), due glue_due push former_push (double): of the same particles; where something is kept
//   followed    until (double): of the same particles; where something was let go that followed a source
//   offset      bx ... arz (double): of the edges, where b lies and how it is turned in a's group for good, and a in
//               b's; where any is
//   strength    toughness (double): of the same particles, what tears each; where that differs within a body
//   yielding    rate (double): of the same particles, how fast it may flow in the next step; where some did
//
// docs/files.md says more. Yield, due and toughness may be infinite ("never"); every other number is finite.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nodes/files/byte_buffer.h"
#include "nodes/files/scene_time.h"
#include "solver/data/frame_state.h"
#include "solver/data/result.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

/// First comment of every state frame, in all versions of the format; and in this one.
inline constexpr std::string_view kStateFileMark = "sunder state frame ";
inline constexpr std::string_view kStateFileMagic = "sunder state frame 3";
/// The same where a body bends by its curvature, with what is bent for good.
inline constexpr std::string_view kBendingStateFileMagic = "sunder state frame 4";
/// Of a state with damaged edges, whether something bends or not.
inline constexpr std::string_view kDamageStateFileMagic = "sunder state frame 5";
/// Of a frame in which edges broke, with why; whether something bends or is damaged, or not.
inline constexpr std::string_view kCauseStateFileMagic = "sunder state frame 6";
/// Of a state whose time is scaled, whatever else it has: not before it is needed, so that plain shots keep their
/// bytes.
inline constexpr std::string_view kScaledStateFileMagic = "sunder state frame 7";
/// The same between two frames of the output.
inline constexpr std::string_view kSubFrameStateFileMagic = "sunder state frame 8";
/// Before anything slept, and before sleepers knew what lay on them and contacts their torques; both are read as if all
/// were awake.
inline constexpr std::string_view kStateFileMagic1 = "sunder state frame 1", kStateFileMagic2 = "sunder state frame 2";

struct StateFile {
    double frame = 0;
    SceneTime at;
    FrameState state;
    std::vector<uint32_t> body;                  // (n_particles)
    std::vector<uint32_t> fragment;              // (n_particles), of that body
    std::vector<std::array<uint32_t, 2>> edges;  // particles a < b (n_edges)
    std::vector<double> toughness;               // (n_particles), or empty: not told
};

/// `rest` has as many particles and edges as `state` (asserted). `at`: where time is not scaled, the frame itself.
/// `toughness`: of particles, for who looks at the frame; or none.
ByteBuffer encode_state(double frame, const FrameState& state, const SimulationMesh& rest, const SceneTime& at,
                        std::span<const double> toughness = {});
inline ByteBuffer encode_state(double frame, const FrameState& state, const SimulationMesh& rest) {
    return encode_state(frame, state, rest, {frame});
}

/// Errors name `where` and what is wrong: no state frame, of a later format, truncated, an edge without its particles,
/// a number that is not finite.
Result<StateFile> decode_state(std::string bytes, const std::string& where);
Result<StateFile> read_state_file(const std::string& path);

/// Whether a state frame speaks of the particles and edges of `rest`, in that order; the error tells where not.
Status require_same_scene(const StateFile& file, const SimulationMesh& rest, const std::string& where);

}  // namespace sunder
