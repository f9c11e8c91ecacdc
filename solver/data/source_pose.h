// Where a given motion has the fragments of a body, at the frames of an animation and between them.
#pragma once

#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Of a body that follows an animation, at one frame.
struct SourcePose {
    Pose whole = {};             // of all of it, from its rest placement
    std::vector<Pose> own = {};  // of each fragment before `whole` (n_fragments), or empty: none moves within
    /// What of a group's stretch is no strain, F_P: symmetric, det 1 (n_fragments), or empty: all of it is strain.
    std::vector<Mat3> set = {};

    bool operator==(const SourcePose& other) const;
};

/// Takes the mean motion of the fragments, by their masses (kg), out of `own` into `whole`. `rest_center`: of each
/// (n_fragments), m; `center`: their mean.
void gather_whole(std::span<const double> mass, std::span<const Vec3> rest_center, const Vec3& center,
                  SourcePose& io_pose);

/// Where something is at `share` of its way, in [0, 1]: the orientation turns steadily (slerp) and the pivot moves
/// along a straight line.
Pose pose_between(const Pose& begin, const Pose& end, const Vec3& pivot, double share);

/// A motion from one frame to the next: all of it as a whole, about `pivot`, and each fragment within that about its
/// rest position. What turns as a whole is not deformed on its way.
class SourceWay {
public:
    /// Both must outlive it, and have as many fragments.
    SourceWay(const SourcePose& begin, const SourcePose& end, const Vec3& pivot, double share)
        : begin_(begin), end_(end), whole_(pose_between(begin.whole, end.whole, pivot, share)), share_(share) {}

    const Pose& whole() const { return whole_; }
    /// Of a fragment, from its rest placement; unit to rounding.
    Pose pose(uint32_t fragment, const Vec3& rest_position) const;
    /// Of a point that `whole` moves, by where it is at both frames, m.
    Vec3 point(const Vec3& at_begin, const Vec3& at_end) const;

private:
    const SourcePose &begin_, &end_;
    Pose whole_;
    double share_;
};

}  // namespace sunder
