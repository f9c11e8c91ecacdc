// Writes the frames of a bake while the next ones are simulated.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "nodes/bake.h"
#include "nodes/bake_files/bake_folder.h"
#include "nodes/bake_files/break_log.h"
#include "nodes/bake_files/manifest.h"
#include "nodes/files/byte_buffer.h"
#include "nodes/graph/value.h"

namespace sunder {

/// What is to be written of a frame, or of what lies between two: `between` tells where, and the items of nodes that
/// have nothing there are null. Values are const and shared: whoever made them may go on.
struct FrameToWrite {
    std::vector<std::shared_ptr<const BakeItem>> items;     // of each bake node
    std::vector<std::shared_ptr<const StateValue>> states;  // of each solver
    std::vector<FragmentLoads> loads;                       // likewise
    BakedFrame done;                                        // number and times so far
    std::optional<double> between = {};
};

/// A thread that encodes, hashes, writes and syncs one frame after the other, each whole and then listed in the
/// manifest, in the order in which they came; what lies between two frames is listed with the later one, and removed
/// again if that does not come. At most kWaiting of them wait, so memory is bounded by that many frames
/// and the one that is being written; a simulation that is faster than the disk waits for it.
class FrameWriter {
public:
    static constexpr size_t kWaiting = 2;

    /// `bake_nodes`, `solvers`: names, in the order of a frame's items and states. The manifest is the writer's until
    /// `finish` has returned.
    FrameWriter(const BakeFolder& folder, Manifest& manifest, std::vector<std::string> bake_nodes,
                std::vector<std::string> solvers);
    /// Writes what waits.
    ~FrameWriter();

    /// Waits for a place. Errors: that of a frame put earlier, whose file it names; that frame is not listed and
    /// nothing is written any more.
    Status put(FrameToWrite frame);
    /// Waits until all is on disk. Errors: as of `put`.
    Status finish();
    /// Frames that came on disk since the last call.
    std::vector<BakedFrame> take_done();

private:
    void work();
    Status write(FrameToWrite& io_frame);
    Status write_between(const FrameToWrite& frame);
    /// Lists a frame whose files are on disk, the items first.
    Status list(const FrameToWrite& frame, const std::vector<ManifestFile>& written);
    /// Which of the frame's items is the solver's state, n_items: none.
    size_t baked_state(size_t solver, const FrameToWrite& frame) const;
    /// File of our own for what the next frame replaces: the state of a solver that no item is ("ply"), and its
    /// fragments' loads ("loads.json").
    std::string own_path(size_t solver, int frame, const std::string& ending) const;

    const BakeFolder& folder_;
    Manifest& manifest_;
    const std::vector<std::string> bake_nodes_, solvers_;

    std::mutex guard_;  // of all below
    std::condition_variable changed_;
    std::deque<FrameToWrite> waiting_;
    std::vector<BakedFrame> done_;
    Status status_;
    bool is_writing_ = false, is_ending_ = false;

    // Of the thread: what is on disk between the frame listed last and the next one.
    std::vector<ManifestSubFrame> between_;
    BakedFrame of_between_;
    std::thread thread_;  // last: it starts when all else is there
};

}  // namespace sunder
