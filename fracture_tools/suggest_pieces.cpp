#include "fracture_tools/suggest_pieces.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/mesh_checks.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kErrorOfOneAcross = 0.125, kOrder = 0.78;
constexpr double kMostPieces = 100000;  // as prefracture cuts

}  // namespace

double thinnest_extent(const TriMesh& solid) {
    Vec3 center = Vec3::Zero();
    for (const Vec3& x : solid.positions) center += x / double(solid.positions.size());
    Mat3 spread = Mat3::Zero();
    for (const Vec3& x : solid.positions) spread += (x - center) * (x - center).transpose();
    const Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors();
    Aabb box;
    for (const Vec3& x : solid.positions) box.extend(axes.transpose() * (x - center));
    return std::min((box.max - box.min).minCoeff(), 4 * mesh_volume(solid) / mesh_area(solid));
}

int suggest_pieces(const TriMesh& solid, double error) {
    const double across = math::pow(kErrorOfOneAcross / error, 1 / kOrder), spacing = thinnest_extent(solid) / across;
    const double volume = spacing * spacing * spacing;
    return static_cast<int>(std::clamp(std::ceil(mesh_volume(solid) / volume), 1.0, kMostPieces));
}

}  // namespace sunder
