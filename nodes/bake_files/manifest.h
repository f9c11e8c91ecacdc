// manifest.json of a bake folder: what was run, and what each frame's files must be.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nodes/files/content_key.h"
#include "nodes/files/file_io.h"
#include "nodes/graph/json.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

class Graph;

inline constexpr const char* kManifestName = "manifest.json";

struct ManifestFile {
    std::string node;  // that wrote it; of a resume state, the solver
    std::string path;  // below the bake folder, forward slashes
    FileStamp stamp;
    bool operator==(const ManifestFile&) const = default;
};

/// What is baked between two frames.
struct ManifestSubFrame {
    double frame = 0;
    std::vector<ManifestFile> files;  // of the bake nodes that have it, in the order of the graph
    bool operator==(const ManifestSubFrame&) const = default;
};

struct ManifestFrame {
    int frame = 0;
    std::vector<ManifestFile> files;            // in the order of the graph's bake nodes
    std::vector<ManifestSubFrame> before = {};  // ascending, since the frame before; of the first one none
    bool operator==(const ManifestFrame&) const = default;

    /// Calls `look(frame, file)` for each file, in the order of time.
    template <class Look>
    void for_each_file(Look&& look) const {
        for (const ManifestSubFrame& sub : before)
            for (const ManifestFile& file : sub.files) look(sub.frame, file);
        for (const ManifestFile& file : files) look(static_cast<double>(frame), file);
    }
};

/// A file that the graph reads.
struct ManifestInput {
    std::string node, parameter, path;  // as the graph names it
    FileStamp stamp;
    bool operator==(const ManifestInput&) const = default;
};

/// What broke and why, from a frame on (break_log.h).
struct ManifestLog {
    int from = 1;                      // an earlier Sunder baked the frames before it
    std::vector<ManifestFile> breaks;  // one for each frame and solver of which something broke, in their order
    std::vector<ManifestFile> loads;   // of each solver of which something can break, up to the last whole frame
    bool operator==(const ManifestLog&) const = default;
};

struct Manifest {
    std::string version = SUNDER_VERSION;  // of the Sunder that baked
    Json graph;                            // as run, defaults written out
    std::vector<ManifestInput> inputs;
    std::map<std::string, ContentKey> keys;   // content key of each node
    std::array<int, 2> frame_range = {1, 1};  // frames wanted, both included
    std::vector<ManifestFrame> frames;        // whole ones, from frame_range[0] on, without a gap
    std::vector<ManifestFile> resume;         // state of each solver at the last whole frame
    std::vector<ManifestFile> exports;        // files of all frames; a stamp of zeros while one is being written
    std::optional<ManifestLog> log;           // none: of a Sunder that kept none

    bool operator==(const Manifest&) const = default;
};

Json to_json(const Manifest& manifest);

/// Errors name `where`: truncated or not JSON, not a manifest, of a later format, a path that leaves the folder, frames
/// with a gap or out of order.
Result<Manifest> parse_manifest(std::string_view text, const std::string& where);
Result<Manifest> read_manifest(const std::filesystem::path& folder);

/// Whether `text` is a manifest of ours, whole or cut off.
bool is_own_manifest(std::string_view text);

/// What a run of `graph` over these frames would have in its manifest before the first frame. Errors: an input file
/// that cannot be read.
Result<Manifest> new_manifest(const Graph& graph, std::array<int, 2> frame_range);

/// What differs between two runs so that their frames would not fit together: version, a node, a parameter with both
/// values, an input file. Empty: nothing. The last frame may differ.
std::vector<std::string> differences(const Manifest& baked, const Manifest& wanted);

struct BakeCheck {
    size_t n_files = 0;
    uint64_t bytes = 0;
    std::vector<std::string> faults;  // sentences, each with its file
    std::vector<int> missing_frames;  // of frame_range, not baked
};

/// Compares every file of a bake with its manifest. Errors: no manifest or one that cannot be understood; cancelled.
Result<BakeCheck> verify_bake(const std::filesystem::path& folder, const Progress& progress = {});

/// The same for a manifest that was read already, without exports: those can be made again from what is verified here.
Result<BakeCheck> verify_files(const Manifest& manifest, const std::filesystem::path& folder,
                               const Progress& progress = {});

/// Whether every export is there as listed. Adds what is wrong to `io_check`.
bool verify_exports(const Manifest& manifest, const std::filesystem::path& folder, BakeCheck& io_check);

/// Files that a bake may have left behind its last whole frame when it was killed.
std::vector<ManifestFile> begun_files(const Manifest& manifest);

}  // namespace sunder
