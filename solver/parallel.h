// Fork and join over ranges. Threads write only their own range, so results do not depend on how many there are.
#pragma once

#include <cstddef>
#include <memory>

namespace sunder {

class WorkerPool {
public:
    /// `threads` >= 1, the calling thread included; 0: all cores.
    explicit WorkerPool(int threads);
    ~WorkerPool();

    int threads() const;

    /// Calls body(begin, end) on contiguous ranges that cover [0, n). Ranges shorter than `grain` are not split off:
    /// a barrier costs a few microseconds, so small work runs on the calling thread.
    template <class Body>
    void for_range(size_t n, size_t grain, const Body& body) const {
        run(
            n, grain, [](const void* b, size_t begin, size_t end) { (*static_cast<const Body*>(b))(begin, end); },
            &body);
    }

private:
    using Call = void (*)(const void* body, size_t begin, size_t end);
    void run(size_t n, size_t grain, Call call, const void* body) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace sunder
