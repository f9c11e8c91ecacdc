#include "solver/matching/group_energy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "solver/matching/polar_decomposition.h"

namespace sunder {
namespace {

constexpr double kFlat = 1e-6;  // of the largest second moment: a direction without members (as GroupShape's)

double bent_energy(const LiveModel& model, std::span<const MovingParticle> particles, ParticleIndex g) {
    std::vector<BentMember> members(model.live.count(g));
    return bend(model.bending, model.live, particles, g, members).energy();
}

}  // namespace

GroupEnergy::GroupEnergy(const LiveModel& model, ParticleIndex g) : model_(model), group_(g) {
    const LiveTopology& live = model.live;
    if (live.count(g) == 1 || model.is_thin(g)) return;
    Mat3 A_qq = Mat3::Zero();
    for (uint32_t s = live.begin(g); s < live.end(g); ++s)
        A_qq += model.shapes.member_mass(live, s) * model.shapes.member[s].q * model.shapes.member[s].q.transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A_qq);
    const double most = eigen.eigenvalues().maxCoeff();
    Vec3 inverse, flat;
    for (int i = 0; i < 3; ++i) {
        const bool is_flat = !(eigen.eigenvalues()(i) > kFlat * most);
        inverse(i) = is_flat ? 0 : 1 / eigen.eigenvalues()(i), flat(i) = is_flat;
    }
    const Mat3& E = eigen.eigenvectors();
    inverse_ = E * inverse.asDiagonal() * E.transpose(), flat_ = E * flat.asDiagonal() * E.transpose();
    trace_ = A_qq.trace();
}

double GroupEnergy::at(std::span<const MovingParticle> particles, const Quat& start) const {
    const ParticleIndex g = group_;
    const LiveTopology& live = model_.live;
    const GroupShapes& shapes = model_.shapes;
    const GroupShape& shape = shapes.group[g];
    if (model_.bends(g)) return bent_energy(model_, particles, g);
    if (live.count(g) == 1 || model_.is_thin(g)) return 0;
    const GroupMoments A = group_moments(live, shapes, particles, g);
    const Mat3 isotropy = to_matrix(shape.isotropy);
    const Mat3 R =
        optimal_rotation(A.positions * isotropy + kOrientationWeight * A.ellipsoids, start).toRotationMatrix();
    const Mat3 F = A.positions * inverse_ + R * flat_;
    double sum = ((F - R) * to_matrix(shape.stiffness_moment) * (F - R).transpose()).trace();
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        const ParticleId j = live.member(s);
        sum += shapes.member_mass(live, s) * (particles[j].x - A.center - F * shapes.member[s].q).squaredNorm();
        const Mat3 M = to_matrix(shapes.member_moment(live, s));
        sum += 2 * kOrientationWeight * (M.trace() - (particles[j].d.toRotationMatrix() * M * R.transpose()).trace());
    }
    const GroupStiffness& own = model_.stiffness[g];
    const double pressed = (R.transpose() * A.positions * to_matrix(shape.volume_gradient)).trace() - shape.volume_rest;
    return own.k / 2 * (sum + own.volume_ratio / 3 * trace_ * pressed * pressed);
}

}  // namespace sunder
