// The log of a bake: what broke in a frame and why; and of every fragment the most that it bore so far.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/graph/value.h"
#include "solver/data/result.h"
#include "solver/scene/scene.h"

namespace sunder {

/// What stands first in these files, by which we know ours (and so that of none has to be read to the end for it).
inline constexpr std::string_view kBreaksMark = "{\"format\":\"sunder breaks ",
                                  kLoadsMark = "{\"format\":\"sunder loads ";

/// An edge that broke. Things are told by their nodes' names.
struct LoggedBreak {
    uint32_t edge = 0;                       // of the state
    std::string body;                        // whose edge it is
    std::array<uint32_t, 2> fragments = {};  // of that body, that it joined
    Vec3 position = Vec3::Zero();            // between them as the frame ends, m
    double time = 0, strain = 0;             // s, -; as BrokenEdge
    double toughness = 0;                    // -
    Pusher::Kind by_kind = Pusher::Kind::nothing;
    std::string by;                // what pushed; "": nothing
    uint32_t by_fragment = kNone;  // of a body that pushed
    bool operator==(const LoggedBreak&) const = default;
};

/// "nothing", "body", "rigid_body", "collider" or "seam".
std::string_view kind_name(Pusher::Kind kind);

struct FrameBreaks {
    std::string node;  // the solver
    int frame = 0;
    double time = 0;                // of the frame's end, s
    size_t n_pieces = 0;            // that all bodies of the solver are in as the frame ends
    std::vector<uint32_t> largest;  // of them: fragments, most first, no more than five
    std::vector<LoggedBreak> edges;
    bool operator==(const FrameBreaks&) const = default;
};

/// Where a frame's breaks are told, below the bake's folder.
std::string breaks_path(const std::string& solver, int frame);

FrameBreaks breaks_of(const std::string& solver, const StateValue& state);
std::string encode_breaks(const FrameBreaks& breaks);
/// Errors name `where`: no such file, of a later version, cut off, numbers that mean nothing.
Result<FrameBreaks> decode_breaks(std::string_view text, const std::string& where);

/// A fragment, and where it was strained most for its toughness as frames ended, or when an edge of it broke.
struct FragmentLoad {
    uint32_t body = 0, fragment = 0;  // number in FragmentLoads::bodies; of that body
    Vec3 position = Vec3::Zero();     // at the start, m
    double strain = 0;                // largest principal elastic log strain then, pulled or pressed, -
    double toughness = kNever;        // then, -
    int frame = 0;                    // when; meaningless without strain

    double share() const { return strain / toughness; }
    bool operator==(const FragmentLoad&) const = default;
};

/// Of all bodies of a solver that have a fracture energy.
struct Cracks {
    double taken = 0;         // elastic energy that edges took as they faded, in all frames up to this one, J
    double parted_area = 0;   // of interfaces between pieces, m2
    double faded_area = 0;    // of those within pieces, each by its damage, m2
    double surface_work = 0;  // what those areas take by their fracture energy, J: what a seam weakens by f, f^2 of it
    // Of edges that broke up to this frame, J; none: an earlier Sunder did not keep it, and surface_work has their
    // areas as if no seam had weakened them.
    std::optional<double> broken_work = 0.0;
    bool operator==(const Cracks&) const = default;
};

/// What fragments of a body are chosen by, beside their numbers.
struct FragmentParts {
    std::vector<int32_t> clusters;                        // of each fragment; empty: all are of cluster 0
    std::map<std::string, std::vector<uint32_t>> groups;  // fragments of each vertex group, ascending
    bool operator==(const FragmentParts&) const = default;
};

struct FragmentLoads {
    std::string node;  // the solver
    int frame = 0;     // the last that is counted in
    std::vector<std::string> bodies;
    std::vector<FragmentParts> parts;  // of `bodies`; empty: unknown, in a log of an earlier Sunder
    std::vector<FragmentLoad> of;      // in the order of particles
    std::optional<Cracks> cracks;      // none: no body has a fracture energy
    std::optional<int> cracks_from;    // what they took before this frame is not counted; none: all is
    bool goes_on = false;              // from frames in which nothing could break: none of them is missing
    bool operator==(const FragmentLoads&) const = default;

    /// Whether anything in it can break.
    bool matter() const;
};

/// Counts a whole frame in.
void add_loads(const StateValue& state, FragmentLoads& io_loads);
std::string encode_loads(const FragmentLoads& loads);
/// Errors: as decode_breaks.
Result<FragmentLoads> decode_loads(std::string_view text, const std::string& where);

}  // namespace sunder
