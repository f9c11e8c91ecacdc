// Several tasks at once, each of which asks for threads by itself.
#pragma once

#include <cstddef>
#include <functional>

#include "fracture_tools/mesh/range_runner.h"

namespace sunder {

/// Calls task(i, run) for i in [0, n), each once: one task a thread as long as there are tasks; then threads without
/// one join the loops of those that are still at work. Threads go through the tasks in order, each from a place of its
/// own, the same in every call: so that a thread finds what it wrote for the same task before. A task's loops (the
/// `run` that it is given; no loop within another) are split no more than `run` would split them. Fewer joins than if
/// all threads worked on one task after the other, and what a task writes and reads again stays with one processor.
/// What a body of a loop throws reaches the task that asked for the loop; what a task throws is thrown again here when
/// all have ended, of several tasks' the first.
void run_side_by_side(size_t n, const RangeRunner& run,
                      const std::function<void(size_t i, const RangeRunner& run)>& task);

}  // namespace sunder
