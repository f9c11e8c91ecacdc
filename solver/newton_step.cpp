#include "solver/newton_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "solver/instruction_set.h"
#include "solver/motion.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = LaneLayout::kLanes;
constexpr size_t kGrain = 32;        // fewest blocks that a thread is worth waking for
constexpr size_t kSharedUnit = 128;  // blocks; units of more are solved by all threads together
constexpr double kRounding = 1e-11;  // of a group's radius: residuals below it are rounding, and left

template <class Number>
void put(const Mat3& m, size_t lane, Number (&to)[3][3][8]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) to[r][c][lane] = static_cast<Number>(m(r, c));
}

template <class Number>
void put(const Sym3& m, size_t lane, Number (&to)[6][8]) {
    for (size_t i = 0; i < 6; ++i) to[i][lane] = static_cast<Number>(m[i]);
}

template <class Number>
void put(const Vec3& v, size_t lane, Number (*to)[8]) {
    for (int i = 0; i < 3; ++i) to[i][lane] = static_cast<Number>(v(i));
}

}  // namespace

NewtonStep::NewtonStep() : kernels_(&kNewtonKernelsPortable) {
#ifdef SUNDER_HAS_AVX2
    if (instruction_set() == InstructionSet::avx2) kernels_ = &kNewtonKernelsAvx2;
#endif
}

// Rest shapes that changed since they were taken up.
void NewtonStep::take_up_shapes(const Input& in, bool all, size_t begin, size_t end) {
    for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g) {
        if ((!all && packed_[g] == in.shapes.revision[g]) || layout_.lane(g) == LaneLayout::kNone) continue;
        packed_[g] = in.shapes.revision[g];
        for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s) {
            const MemberShape& m = in.shapes.member[s];
            const uint32_t own = layout_.cell(s), other = layout_.cell(in.live.twin(s));
            rows_[own / kLanes].weight[own % kLanes] = static_cast<float>(m.weight);
            put(m.q, own % kLanes, rows_[own / kLanes].q);
            put(m.q, other % kLanes, rows_[other / kLanes].q_other);
        }
        const GroupShape& shape = in.shapes.group[g];
        const Mat3 N = (Mat3::Identity() - shape.isotropy) * shape.affine_inverse;
        put(to_sym(N), layout_.lane(g) % kLanes, groups_[layout_.lane(g) / kLanes].N);
    }
}

void NewtonStep::prepare_groups(const Input& in, size_t begin, size_t end) {
    for (size_t lane = begin * kLanes; lane < end * kLanes; ++lane) {
        const uint32_t g = layout_.particle(lane);
        if (g == LaneLayout::kNone) continue;
        CgGroups& to = groups_[lane / kLanes];
        const GroupShape& shape = in.shapes.group[g];
        const double b = in.goals[g].weight;
        const Mat3 R = in.goals[g].rotation.toRotationMatrix();
        const Mat3 A = R * shape.stiffness_moment * R.transpose();
        Mat3 K = A.trace() * Mat3::Identity() - A;
        for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s)
            K += kOrientationWeight * in.shapes.member[s].weight * in.inertia[in.live.member(s)];
        const double pressure = in.stiffness[g].volume_ratio * shape.positions_trace / 3;
        put(Mat3(R * shape.isotropy), lane % kLanes, to.RQ);
        put(Mat3(std::sqrt(pressure) * R * shape.volume_gradient), lane % kLanes, to.RW);
        put(to_sym(K.inverse()), lane % kLanes, to.K_inverse);
        to.center_scale[lane % kLanes] = static_cast<float>(b / shape.mass);
        to.b[lane % kLanes] = static_cast<float>(b);
    }
}

// Minus the gradient of the implicit Euler step, and the preconditioner.
void NewtonStep::gather_residual(const Input& in, std::span<const MovingParticle> particles, size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
        Block& to = blocks_[block];
        CgParticles& cg = particles_[block] = CgParticles();
        to = Block();
        for (size_t lane = 0; lane < kLanes; ++lane) {
            const uint32_t j = layout_.particle(block * kLanes + lane);
            if (j == LaneLayout::kNone) continue;
            to.size += in.shapes.group[j].positions_trace;
            cg.mass[lane] = static_cast<float>(in.rest.mass[j]);
            put(to_sym(in.inertia[j]), lane, cg.inertia);
            if (in.held[j]) continue;
            const MovingParticle& p = particles[j];
            const Quat back = p.d.conjugate();
            Vec3 shift = p.x_inertial - p.x;
            Vec3 turn = rotation_vector(p.d_inertial * back);
            double diagonal = 1, own = 1;
            for (uint32_t s = in.live.begin(j); s < in.live.end(j); ++s) {
                const GroupGoal& goal = in.goals[in.live.member(s)];
                const MemberShape& m = in.shapes.member[in.live.twin(s)];
                const double b = m.weight * goal.weight;
                shift += b * (goal.center + goal.G * m.q - p.x);
                turn += kOrientationWeight * b * rotation_vector(goal.rotation * back);
                own += b;
                diagonal += m.weight * goal.weight_bound;
            }
            cg.own_shift[lane] = static_cast<float>(own);
            cg.own_turn[lane] = static_cast<float>(1 + kOrientationWeight * (own - 1));
            cg.inverse_diagonal[lane] = static_cast<float>(1 / diagonal);
            put(shift, lane, to.residual), put(turn, lane, to.residual + 3);
            to.magnitude += (in.rest.mass[j] * shift.squaredNorm() + turn.dot(in.inertia[j] * turn)) / diagonal;
        }
    }
}

