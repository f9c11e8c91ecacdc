// Simulated frames, kept within a bound of memory.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "nodes/files/content_key.h"
#include "solver/data/frame_state.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Bytes that a state takes.
size_t memory_of(const FrameState& state);

/// Keeps every frame until `limit` bytes are passed, then every second, every fourth, ... frame and always the first
/// and the newest, so that any frame is at most `stride` steps from a kept one. What was given stays as long as what
/// was given fits, and what was given last whatever it takes: nothing could make it again.
class StateCache {
public:
    struct Entry {
        ContentKey history = 0;  // of all that led to this frame
        std::shared_ptr<const FrameState> state;
        StepReport report;  // of the step that ended here
    };

    void put(int frame, Entry entry, size_t limit);
    /// Puts what was not made of the frames before, and forgets what was made of these since, up to the next that was
    /// given.
    void give(int frame, Entry entry, size_t limit);
    /// The kept entry of exactly this frame, or null.
    const Entry* at(int frame) const;
    /// The latest kept frame that is not after `frame`; false if there is none.
    bool latest(int frame, int& out_frame) const;
    void erase(int frame);
    void clear();

    size_t size() const { return entries_.size(); }
    size_t bytes() const { return bytes_; }

private:
    bool is_given(int frame) const;
    bool is_kept(int frame) const;
    bool is_at_an_end(int frame) const;
    void thin(size_t limit);

    std::map<int, Entry> entries_;
    std::vector<int> given_;  // frames, in the order of the calls
    size_t bytes_ = 0;
    int stride_ = 1;      // 1, 2, 4, ...
    int newest_put_ = 0;  // frame of the latest put, kept whatever the stride
};

}  // namespace sunder
