// Whether a small scene is faster without other threads.
#pragma once

namespace sunder {

/// What one thread writes and another reads costs more or less by where the machine has put the two, and a small scene
/// may lose by it what it gains. Clocks alone can tell: now and then two frames are worked on the other way, and the
/// second of them, to which threads come awake, is compared with the frames around. No bit depends on it.
class ThreadTrial {
public:
    /// Whether the next frame is for the calling thread alone.
    bool alone() const { return alone_ != (step_ == Step::warm_up || step_ == Step::trial); }

    /// What that frame took, s.
    void took(double seconds);

private:
    static constexpr int kFirst = 4;  // frames before the first trial

    enum class Step { usual, warm_up, trial, usual_again };

    bool alone_ = false;  // as a rule
    Step step_ = Step::usual;
    int frames_left_ = kFirst;  // until the next trial
    double usual_ = 0, tried_ = 0;
};

}  // namespace sunder
