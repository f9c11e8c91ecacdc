#include "fracture_tools/skin/vertex_motion.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/math_functions.h"
#include "solver/data/rotations.h"

namespace sunder {
namespace {

// Of a fragment's half extent along each of its axes, how far its skin has to spread (root mean square) to tell how it
// is stretched there: a cube's own six faces spread by 0.75, two faces of a sheet by 1 across it.
constexpr double kLeastSpread = 0.3;
// How much rather a fit is straight than curved, over the spread of its points: what these do not tell is not curved.
constexpr double kStraight = 1e-3;
constexpr double kSingular = 1e-12;   // the same, of a fit that points on a plane do not tell; beside rounding
constexpr double kFlat = 0.02;        // a principal stretch below: the fragment is squeezed flat
constexpr double kFits = 0.1;         // of the mesh's diagonal: how far a body's surface may lie from it
constexpr double kOnTheMesh = 1e-9;   // of the same: how far what lies on it may, by rounding
constexpr double kRegular = 1e-6;     // share of a ring's spread that stays as its fragment turns
constexpr double kNearAFrame = 1e-9;  // of a frame: a moment that is one but for rounding

struct Polar {
    Mat3 turn, stretch;  // A = turn * stretch
    bool is_flat, is_inside_out;
};

Polar polar(const Mat3& A) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A.transpose() * A);
    const Vec3 s = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
    const Mat3& V = eigen.eigenvectors();
    const Vec3 inverse = s.cwiseMax(1e-12).cwiseInverse();
    return {A * V * inverse.asDiagonal() * V.transpose(), V * s.asDiagonal() * V.transpose(), !(s.minCoeff() > kFlat),
            A.determinant() < 0};
}

double diagonal_of(std::span<const Vec3> points) {
    Aabb box;
    for (const Vec3& p : points) box.extend(p);
    return box.diagonal();
}

using SkinArea = std::vector<std::pair<uint32_t, double>>;  // pool vertices, ascending, and the area of each, m2

// What each fragment has of the outer surface.
std::vector<SkinArea> skins_of(const FragmentSet& set) {
    std::vector<SkinArea> skins;
    for (const Fragment& f : set.fragments) {
        std::map<uint32_t, double> area;
        for (uint32_t t = f.outer_begin; t < f.outer_end; ++t) {
            const auto& [a, b, c] = set.outer_triangles[t];
            const Vec3 &p = set.vertices[a], &q = set.vertices[b], &r = set.vertices[c];
            const double third = (q - p).cross(r - p).norm() / 6;
            for (const uint32_t v : {a, b, c}) area[v] += third;
        }
        skins.emplace_back(area.begin(), area.end());
    }
    return skins;
}

PointCloud cloud_of(const std::map<uint32_t, double>& weight, std::span<const Vec3> vertex) {
    PointCloud cloud;
    for (const auto& [v, w] : weight) cloud.weight += w, cloud.mean += w * vertex[v];
    if (!(cloud.weight > 0)) return cloud;
    cloud.mean /= cloud.weight;
    for (const auto& [v, w] : weight) {
        const Vec3 q = vertex[v] - cloud.mean;
        cloud.spread += (w / cloud.weight) * q * q.transpose();
    }
    return cloud;
}

// 1, x, y, z, and their products.
template <int n>
using Terms = Eigen::Matrix<double, 10, n>;

Terms<1> terms_of(const Vec3& x) {
    Terms<1> terms;
    terms << 1, x.x(), x.y(), x.z(), x.x() * x.x(), x.y() * x.y(), x.z() * x.z(), x.y() * x.z(), x.z() * x.x(),
        x.x() * x.y();
    return terms;
}

bool spans(const PointCloud& cloud, const SimulationMesh& rest, uint32_t fragment) {
    if (!(cloud.weight > 0)) return false;
    const Mat3 axes = rest.rest_orientation[fragment].toRotationMatrix();
    const Mat3 scale = rest.radii[fragment].cwiseInverse().asDiagonal();
    const Mat3 seen = scale * axes.transpose() * cloud.spread * axes * scale;
    return Eigen::SelfAdjointEigenSolver<Mat3>(seen, Eigen::EigenvaluesOnly).eigenvalues()[0] >=
           kLeastSpread * kLeastSpread;
}

}  // namespace

Result<std::shared_ptr<const VertexMotion>> VertexMotion::make(const CutBody& body, const TriMesh& mesh,
                                                               VertexFrames frames, SourceStrain strain,
                                                               std::span<const uint32_t> fragments) {
    if (Status ok = frames.check(mesh.positions.size()); !ok) return ok.error();
    std::shared_ptr<VertexMotion> motion(new VertexMotion());
    motion->frames_ = std::move(frames), motion->strain_ = strain, motion->triangles_ = mesh.triangles;
    motion->rest_center_ = body.rest.rest_position, motion->mass_ = body.rest.mass;
    motion->ring_offset_ = body.rest.group_offset, motion->ring_member_ = body.rest.group_member;
    motion->is_told_.assign(body.rest.n_particles(), fragments.empty());
    for (const uint32_t f : fragments) motion->is_told_[f] = 1;
    double mass = 0;
    for (size_t i = 0; i < motion->mass_.size(); ++i)
        mass += motion->mass_[i], motion->center_ += motion->mass_[i] * motion->rest_center_[i];
    motion->center_ /= mass;
    if (Status ok = motion->tie(body, mesh); !ok) return ok.error();
    motion->fit(body);
    return std::shared_ptr<const VertexMotion>(std::move(motion));
}

