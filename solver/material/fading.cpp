#include "solver/material/fading.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

constexpr double kLeft = 0.02;  // of an edge that bears no more of its toughness, all is gone

double tension_of(const Mat3& strain, const Vec3& normal, double nu, double least) {
    const Mat3 stress =
        strain / (1 + nu) + nu / ((1 + nu) * (1 - 2 * nu)) * strain.trace() * Mat3::Identity();  // over E
    if (!((stress * normal).squaredNorm() >= least * least)) return 0;
    const Eigen::SelfAdjointEigenSolver<Mat3> principal(stress);
    Vec3 pull = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
        const Vec3 q = principal.eigenvectors().col(i);
        pull += std::max(principal.eigenvalues()(i), 0.0) * q.dot(normal) * q;
    }
    return pull.norm();
}

// Of a beam of length d0 whose ends move against one another by d across it and do not turn, faces are strained by
// 3 t / d0 times d / d0.
constexpr double kOfClampedBeam = 3;

// What of a displacement `r` (over d0) across the edge shears, and by how much the rest strains the faces.
struct Across {
    Vec3 shear = Vec3::Zero();
    double at_faces = 0;
};

Across across(const GroupStretch& group, const Vec3& r, double d0) {
    Across of;
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = group.axes.col(i);
        const double share = kOfClampedBeam * group.extent(i) / d0, part = r.dot(axis);
        if (share < 1)
            of.at_faces += share * std::abs(part);
        else
            of.shear += part * axis;
    }
    return of;
}

}  // namespace

void add_fading(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state) {
    const auto has_one = [](const Material& m) { return m.fracture_energy < kNever; };
    if (!io_state.edge_damage.empty() || rest.n_edges() == 0 || std::ranges::none_of(materials, has_one)) return;
    io_state.edge_damage.assign(rest.n_edges(), 0.0), io_state.edge_hold.assign(rest.n_edges(), 1.0);
    io_state.stiffness_factor.assign(rest.n_particles(), 1.0);
}

Vec3 StretchedEdge::displacement() const {
    return 0.5 * (rotation_a.conjugate() * present + rotation_b.conjugate() * present) - rest;
}

double tension(const StretchedEdge& edge, const GroupStretch& a, const GroupStretch& b, double nu, double least) {
    const double d0 = edge.rest.norm();
    const Vec3 n = edge.rest / d0, u = edge.displacement() / d0;
    const Mat3 mean = 0.5 * (a.mean + b.mean);
    Mat3 bent = 0.5 * (a.bent + b.bent);
    Vec3 r = u - mean * n;
    const bool is_thin = a.extent.minCoeff() < kNever || b.extent.minCoeff() < kNever;
    if (is_thin) {
        const Vec3 along = r.dot(n) * n;
        const Across at_a = across(a, r - along, d0), at_b = across(b, r - along, d0);
        r = along + 0.5 * (at_a.shear + at_b.shear);
        const double at_faces = 0.5 * (at_a.at_faces + at_b.at_faces);
        bent += (n.dot(bent * n) < 0 ? -at_faces : at_faces) * n * n.transpose();
    }
    const Mat3 own = mean + r * n.transpose() + n * r.transpose() - r.dot(n) * n * n.transpose();
    if (!is_thin) return tension_of(own, n, nu, least);
    return std::max(tension_of(own + bent, n, nu, least), tension_of(own - bent, n, nu, least));
}

double fading_tension(double damage, double toughness, double length, double d0) {
    const double of_end = 1 / (1 + length / d0), end = toughness / of_end;
    const double rises = toughness / ((1 - damage) * (1 - of_end) + of_end), parts = end - kLeft * (end - toughness);
    return parts < rises ? parts : rises;
}

double damage(double tension, double toughness, double length, double d0) {
    if (!(tension > toughness)) return 0;
    const double end = toughness * (1 + length / d0);
    if (tension >= end) return 1;
    if (end == kNever) return 1 - toughness / tension;
    const double left = (end - tension) / (end - toughness);  // of the stress that it bore, -
    return left > kLeft ? 1 - toughness / tension * left : 1;
}

}  // namespace sunder
