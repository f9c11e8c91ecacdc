// What broke in a bake, when and why; and what its fragments bore, of those too that did not break.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "nodes/bake_files/break_log.h"
#include "nodes/graph/json_value.h"
#include "solver/data/math.h"
#include "solver/data/result.h"

namespace sunder {

/// Which fragments are asked about; nothing of it given: none.
struct FragmentChoice {
    bool all = false;                 // of those that the rest permits
    std::string body;                 // "": of every body
    std::vector<uint32_t> fragments;  // or no matter which
    std::optional<Aabb> box;          // in which their centres lie at the start, m
    std::string group;                // vertex group that they own vertices of; "": no matter which
    std::optional<int32_t> cluster;   // that they are of

    bool is_empty() const { return !all && fragments.empty() && !box && group.empty() && !cluster; }
};

/// {"all": true, "body": NAME, "fragments": [1, 2], "box": [[x, y, z], [x, y, z]], "group": NAME, "cluster": 3}, each
/// of which may be absent: fragments of which all of these hold. Errors: what is none of these.
Result<FragmentChoice> fragment_choice(const std::string& json);

/// A fragment of those asked about.
struct FragmentReport {
    std::string solver, body;
    FragmentLoad load;
    size_t n_broken = 0;      // of its edges
    double first_broken = 0;  // when the first of them broke, s; 0 if none did
};

/// What cracks of a solver's bodies took, up to the last whole frame.
struct CrackReport {
    std::string solver;
    Cracks cracks;
    std::optional<int> from;  // FragmentLoads::cracks_from
};

struct BreakReport {
    std::array<int, 2> frames = {0, 0};  // baked and logged
    bool is_complete = true;             // all frames that are wanted are there
    std::string note;                    // what the log does not tell; "": nothing
    std::vector<FrameBreaks> breaks;     // by frame and solver, of which something broke
    std::vector<FragmentReport> fragments;
    std::vector<CrackReport> cracks;  // of solvers that have bodies with a fracture energy

    size_t n_broken() const;
    /// Of the edge that broke first, the first of equals; none.
    const LoggedBreak* first() const;
};

/// Reads the log of a bake, complete or not, without the graph's inputs. Errors: no bake; one without a log, of an
/// earlier Sunder; a log that is missing or changed; a choice that is of no fragment.
Result<BreakReport> break_report(const std::filesystem::path& bake, const FragmentChoice& choice);

Json to_json(const BreakReport& report);

}  // namespace sunder