Status VertexMotion::tie(const CutBody& body, const TriMesh& mesh) {
    tie_.resize(body.fragments.vertices.size());
    const double diagonal = diagonal_of(mesh.positions);
    const SurfaceLookup lookup{MeshView(mesh)};
    for (uint32_t f = 0; f < body.fragments.fragments.size(); ++f) {
        const Fragment& fragment = body.fragments.fragments[f];
        for (uint32_t t = fragment.outer_begin; t < fragment.outer_end; ++t)
            for (const uint32_t v : body.fragments.outer_triangles[t]) {
                Tie& tie = tie_[v];
                if (tie.triangle != kNone) continue;
                const Vec3& x = body.fragments.vertices[v];
                const SurfacePoint near = lookup.nearest(x);
                if (!(near.distance <= kFits * diagonal))
                    return bad_input("mesh",
                                     "it is not the one that the body was cut from: the body's surface lies " +
                                         std::to_string(near.distance) + " m from it",
                                     "wire the same mesh");
                tie = {near.triangle, f, near.barycentric, Vec3::Zero()};
                if (near.distance > kOnTheMesh * diagonal) tie.offset = body.pose.orientation * (x - near.position);
            }
    }
    return {};
}

void VertexMotion::fit(const CutBody& body) {
    const std::vector<SkinArea> skin = skins_of(body.fragments);
    std::vector<Vec3> point;
    for (size_t v = 0; v < tie_.size(); ++v)
        point.push_back(body.pose.apply(body.fragments.vertices[v]) - tie_[v].offset);
    sample_begin_.assign(1, 0);
    for (uint32_t f = 0; f < skin.size(); ++f) {
        fit_fragment(body.rest, skin, point, f);
        sample_begin_.push_back(static_cast<uint32_t>(sample_.size()));
    }
}

void VertexMotion::fit_fragment(const SimulationMesh& rest, std::span<const SkinArea> skin, std::span<const Vec3> point,
                                uint32_t f) {
    std::vector<uint8_t> asked(skin.size(), 0);
    std::vector<uint32_t> ring = {f};
    asked[f] = 1;
    std::map<uint32_t, double> weight;
    PointCloud cloud;
    while (!ring.empty()) {
        for (const uint32_t g : ring)
            for (const auto& [v, area] : skin[g]) weight[v] += area;
        cloud = cloud_of(weight, point);
        if (spans(cloud, rest, f)) break;
        std::vector<uint32_t> next;
        for (const uint32_t g : ring)
            for (uint32_t s = ring_offset_[g]; s < ring_offset_[g + 1]; ++s)
                if (const uint32_t h = ring_member_[s]; !asked[h]) asked[h] = 1, next.push_back(h);
        ring = std::move(next);
    }
    if (!spans(cloud, rest, f)) {  // what it hangs together with has no thickness: all of the body is asked
        for (uint32_t g = 0; g < skin.size(); ++g)
            for (const auto& [v, area] : skin[g])
                if (!asked[g]) weight[v] += area;
        cloud = cloud_of(weight, point);
    }
    add_samples(rest.rest_position[f], weight, cloud, point);
}

// What a fit says of the fragment's centre is linear in where the vertices are.
void VertexMotion::add_samples(const Vec3& center, const std::map<uint32_t, double>& weight, const PointCloud& cloud,
                               std::span<const Vec3> point) {
    const double size = std::sqrt(cloud.spread.trace());
    const auto terms_at = [&](const Vec3& x) { return terms_of((x - center) / size); };
    Terms<10> normal = Terms<10>::Identity() * kSingular;
    normal(0, 0) = 0;
    for (int k = 4; k < 10; ++k) normal(k, k) = kStraight;
    for (const auto& [v, w] : weight) {
        const Terms<1> terms = terms_at(point[v]);
        normal += (w / cloud.weight) * terms * terms.transpose();
    }
    const Terms<10> inverse = normal.ldlt().solve(Terms<10>::Identity());
    for (const auto& [v, w] : weight) {
        const Terms<1> told = (w / cloud.weight) * (inverse * terms_at(point[v]));
        sample_.push_back({v, told[0], Vec3(told.segment<3>(1)) / size});
    }
}

Vec3 VertexMotion::on_mesh(size_t k, const Tie& tie) const {
    const Triangle& t = triangles_[tie.triangle];
    return tie.weight[0] * frames_.at(k, t[0]) + tie.weight[1] * frames_.at(k, t[1]) +
           tie.weight[2] * frames_.at(k, t[2]);
}

