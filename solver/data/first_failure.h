// What is thrown where nobody could catch it, for whoever waits for the work.
#pragma once

#include <cstddef>
#include <exception>
#include <mutex>
#include <utility>

namespace sunder {

/// The exception of the lowest index, of those that parts of a job threw in any thread. Where a part is only left out
/// once one with a higher index has failed, that is the same one for any number of threads.
class FirstFailure {
public:
    /// Within a handler: keeps what was caught.
    void take(size_t index) noexcept {
        const std::lock_guard lock(guard_);
        if (!exception_ || index < index_) exception_ = std::current_exception(), index_ = index;
    }

    /// Throws what is kept, if there is any, and forgets it. When all parts have ended.
    void rethrow() {
        if (exception_) std::rethrow_exception(std::exchange(exception_, nullptr));
    }

private:
    std::mutex guard_;
    size_t index_ = 0;
    std::exception_ptr exception_;
};

}  // namespace sunder
