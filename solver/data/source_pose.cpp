#include "solver/data/source_pose.h"

#include <algorithm>

#include "solver/data/rotations.h"

namespace sunder {
namespace {

bool same(const Pose& a, const Pose& b) {
    return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

bool SourcePose::operator==(const SourcePose& o) const {
    return same(whole, o.whole) && std::ranges::equal(own, o.own, same) && set == o.set;
}

void gather_whole(std::span<const double> mass, std::span<const Vec3> rest_center, const Vec3& center,
                  SourcePose& pose) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    Vec3 mean = Vec3::Zero();
    double total = 0;
    const Eigen::Vector4d first = pose.own.front().orientation.coeffs();
    for (size_t f = 0; f < pose.own.size(); ++f) {
        const Eigen::Vector4d q = pose.own[f].orientation.coeffs();
        sum += (q.dot(first) < 0 ? -mass[f] : mass[f]) * q;
        mean += mass[f] * pose.own[f].apply(rest_center[f]), total += mass[f];
    }
    const Quat turn = sum.norm() > 0 ? Quat(Eigen::Vector4d(sum / sum.norm())) : pose.own.front().orientation;
    pose.whole = {mean / total - turn * center, turn};
    for (Pose& own : pose.own)
        own = {turn.conjugate() * (own.position - pose.whole.position),
               (turn.conjugate() * own.orientation).normalized()};
}

Pose pose_between(const Pose& begin, const Pose& end, const Vec3& pivot, double share) {
    const Vec3 from = begin.apply(pivot), to = end.apply(pivot);
    const Quat orientation = slerp(begin.orientation, share, end.orientation);
    return {from + share * (to - from) - orientation * pivot, orientation};
}

Pose SourceWay::pose(uint32_t fragment, const Vec3& rest_position) const {
    if (begin_.own.empty()) return {whole_.position, whole_.orientation.normalized()};
    const Pose own = pose_between(begin_.own[fragment], end_.own[fragment], rest_position, share_);
    return {whole_.apply(own.position), (whole_.orientation * own.orientation).normalized()};
}

Vec3 SourceWay::point(const Vec3& at_begin, const Vec3& at_end) const {
    const Vec3 from = begin_.whole.inverse_apply(at_begin), to = end_.whole.inverse_apply(at_end);
    return whole_.apply(from + share_ * (to - from));
}

}  // namespace sunder