// Conjugate gradients with the two scalar products of an iteration taken together (Chronopoulos and Gear, 1989).
template <class ForBlocks>
void NewtonStep::solve_unit(bool first_iteration, size_t unit, const ForBlocks& for_blocks) {
    const auto [begin, end] = layout_.units()[unit];
    const auto total = [first = begin, last = end](std::span<const double> of_blocks) {
        double sum = 0;  // in stored order: the same bits for any number of threads
        for (size_t block = first; block < last; ++block) sum += of_blocks[block];
        return sum;
    };
    double initial = 0, size = 0;
    for (size_t block = begin; block < end; ++block) initial += blocks_[block].magnitude, size += blocks_[block].size;
    if (first_iteration) reference_[unit] = initial;
    unit_scale_[unit] = 0;
    const double tolerance = kTolerance * kTolerance * std::max(1.0, reference_[unit] / initial);
    if (!(initial > kRounding * kRounding * size) || tolerance >= 1) return;

    const double scale = unit_scale_[unit] = 1 / std::sqrt(initial);
    const CgArrays arrays{layout_.row_begin(),    layout_.neighbours(),
                          rows_.data(),           groups_.data(),
                          particles_.data(),      momentum_.data()->numbers,
                          pulls_.data()->numbers, magnitude_.data(),
                          curvature_.data(),      static_cast<float>(kOrientationWeight)};
    for_blocks(begin, end, [&](size_t first, size_t last) {
        for (size_t block = first; block < last; ++block)
            for (int i = 0; i < 6; ++i)
                for (size_t lane = 0; lane < kLanes; ++lane)
                    particles_[block].residual[i][lane] = static_cast<float>(scale * blocks_[block].residual[i][lane]);
        kernels_->precondition(arrays, first, last);
    });
    double rz = total(magnitude_), last_rz = 1, alpha = 0;
    for (int k = 0; k < kMaxIterations && rz > tolerance; ++k) {
        for_blocks(begin, end, [&](size_t first, size_t last) { kernels_->fit_groups(arrays, first, last); });
        for_blocks(begin, end, [&](size_t first, size_t last) { kernels_->gather_product(arrays, first, last); });
        const double beta = k == 0 ? 0 : rz / last_rz;
        const double curvature = total(curvature_) - (k == 0 ? 0 : beta * rz / alpha);
        if (!(curvature > 0)) return;  // nothing left but rounding
        alpha = rz / curvature;
        last_rz = rz;
        for_blocks(begin, end, [&](size_t first, size_t last) {
            kernels_->advance(arrays, static_cast<float>(alpha), static_cast<float>(beta), first, last);
        });
        rz = total(magnitude_);
    }
}

void NewtonStep::solve(bool first_iteration, const WorkerPool& workers) {
    const auto units = layout_.units();
    std::vector<uint32_t> apart;  // each by one thread
    for (uint32_t u = 0; u < units.size(); ++u) {
        if (units[u].end_block - units[u].begin_block < kSharedUnit) {
            apart.push_back(u);
            continue;
        }
        solve_unit(first_iteration, u, [&](size_t begin, size_t end, const auto& body) {
            workers.for_range(end - begin, kGrain,
                              [&](size_t first, size_t last) { body(begin + first, begin + last); });
        });
    }
    workers.for_each(apart.size(), [&](size_t i) {
        solve_unit(first_iteration, apart[i], [](size_t begin, size_t end, const auto& body) { body(begin, end); });
    });
}

void NewtonStep::move(std::span<MovingParticle> io_particles, size_t begin, size_t end) const {
    for (size_t unit = begin; unit < end; ++unit) {
        if (unit_scale_[unit] == 0) continue;
        const double scale = 1 / unit_scale_[unit];
        const auto [first, last] = layout_.units()[unit];
        for (size_t lane = first * kLanes; lane < last * kLanes; ++lane) {
            const CgParticles& cg = particles_[lane / kLanes];
            const size_t l = lane % kLanes;
            if (cg.inverse_diagonal[l] == 0) continue;
            MovingParticle& p = io_particles[layout_.particle(lane)];
            const auto solved = [&](int i) { return scale * static_cast<double>(cg.solution[i][l]); };
            p.x += Vec3(solved(0), solved(1), solved(2));
            p.d = (rotation_of(Vec3(solved(3), solved(4), solved(5))) * p.d).normalized();
            p.D = p.d.toRotationMatrix();
        }
    }
}

void NewtonStep::apply(bool first_iteration, const Input& in, const WorkerPool& workers,
                       std::span<MovingParticle> io_particles) {
    const bool anew = layout_.update(in.live);
    const size_t n = in.rest.n_particles(), n_blocks = layout_.n_blocks();
    if (anew) {
        packed_.resize(n);
        rows_.assign(layout_.n_rows(), CgRow());
        groups_.assign(n_blocks, CgGroups());
        particles_.resize(n_blocks), blocks_.resize(n_blocks), magnitude_.resize(n_blocks), curvature_.resize(n_blocks);
        momentum_.resize(layout_.n_lanes()), pulls_.resize(layout_.n_lanes());
        unit_scale_.resize(layout_.units().size()), reference_.resize(layout_.units().size());
    }
    workers.for_range(n, kGrain * kLanes, [&](size_t first, size_t last) { take_up_shapes(in, anew, first, last); });
    workers.for_range(n_blocks, kGrain, [&](size_t first, size_t last) {
        prepare_groups(in, first, last);
        gather_residual(in, io_particles, first, last);
    });
    solve(first_iteration, workers);
    workers.for_range(layout_.units().size(), 1, [&](size_t first, size_t last) { move(io_particles, first, last); });
}

}  // namespace sunder
