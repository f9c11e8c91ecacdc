#include "solver/newton_step.h"

#include <Eigen/LU>

#include "solver/motion.h"

namespace sunder {
namespace {

constexpr size_t kGrain = 256;  // fewest groups or particles a thread is worth waking for

// Sum over particles in stored order: the same bits for any number of threads.
double dot(std::span<const Twist> a, std::span<const Twist> b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += a[i].shift.dot(b[i].shift) + a[i].turn.dot(b[i].turn);
    return sum;
}

bool moves(const NewtonStep::Input& in, uint32_t j) { return !in.held[j] && in.live.count(j) > 1; }

}  // namespace

void NewtonStep::prepare_groups(const Input& in, size_t begin, size_t end) {
    for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g) {
        Group& group = groups_[g];
        group.b = in.goals[g].weight;
        inverse_inertia_[g] = in.inertia[g].inverse();
        if (group.b == 0) continue;
        const GroupShape& shape = in.shapes.group[g];
        group.R = in.goals[g].rotation.toRotationMatrix();
        group.inverse_mass = 1 / shape.mass;
        group.pressure = in.stiffness[g].volume_ratio * shape.positions_trace / 3;
        const Mat3 A = group.R * shape.stiffness_moment * group.R.transpose();
        Mat3 K = A.trace() * Mat3::Identity() - A;
        for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s)
            K += kOrientationWeight * in.shapes.member[s].weight * in.inertia[in.live.member(s)];
        group.K_inverse = K.inverse();
    }
}

// Minus the gradient of the implicit Euler step.
void NewtonStep::gather_residual(const Input& in, std::span<const MovingParticle> particles, size_t begin, size_t end) {
    for (uint32_t j = static_cast<uint32_t>(begin); j < end; ++j) {
        residual_[j] = Twist();
        diagonal_[j] = 1;
        if (!moves(in, j)) continue;
        const MovingParticle& p = particles[j];
        const Quat back = p.d.conjugate();
        Vec3 shift = p.x_inertial - p.x;
        Vec3 turn = rotation_vector(p.d_inertial * back);
        for (uint32_t s = in.live.begin(j); s < in.live.end(j); ++s) {
            const GroupGoal& goal = in.goals[in.live.member(s)];
            const MemberShape& m = in.shapes.member[in.live.twin(s)];
            shift += m.weight * goal.weight * (goal.center + goal.G * m.q - p.x);
            turn += kOrientationWeight * m.weight * goal.weight * rotation_vector(goal.rotation * back);
            diagonal_[j] += m.weight * goal.weight_bound;
        }
        residual_[j] = {in.rest.mass[j] * shift, in.inertia[j] * turn};
    }
}

// The rigid motion, and the volume strain, that fit the direction best in each group.
void NewtonStep::fit_groups(const Input& in, size_t begin, size_t end) {
    for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g) {
        Group& group = groups_[g];
        if (group.b == 0) continue;
        const GroupShape& shape = in.shapes.group[g];
        Vec3 shift = Vec3::Zero(), spin = Vec3::Zero();
        Mat3 A = Mat3::Zero();
        for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s) {
            const uint32_t j = in.live.member(s);
            const MemberShape& m = in.shapes.member[s];
            const Vec3 md = m.mass * direction_[j].shift;
            shift += md;
            A.noalias() += md * m.q.transpose();
            spin += m.weight * in.inertia[j] * direction_[j].turn;
        }
        const Mat3 A_balanced = A * shape.isotropy, B = A_balanced * group.R.transpose();
        spin = kOrientationWeight * spin + Vec3(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
        group.center_shift = group.inverse_mass * shift;
        group.turn = group.K_inverse * spin;
        Mat3 turn;
        turn << 0, -group.turn.z(), group.turn.y(), group.turn.z(), 0, -group.turn.x(), -group.turn.y(), group.turn.x(),
            0;
        group.pull = -turn * group.R * shape.isotropy - (A - A_balanced) * shape.affine_inverse;
        if (group.pressure > 0) {
            const Mat3 RW = group.R * shape.volume_gradient;
            group.pull += group.pressure * RW.cwiseProduct(A).sum() * RW;
        }
    }
}

