// Exact moments of fragments and interfaces (prefracture.h: measure_fragments).
#include "fracture_tools/fragments/fragment_measures.h"

#include <Eigen/Eigenvalues>
#include <limits>

#include "fracture_tools/fragments/fragment_triangles.h"
#include "fracture_tools/fragments/prefracture.h"

namespace sunder {
namespace {

/// Below this share of the largest moment two principal moments count as equal: the integrals are good to about
/// 1e-12, and a frame that turns with rounding would not be one.
constexpr double kEqualMoments = 1e-9;

/// Sums of the divergence theorem about a reference point near the fragment (no cancellation far from the origin).
struct MomentSums {
    Vec3 reference = Vec3::Zero();
    double volume = 0;           // int 1 dV
    Vec3 first = Vec3::Zero();   // int x dV
    Mat3 second = Mat3::Zero();  // int x x^T dV

    /// Adds the signed tetrahedron (reference, a, b, c):
    /// V = a . (b x c) / 6, int x = V s / 4, int x x^T = V (s s^T + sum x_i x_i^T) / 20 with s = a + b + c.
    void add(const Vec3& world_a, const Vec3& world_b, const Vec3& world_c) {
        const Vec3 a = world_a - reference, b = world_b - reference, c = world_c - reference;
        const double v = a.dot(b.cross(c)) / 6;
        const Vec3 s = a + b + c;
        volume += v;
        first += v / 4 * s;
        second += v / 20 * (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
    }
};

/// The world axis that is least along `n`, made perpendicular to it. Ties go to the first axis.
Vec3 perpendicular_axis(const Vec3& n) {
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(n[k]) < std::abs(n[axis]) - kEqualMoments) axis = k;
    Vec3 p = Vec3::Unit(axis);
    return (p - n * n.dot(p)).normalized();
}

/// One of the two directions of an axis: its largest component is positive. Ties go to the first axis.
Vec3 chosen_sign(const Vec3& n) {
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(n[k]) > std::abs(n[axis]) + kEqualMoments) axis = k;
    return n[axis] < 0 ? Vec3(-n) : n;
}

void measure_interface(const FragmentSet& set, Interface& io_face) {
    if (io_face.triangle_begin == io_face.triangle_end) return;  // joined across a lattice edge: nothing to measure
    const Vec3 reference = set.vertices[set.interface_triangles[io_face.triangle_begin][0]];
    double area = 0;
    Vec3 vector_area = Vec3::Zero(), weighted = Vec3::Zero();
    for (uint32_t t = io_face.triangle_begin; t < io_face.triangle_end; ++t) {
        const auto& [p, q, r] = set.interface_triangles[t];
        const Vec3 a = set.vertices[p] - reference, b = set.vertices[q] - reference, c = set.vertices[r] - reference;
        const Vec3 n = 0.5 * (b - a).cross(c - a);
        area += n.norm();
        vector_area += n;
        weighted += n.norm() / 3 * (a + b + c);
    }
    io_face.area = area;
    io_face.centroid = area > 0 ? Vec3(reference + weighted / area) : reference;
    // An interface that closes around one of its fragments has no mean normal: the centroids' direction stands in.
    if (vector_area.norm() > 1e-9 * area)
        io_face.normal = vector_area.normalized();
    else {
        const Vec3 d = set.fragments[io_face.b.index()].centroid - set.fragments[io_face.a.index()].centroid;
        io_face.normal = d.norm() > 0 ? Vec3(d.normalized()) : Vec3::UnitX();
    }
}

}  // namespace

Quat principal_frame(const Mat3& covariance) {
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(covariance);
    const Vec3 moments = solver.eigenvalues();  // ascending
    const double equal = kEqualMoments * moments[2];
    const bool longest_is_alone = moments[2] - moments[1] > equal, shortest_is_alone = moments[1] - moments[0] > equal;
    Vec3 x, y, z;  // longest first
    if (longest_is_alone) {
        x = chosen_sign(solver.eigenvectors().col(2));
        y = shortest_is_alone ? chosen_sign(solver.eigenvectors().col(1)) : perpendicular_axis(x);
        z = x.cross(y);
    } else if (shortest_is_alone) {
        z = chosen_sign(solver.eigenvectors().col(0));
        x = perpendicular_axis(z);
        y = z.cross(x);
    } else {
        return Quat::Identity();
    }
    Mat3 axes;
    axes << x, y, z;
    Quat q(axes);
    q.normalize();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    return q;
}

void measure_fragments(FragmentSet& io_set) {
    const size_t n = io_set.fragments.size();
    const auto at = [&](uint32_t v) -> const Vec3& { return io_set.vertices[v]; };
    std::vector<Aabb> bounds(n);
    for_each_fragment_triangle(io_set, [&](size_t f, const Triangle& t) {
        for (uint32_t v : t) bounds[f].extend(at(v));
    });
    std::vector<MomentSums> sums(n);
    for (size_t f = 0; f < n; ++f)
        if (bounds[f].min.x() <= bounds[f].max.x()) sums[f].reference = 0.5 * (bounds[f].min + bounds[f].max);
    for_each_fragment_triangle(io_set, [&](size_t f, const Triangle& t) { sums[f].add(at(t[0]), at(t[1]), at(t[2])); });

    std::vector<Mat3> to_frame(n);
    for (size_t f = 0; f < n; ++f) {
        Fragment& fragment = io_set.fragments[f];
        fragment.volume = sums[f].volume;
        fragment.centroid = sums[f].reference;
        fragment.covariance.setZero();
        if (sums[f].volume > 0) {
            const Vec3 mean = sums[f].first / sums[f].volume;
            fragment.centroid += mean;
            fragment.covariance = sums[f].second / sums[f].volume - mean * mean.transpose();
        }
        fragment.orientation = principal_frame(fragment.covariance);
        to_frame[f] = fragment.orientation.conjugate().toRotationMatrix();
    }
    std::vector<Aabb> boxes(n);
    for_each_fragment_triangle(io_set, [&](size_t f, const Triangle& t) {
        for (uint32_t v : t) boxes[f].extend(to_frame[f] * (at(v) - sums[f].reference));
    });
    for (size_t f = 0; f < n; ++f)
        io_set.fragments[f].radii =
            boxes[f].min.x() <= boxes[f].max.x() ? Vec3(0.5 * (boxes[f].max - boxes[f].min)) : Vec3::Zero();
    for (Interface& face : io_set.interfaces) measure_interface(io_set, face);
}

}  // namespace sunder
