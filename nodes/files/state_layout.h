// Which elements and properties a state frame has, by the version of its format (state_file.h).
#pragma once

#include <string_view>
#include <vector>

#include "nodes/files/ply_file.h"
#include "nodes/files/state_file.h"

namespace sunder {

inline constexpr size_t kParticleDoubles = 13 + 9 + 2, kOffsetDoubles = 12;
inline constexpr size_t kBendingDoubles = 9 + std::tuple_size_v<LayerStrain>;

inline bool knows_scale(std::string_view version) {
    return version == kScaledStateFileMagic || version == kSubFrameStateFileMagic;
}
inline bool knows_cause(std::string_view version) { return version == kCauseStateFileMagic || knows_scale(version); }
inline bool knows_damage(std::string_view version) { return version == kDamageStateFileMagic || knows_cause(version); }
inline bool knows_bending(std::string_view version) {
    return version == kBendingStateFileMagic || knows_damage(version);
}
inline bool knows_rest(std::string_view version) { return version == kStateFileMagic || knows_bending(version); }

/// The elements in file order; counts are filled in by the writer and taken over from a file by the reader.
std::vector<PlyElement> state_elements(std::string_view version);

/// What a file of any version may end with, in this order, each where its scene has such.
std::vector<PlyElement> last_state_elements();

}  // namespace sunder