Result<SourcePose> VertexMotion::pose_at(size_t k) const {
    std::vector<Vec3> vertex(tie_.size());
    for (size_t v = 0; v < tie_.size(); ++v)
        if (tie_[v].triangle != kNone) vertex[v] = on_mesh(k, tie_[v]);
    const size_t n = rest_center_.size();
    SourcePose pose;
    std::vector<Vec3> position(n);
    std::vector<Mat3> turn(n);
    for (size_t f = 0; f < n; ++f) {
        Vec3 center = Vec3::Zero();
        Mat3 A = Mat3::Zero();
        const std::span samples(sample_.data() + sample_begin_[f], sample_.data() + sample_begin_[f + 1]);
        for (const Sample& s : samples) {
            center += s.share * vertex[s.vertex], A += vertex[s.vertex] * s.gradient.transpose();
        }
        const Polar of = polar(A);
        if (is_told_[f] && (of.is_flat || of.is_inside_out)) {
            const Tie& near = tie_[samples.front().vertex];
            return bad_input("motion",
                             "fragment " + std::to_string(f) + ", about vertex " +
                                 std::to_string(triangles_[near.triangle][0]) + " of the mesh, is " +
                                 (of.is_flat ? "squeezed flat" : "turned inside out") + " at frame " +
                                 std::to_string(frames_.first_frame + static_cast<int>(k)),
                             "let it go earlier, or mend the animation there");
        }
        turn[f] = of.turn;
        position[f] = center;
        const Quat q = Quat(of.turn).normalized();
        pose.own.push_back({position[f] - q * rest_center_[f], q});
    }
    if (strain_ == SourceStrain::all_is_rest) pose.set = set_of(position, turn);
    gather_whole(mass_, rest_center_, center_, pose);
    return pose;
}

// The stretch of each group's best affine map, of which what its ring does not tell turns as its fragment does; det 1,
// as material flows.
std::vector<Mat3> VertexMotion::set_of(std::span<const Vec3> position, std::span<const Mat3> turn) const {
    std::vector<Mat3> set;
    for (size_t f = 0; f < position.size(); ++f) {
        const auto ring = std::span(ring_member_).subspan(ring_offset_[f], ring_offset_[f + 1] - ring_offset_[f]);
        Vec3 rest_mean = Vec3::Zero(), mean = Vec3::Zero();
        double mass = 0;
        for (const ParticleId j : ring)
            mass += mass_[j], rest_mean += mass_[j] * rest_center_[j], mean += mass_[j] * position[j];
        rest_mean /= mass, mean /= mass;
        Mat3 qq = Mat3::Zero(), moved = Mat3::Zero();
        for (const ParticleId j : ring) {
            const Vec3 q = rest_center_[j] - rest_mean, y = position[j] - mean;
            qq += mass_[j] * q * q.transpose(), moved += mass_[j] * (y - turn[f] * q) * q.transpose();
        }
        const double trace = qq.trace();
        Mat3 F = Mat3::Identity();
        if (trace > 0) {
            const Mat3 A = turn[f] + moved * (qq + Mat3((kRegular * trace) * Mat3::Identity())).inverse();
            const Polar of = polar(A);
            if (!of.is_flat && !of.is_inside_out) F = of.stretch / math::cbrt(of.stretch.determinant());
        }
        set.push_back((F + F.transpose()) / 2);
    }
    return set;
}

Result<VertexMotion::Moment> VertexMotion::moment(double frame) const {
    Moment moment;
    const double nearest = std::round(frame);
    const bool is_one = std::abs(frame - nearest) < kNearAFrame;
    moment.frame = static_cast<int>(is_one ? nearest : std::floor(frame));
    moment.share = is_one ? 0 : frame - moment.frame;
    const auto begin = at_frame(moment.frame);
    if (!begin) return begin.error();
    const auto end = is_one ? begin : at_frame(moment.frame + 1);
    if (!end) return end.error();
    moment.begin = *begin, moment.end = *end;
    return moment;
}

void VertexMotion::place(const Moment& moment, std::vector<Vec3>& out) const {
    out.resize(tie_.size(), Vec3::Zero());
    const size_t a = index_of(moment.frame), b = index_of(moment.frame + 1);
    const SourceWay way = moment.way(center_);
    for (size_t v = 0; v < tie_.size(); ++v) {
        const Tie& tie = tie_[v];
        if (tie.triangle == kNone) continue;
        out[v] = on_mesh(a, tie);
        if (moment.share > 0) out[v] = way.point(out[v], on_mesh(b, tie));
        if (!tie.offset.isZero(0))
            out[v] += way.pose(tie.fragment, rest_center_[tie.fragment]).orientation * tie.offset;
    }
}

void VertexMotion::velocities(const Moment& moment, double seconds, std::vector<Vec3>& out) const {
    out.resize(tie_.size(), Vec3::Zero());
    const int end = moment.share > 0 || moment.frame <= frames_.first_frame ? moment.frame + 1 : moment.frame;
    const size_t a = index_of(end - 1), b = index_of(end);
    for (size_t v = 0; v < tie_.size(); ++v)
        if (tie_[v].triangle != kNone) out[v] = (on_mesh(b, tie_[v]) - on_mesh(a, tie_[v])) / seconds;
}

}  // namespace sunder
