// Work in chunks over a few threads, for cutters.
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "solver/data/progress.h"

namespace sunder {

/// Calls body(chunk, begin, end) for chunks of `chunk_size` that cover [0, n), on `threads` threads (0: all cores), the
/// calling one included. Chunks do not depend on the number of threads: whoever writes only what belongs to its chunk
/// gets the same bits with any. Progress is reported from the calling thread; false: cancelled, chunks are missing. An
/// exception of the body is thrown again here.
template <class Body>
bool for_chunks(size_t n, size_t chunk_size, int threads, const Progress& progress, std::string_view text,
                const Body& body) {
    const size_t n_chunks = (n + chunk_size - 1) / chunk_size;
    const size_t cores = threads > 0 ? static_cast<size_t>(threads) : std::max(1u, std::thread::hardware_concurrency());
    std::atomic<size_t> next = 0;
    std::atomic<bool> stop = false;
    std::exception_ptr failure;
    std::mutex failure_guard;
    auto work = [&](bool reports) {
        try {
            for (size_t chunk; !stop && (chunk = next++) < n_chunks;) {
                if (reports && !progress.report(double(chunk) / double(n_chunks), text)) stop = true;
                if (!stop) body(chunk, chunk * chunk_size, std::min(n, (chunk + 1) * chunk_size));
            }
        } catch (...) {
            stop = true;
            const std::lock_guard lock(failure_guard);
            if (!failure) failure = std::current_exception();
        }
    };
    {
        std::vector<std::jthread> helpers;
        for (size_t k = 1; k < std::min(cores, n_chunks); ++k) helpers.emplace_back(work, false);
        work(true);
    }
    if (failure) std::rethrow_exception(failure);
    return !stop;
}

}  // namespace sunder
