#include "solver/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace sunder {
namespace {

// Stages follow each other within microseconds: look a while, without troubling the system, then let others run, before
// sleeping.
template <class Done>
void look_for(const Done& done) {
    for (int look = 0; look < 500 && !done(); ++look) {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    }
    for (int look = 0; look < 2000 && !done(); ++look) std::this_thread::yield();
}

}  // namespace

struct WorkerPool::Impl {
    std::vector<std::thread> workers;
    std::atomic<uint32_t> generation{0};  // a new job each time it grows
    std::atomic<int> running{0};          // workers that still work on it
    bool stop = false;

    Call call = nullptr;  // the job, published by `generation`
    const void* body = nullptr;
    size_t n = 0;
    size_t parts = 1;

    void do_part(size_t part) const {
        const size_t begin = n * part / parts, end = n * (part + 1) / parts;
        if (begin < end) call(body, begin, end);
    }

    void serve(size_t part) {
        uint32_t seen = 0;
        for (;;) {
            look_for([&] { return generation.load(std::memory_order_acquire) != seen; });
            generation.wait(seen, std::memory_order_acquire);
            seen = generation.load(std::memory_order_acquire);
            if (stop) return;
            if (part < parts) do_part(part);
            if (running.fetch_sub(1, std::memory_order_acq_rel) == 1) running.notify_one();
        }
    }
};

WorkerPool::WorkerPool(int threads) : impl_(std::make_unique<Impl>()) {
    if (threads <= 0) threads = std::max(1u, std::thread::hardware_concurrency());
    for (int t = 1; t < threads; ++t) impl_->workers.emplace_back([this, t] { impl_->serve(static_cast<size_t>(t)); });
}

WorkerPool::~WorkerPool() {
    impl_->stop = true;
    impl_->generation.fetch_add(1, std::memory_order_release);
    impl_->generation.notify_all();
    for (std::thread& w : impl_->workers) w.join();
}

int WorkerPool::threads() const { return static_cast<int>(impl_->workers.size()) + 1; }

void WorkerPool::run(size_t n, size_t grain, Call call, const void* body) const {
    Impl& p = *impl_;
    const size_t parts = std::min<size_t>(p.workers.size() + 1, n / std::max<size_t>(grain, 1));
    if (parts <= 1) {
        if (n > 0) call(body, 0, n);
        return;
    }
    p.call = call, p.body = body, p.n = n, p.parts = parts;
    p.running.store(static_cast<int>(p.workers.size()), std::memory_order_relaxed);
    p.generation.fetch_add(1, std::memory_order_release);
    p.generation.notify_all();
    p.do_part(0);
    for (int left; (left = p.running.load(std::memory_order_acquire)) > 0;) {
        look_for([&] { return p.running.load(std::memory_order_acquire) == 0; });
        left = p.running.load(std::memory_order_acquire);
        if (left > 0) p.running.wait(left, std::memory_order_acquire);
    }
}

}  // namespace sunder
