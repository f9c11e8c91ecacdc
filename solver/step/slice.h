// The part of a scene that takes a pass of a step. What else there is stays where the pass before took it: so a hit
// breaks things on within a step, and only what hangs together with the cuts takes it again.
#pragma once

#include <vector>

#include "solver/data/frame_state.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/scene/step_context.h"

namespace sunder {

struct Slice {
    std::vector<uint8_t> kept;  // what does not take this pass (n_movables)
    bool is_again = false;      // there was a pass before, of which these are:
    std::vector<ActiveContact> former_contacts;
    Pieces former_pieces;

    /// Of the first pass: all of it.
    void open(size_t n_movables) { kept.assign(n_movables, 0), is_again = false; }
};

/// What all stages of a pass read.
struct Pass {
    const StepContext& context;
    const StepTime& time;
    const FrameState& state;
    const Slice& slice;
    double flow_seconds;  // for which material is yet to flow in this step: 0 once it has
};

/// Before a pass is taken again: what the last one made of contacts and pieces is the former.
void begin_again(ContactProblem& io_problem, Pieces& io_pieces, Slice& io_slice);

/// Keeps what hangs together with none of these, through edges or contacts as they were before.
void keep_what_is_whole(const StepContext& context, std::span<const ParticleId> weakened, const ContactIslands& islands,
                        const Pieces& pieces, Slice& io_slice);

/// Pieces that are kept are as they were when their contacts were solved.
void take_over_pieces(const StepContext& context, const LiveTopology& live, const Slice& slice, Pieces& io_pieces);

/// What is kept has the impulses that were found for it.
void take_over_contacts(const Slice& slice, std::vector<ActiveContact>& io_contacts);

/// Whether an island has both what is kept and what is not, for what flowed may reach farther: none of it is kept then.
bool let_go_of_mixed_islands(const LiveTopology& live, const ContactIslands& islands, Slice& io_slice);

}  // namespace sunder