void NewtonStep::gather_product(const Input& in, size_t begin, size_t end) {
    for (uint32_t j = static_cast<uint32_t>(begin); j < end; ++j) {
        product_[j] = Twist();
        if (!moves(in, j)) continue;
        const Twist& d = direction_[j];
        Vec3 shift = d.shift, turn = d.turn;
        for (uint32_t s = in.live.begin(j); s < in.live.end(j); ++s) {
            const Group& group = groups_[in.live.member(s)];
            const MemberShape& m = in.shapes.member[in.live.twin(s)];
            const double b = m.weight * group.b;
            shift += b * (d.shift - group.center_shift + group.pull * m.q);
            turn += kOrientationWeight * b * (d.turn - group.turn);
        }
        product_[j] = {in.rest.mass[j] * shift, in.inertia[j] * turn};
    }
}

void NewtonStep::precondition(const Input& in, size_t begin, size_t end) {
    for (size_t j = begin; j < end; ++j)
        preconditioned_[j] = {residual_[j].shift / (in.rest.mass[j] * diagonal_[j]),
                              inverse_inertia_[j] * residual_[j].turn / diagonal_[j]};
}

void NewtonStep::solve(bool first_iteration, const Input& in, const WorkerPool& workers) {
    const size_t n = residual_.size();
    workers.for_range(n, kGrain, [&](size_t first, size_t last) { precondition(in, first, last); });
    direction_ = preconditioned_;
    double rz = dot(residual_, preconditioned_);
    if (first_iteration) reference_ = rz;
    const double enough = kTolerance * kTolerance * std::max(rz, reference_);
    for (int k = 0; k < kMaxIterations && rz > enough; ++k) {
        workers.for_range(n, kGrain, [&](size_t first, size_t last) { fit_groups(in, first, last); });
        workers.for_range(n, kGrain, [&](size_t first, size_t last) { gather_product(in, first, last); });
        const double curvature = dot(direction_, product_);
        if (!(curvature > 0)) return;  // nothing left but rounding
        const double alpha = rz / curvature;
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t j = first; j < last; ++j) {
                solution_[j].shift += alpha * direction_[j].shift, solution_[j].turn += alpha * direction_[j].turn;
                residual_[j].shift -= alpha * product_[j].shift, residual_[j].turn -= alpha * product_[j].turn;
            }
            precondition(in, first, last);
        });
        const double next = dot(residual_, preconditioned_), beta = next / rz;
        rz = next;
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t j = first; j < last; ++j) {
                direction_[j].shift = preconditioned_[j].shift + beta * direction_[j].shift;
                direction_[j].turn = preconditioned_[j].turn + beta * direction_[j].turn;
            }
        });
    }
}

void NewtonStep::apply(bool first_iteration, const Input& in, const WorkerPool& workers,
                       std::span<MovingParticle> io_particles) {
    const size_t n = in.rest.n_particles();
    groups_.resize(n), diagonal_.resize(n), inverse_inertia_.resize(n);
    residual_.resize(n), product_.resize(n), preconditioned_.resize(n), direction_.resize(n);
    solution_.assign(n, Twist());

    workers.for_range(n, kGrain, [&](size_t first, size_t last) { prepare_groups(in, first, last); });
    workers.for_range(n, kGrain, [&](size_t first, size_t last) { gather_residual(in, io_particles, first, last); });
    solve(first_iteration, in, workers);
    workers.for_range(n, kGrain, [&](size_t first, size_t last) {
        for (uint32_t j = static_cast<uint32_t>(first); j < last; ++j) {
            if (!moves(in, j)) continue;
            MovingParticle& p = io_particles[j];
            p.x += solution_[j].shift;
            p.d = (rotation_of(solution_[j].turn) * p.d).normalized();
            p.D = p.d.toRotationMatrix();
        }
    });
}

}  // namespace sunder
