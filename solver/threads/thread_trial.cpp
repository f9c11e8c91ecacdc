#include "solver/threads/thread_trial.h"

#include <algorithm>

namespace sunder {
namespace {

constexpr double kLongFrame = 0.004;    // s; threads always pay, and a trial would be seen
constexpr double kFarSlower = 1.25;     // of the usual time: no need to ask again soon
constexpr int kSoon = 16, kLater = 48;  // frames between trials

}  // namespace

void ThreadTrial::took(double seconds) {
    switch (step_) {
        case Step::usual:
            usual_ = seconds;
            if (seconds > kLongFrame)
                alone_ = false, frames_left_ = kFirst;
            else if (--frames_left_ <= 0)
                step_ = Step::warm_up;
            break;
        case Step::warm_up:
            step_ = Step::trial;
            break;
        case Step::trial:
            tried_ = seconds, step_ = Step::usual_again;
            break;
        case Step::usual_again:
            frames_left_ = tried_ > kFarSlower * std::max(usual_, seconds) ? kLater : kSoon;
            if (tried_ < std::min(usual_, seconds)) alone_ = !alone_;  // its caches were not yet those of the next
            step_ = Step::usual;
            break;
    }
}

}  // namespace sunder
