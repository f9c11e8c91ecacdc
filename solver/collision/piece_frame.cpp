#include "solver/collision/piece_frame.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>

#include "solver/lanes/instruction_set.h"
#include "solver/matching/polar_decomposition.h"

namespace sunder {
namespace {

constexpr double kMostTurn = 0.5;  // rad a step; faster pieces are followed without their turning
constexpr size_t kChunk = 64;      // blocks that a thread is worth waking for

// Records as the kernels see them.
static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Aabb) == 6 * sizeof(double));
const double* numbers(const Vec3* records) { return reinterpret_cast<const double*>(records); }
const double* numbers(const Aabb* records) { return reinterpret_cast<const double*>(records); }
double* numbers(Aabb* records) { return reinterpret_cast<double*>(records); }

// Numbers that add(begin, end, sum) adds up over blocks, chunk by chunk, the chunks in their order.
template <size_t kNumbers, class Add>
std::array<double, kNumbers> sum_over(size_t n_blocks, const WorkerPool& workers, const Add& add) {
    std::array<double, kNumbers> total = {};
    if (n_blocks <= kChunk) {
        add(size_t{0}, n_blocks, total.data());
        return total;
    }
    std::vector<std::array<double, kNumbers>> sums((n_blocks + kChunk - 1) / kChunk);
    workers.for_range(sums.size(), 1, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k) add(k * kChunk, std::min(n_blocks, (k + 1) * kChunk), sums[k].data());
    });
    for (const auto& sum : sums)
        for (size_t i = 0; i < kNumbers; ++i) total[i] += sum[i];
    return total;
}

}  // namespace

const PieceFrameKernels& piece_frame_kernels() { return SUNDER_BEST_KERNELS(kPieceFrameKernels); }

PieceFrame::PieceFrame(const PieceFrameKernels& kernels, const ParticleMotion& motion,
                       std::span<const ParticleId> member, const Quat& turn, const WorkerPool& workers)
    : kernels_(kernels),
      workers_(workers),
      particles_{sunder::numbers(member).data(), member.size(), numbers(motion.position.data()),
                 numbers(motion.velocity.data()), motion.radius.data()} {
    motion_.duration = motion.duration;
    find_rigid_motion(motion.position[member.front()], motion.velocity[member.front()]);
    set_turn(turn);
}

void PieceFrame::find_rigid_motion(const Vec3& origin, const Vec3& common_velocity) {
    using Sums = Eigen::Map<const Vec3>;
    const auto s = sum_over<15>(n_blocks(), workers_, [&](size_t begin, size_t end, double* io_sum) {
        kernels_.rigid_motion(particles_, begin, end, io_sum);
    });
    const double n = static_cast<double>(particles_.n);
    const Vec3 x = Sums(s.data()) / n, v = Sums(s.data() + 3) / n;
    const Vec3 L = Sums(s.data() + 6) - n * x.cross(v);
    Mat3 spread;
    spread << s[9], s[12], s[13], s[12], s[10], s[14], s[13], s[14], s[11];
    spread -= n * x * x.transpose();
    const Mat3 H = spread.trace() * Mat3::Identity() - spread;
    const Vec3 spin = (H + 1e-9 * H.trace() * Mat3::Identity()).inverse() * L;
    const bool follows = spin.norm() * motion_.duration < kMostTurn;  // and not where it is not finite
    Eigen::Map<Vec3>(motion_.center) = origin + x;
    Eigen::Map<Vec3>(motion_.velocity) = common_velocity + v;
    Eigen::Map<Vec3>(motion_.spin) = follows ? spin : Vec3(Vec3::Zero());
    // Rigid motion is not straight, while contacts are found on straight paths: two that touch on them are no farther
    // apart than their reach and what turning adds to it, theta (their reach + ...), hence theta / (1 - theta).
    const double theta = follows ? motion_.duration * spin.norm() : 0;
    motion_.bend = theta / (1 - theta);
}

void PieceFrame::set_turn(const Quat& turn) {
    turn_ = turn;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(motion_.back) = turn.conjugate().toRotationMatrix();
}

void PieceFrame::turn_to(std::span<const Vec3> remembered) {
    const auto s = sum_over<9>(n_blocks(), workers_, [&](size_t begin, size_t end, double* io_sum) {
        kernels_.turn(particles_, motion_.center, numbers(remembered.data()), begin, end, io_sum);
    });
    set_turn(optimal_rotation(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(s.data()), turn_));
}

Vec3 PieceFrame::position(size_t place) const {
    using Vector = Eigen::Map<const Vec3>;
    return turn_.conjugate() *
           (Vector(particles_.position + 3 * size_t{particles_.member[place]}) - Vector(motion_.center));
}

Aabb PieceFrame::box(size_t place) const {
    PieceMembers own = particles_;
    own.member += place, own.n = 1;
    Aabb box;
    kernels_.boxes(own, motion_, 0, 1, numbers(&box));
    return box;
}

void PieceFrame::find_boxes(std::vector<Aabb>& out) const {
    out.resize(particles_.n);
    workers_.for_range(n_blocks(), kChunk, [&](size_t begin, size_t end) {
        kernels_.boxes(particles_, motion_, begin, end, numbers(out.data()));
    });
}

void PieceFrame::find_who_left(std::span<const Aabb> grown, std::vector<uint32_t>& out) const {
    out.clear();
    std::array<uint8_t, kChunk> few;
    std::vector<uint8_t> many(n_blocks() > kChunk ? n_blocks() : 0);
    uint8_t* const left = many.empty() ? few.data() : many.data();
    workers_.for_range(n_blocks(), kChunk, [&](size_t begin, size_t end) {
        kernels_.who_left(particles_, motion_, numbers(grown.data()), begin, end, left);
    });
    for (uint32_t b = 0; b < n_blocks(); ++b)
        for (uint32_t bits = left[b]; bits != 0; bits &= bits - 1)
            out.push_back(4 * b + static_cast<uint32_t>(std::countr_zero(bits)));
}

}  // namespace sunder
