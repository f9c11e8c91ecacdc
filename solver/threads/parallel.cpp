#include "solver/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace sunder {
namespace {

// Stages follow each other within microseconds: look a while, without troubling the system, then let others run (who
// may be the very thread that is waited for, if it shares the core), before sleeping.
template <class Done>
void look_for(const Done& done) {
    for (int look = 0; look < 40 && !done(); ++look) {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    }
    for (int look = 0; look < 2000 && !done(); ++look) std::this_thread::yield();
}

}  // namespace

struct WorkerPool::Impl {
    // A worker's: a part is open until the worker takes it, or the caller takes it back.
    enum : uint32_t { kIdle, kOpen, kTaken, kStop };
    struct alignas(64) Seat {
        std::atomic<uint32_t> state{kIdle};
        std::thread worker;

        // In sequence with a look at who sleeps, so that nobody is left asleep.
        void tell(uint32_t now) {
            state.store(now, std::memory_order_seq_cst);
            state.notify_one();
        }
    };
    std::vector<Seat> seats;

    Call call = nullptr;  // the job, published by open seats
    const void* body = nullptr;
    size_t n = 0;
    size_t parts = 1;
    FirstFailure failure;

    explicit Impl(size_t workers) : seats(workers) {}

    void do_part(size_t part) {
        const size_t begin = n * part / parts, end = n * (part + 1) / parts;
        try {
            if (begin < end) call(body, begin, end);
        } catch (...) {
            failure.take(part);
        }
    }

    void serve(size_t part) {
        Seat& seat = seats[part - 1];
        for (;;) {
            look_for([&] { return seat.state.load(std::memory_order_acquire) != kIdle; });
            seat.state.wait(kIdle, std::memory_order_acquire);
            uint32_t now = kOpen;
            if (seat.state.compare_exchange_strong(now, kTaken, std::memory_order_acquire)) {
                do_part(part);
                seat.tell(kIdle);
            } else if (now == kStop) {
                return;
            }
        }
    }
};

WorkerPool::WorkerPool(int threads) {
    if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    impl_ = std::make_unique<Impl>(static_cast<size_t>(threads - 1));
    for (size_t t = 1; t < static_cast<size_t>(threads); ++t)
        impl_->seats[t - 1].worker = std::thread([this, t] { impl_->serve(t); });
}

WorkerPool::~WorkerPool() {
    for (Impl::Seat& seat : impl_->seats) seat.tell(Impl::kStop);
    for (Impl::Seat& seat : impl_->seats) seat.worker.join();
}

int WorkerPool::threads() const { return static_cast<int>(impl_->seats.size()) + 1; }

// Which part is whose is settled beforehand, and with it which caches hold what; but a part whose worker sleeps, or has
// no core to run on, is not waited for.
void WorkerPool::run(size_t n, size_t grain, Call call, const void* body) const {
    Impl& p = *impl_;
    const size_t parts = std::min<size_t>(p.seats.size() + 1, n / std::max<size_t>(grain, 1));
    if (parts <= 1) {
        if (n > 0) call(body, 0, n);
        return;
    }
    p.call = call, p.body = body, p.n = n, p.parts = parts;
    for (size_t part = 1; part < parts; ++part) p.seats[part - 1].tell(Impl::kOpen);
    p.do_part(0);
    for (size_t part = 1; part < parts; ++part) {
        uint32_t now = Impl::kOpen;
        if (p.seats[part - 1].state.compare_exchange_strong(now, Impl::kIdle, std::memory_order_acquire))
            p.do_part(part);
    }
    for (size_t part = 1; part < parts; ++part) {
        const std::atomic<uint32_t>& state = p.seats[part - 1].state;
        look_for([&] { return state.load(std::memory_order_acquire) == Impl::kIdle; });
        for (uint32_t now; (now = state.load(std::memory_order_acquire)) != Impl::kIdle;)
            state.wait(now, std::memory_order_acquire);
    }
    p.failure.rethrow();
}

}  // namespace sunder
