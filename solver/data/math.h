// Small fixed-size types of the whole project. SI units; right-handed; Z up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

namespace sunder {

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;  // unit; files and scripts order it (w, x, y, z)

/// Three vertex indices, counter-clockwise seen from outside.
using Triangle = std::array<uint32_t, 3>;

/// A rigid placement: x -> position + orientation * x.
struct Pose {
    Vec3 position = Vec3::Zero();         // m
    Quat orientation = Quat::Identity();  // unit

    Vec3 apply(const Vec3& local) const { return position + orientation * local; }
    Vec3 inverse_apply(const Vec3& world) const { return orientation.conjugate() * (world - position); }
};

/// Axis-aligned box, m. Empty when min > max.
struct Aabb {
    Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
    Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());

    void extend(const Vec3& p) {
        min = min.cwiseMin(p);
        max = max.cwiseMax(p);
    }
    double diagonal() const { return (max - min).norm(); }
};

/// A symmetric 3x3 matrix: xx, yy, zz, xy, xz, yz.
using Sym3 = std::array<double, 6>;

inline Mat3 to_matrix(const Sym3& s) {
    Mat3 m;
    m << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
    return m;
}
inline Sym3 to_sym(const Mat3& m) { return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)}; }
inline Vec3 product(const Sym3& s, const Vec3& v) {
    return {s[0] * v.x() + s[3] * v.y() + s[4] * v.z(), s[3] * v.x() + s[1] * v.y() + s[5] * v.z(),
            s[4] * v.x() + s[5] * v.y() + s[2] * v.z()};
}

}  // namespace sunder
