#include "solver/conjugate_gradients.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

constexpr uint32_t kLanes = LaneLayout::kLanes;
constexpr size_t kSharedUnit = 128;  // blocks; units of more are solved by all threads together
constexpr double kRounding = 1e-11;  // of a group's radius: residuals below it are rounding, and left

}  // namespace

template <class Real>
void ConjugateGradients<Real>::take_up(const SweepInput& in, const LaneLayout& layout, const WorkerPool& workers) {
    if (version_ != in.live.version()) {
        version_ = in.live.version();
        revision_.assign(in.rest.n_particles(), 0);  // no shape has it
        rows_.assign(layout.n_rows(), CgRow<Real>());
        groups_.assign(layout.n_blocks(), CgGroups<Real>());
        particles_.resize(layout.n_blocks()), scale_.resize(layout.n_blocks());
        magnitude_.resize(layout.n_blocks()), curvature_.resize(layout.n_blocks());
        momentum_.resize(layout.n_lanes()), pulls_.resize(layout.n_lanes());
    }
    workers.for_range(in.rest.n_particles(), SweepStore<double>::kTakeUpGrain, [&](size_t begin, size_t end) {
        for (uint32_t g = static_cast<uint32_t>(begin); g < end; ++g)
            if (revision_[g] != in.shapes.revision[g] && layout.lane(g) != LaneLayout::kNone)
                take_up_group(in, layout, g);
    });
}

template <class Real>
void ConjugateGradients<Real>::take_up_group(const SweepInput& in, const LaneLayout& layout, uint32_t g) {
    revision_[g] = in.shapes.revision[g];
    for (uint32_t s = in.live.begin(g); s < in.live.end(g); ++s) {
        const MemberShape& m = in.shapes.member[s];
        const uint32_t own = layout.cell(s), other = layout.cell(in.live.twin(s));
        rows_[own / kLanes].weight[own % kLanes] = static_cast<Real>(m.weight);
        put_lane(m.q, own % kLanes, rows_[own / kLanes].q);
        put_lane(m.q, other % kLanes, rows_[other / kLanes].q_other);
    }
    const GroupShape& shape = in.shapes.group[g];
    put_lane(to_sym((Mat3::Identity() - shape.isotropy) * shape.affine_inverse), layout.lane(g) % kLanes,
             groups_[layout.lane(g) / kLanes].N);
}

template <class Real>
CgArrays<Real> ConjugateGradients<Real>::arrays(const LaneLayout& layout) {
    return {layout.row_begin(),     layout.neighbours(),
            rows_.data(),           groups_.data(),
            particles_.data(),      momentum_.data()->numbers,
            pulls_.data()->numbers, magnitude_.data(),
            curvature_.data(),      static_cast<Real>(kOrientationWeight)};
}

template <class Real>
void ConjugateGradients<Real>::pull_on_motion(const LaneLayout& layout, std::span<NewtonParticles> io_newton,
                                              const NewtonKernels<Real>& kernels, const WorkerPool& workers) {
    const CgArrays<Real> arrays = this->arrays(layout);
    const auto for_blocks = [&](const auto& body) {
        workers.for_range(layout.n_blocks(), SweepStore<double>::kGrain, [&](size_t begin, size_t end) {
            for (size_t block = begin; block < end; ++block)
                for (size_t lane = 0; lane < kLanes; ++lane) body(block, lane);
        });
    };
    const auto torque_of = [](const NewtonParticles& p, size_t lane, const Vec3& turn) {
        Sym3 H;
        for (size_t i = 0; i < 6; ++i) H[i] = p.inertia[i][lane];
        return Vec3(to_matrix(H) * turn);
    };
    const auto vector = [](const double(*numbers)[8], size_t lane) {
        return Vec3(numbers[0][lane], numbers[1][lane], numbers[2][lane]);
    };
    for_blocks([&](size_t block, size_t lane) {
        const NewtonParticles& p = io_newton[block];
        const Vec3 force = p.mass[lane] * vector(p.residual, lane);
        const Vec3 torque = torque_of(p, lane, vector(p.residual + 3, lane));
        Real* to = momentum_[block * kLanes + lane].numbers;
        for (int i = 0; i < 3; ++i) to[i] = static_cast<Real>(force[i]), to[i + 4] = static_cast<Real>(torque[i]);
        to[3] = to[7] = 0;
        for (auto& numbers : particles_[block].residual)
            numbers[lane] = 0;  // nothing of the particle's own in `product`
    });
    workers.for_range(layout.n_blocks(), SweepStore<double>::kGrain,
                      [&](size_t begin, size_t end) { kernels.fit_groups(arrays, begin, end); });
    workers.for_range(layout.n_blocks(), SweepStore<double>::kGrain,
                      [&](size_t begin, size_t end) { kernels.gather_product(arrays, begin, end); });
    for_blocks([&](size_t block, size_t lane) {
        NewtonParticles& p = io_newton[block];
        CgParticles<Real>& cg = particles_[block];
        const double own[2] = {static_cast<double>(cg.own_shift[lane]) - 1, static_cast<double>(cg.own_turn[lane]) - 1};
        for (size_t i = 0; i < 6; ++i) {
            p.residual[i][lane] =
                p.free[lane] * (-static_cast<double>(cg.product[i][lane]) - own[i / 3] * p.residual[i][lane]);
            cg.product[i][lane] = 0;
        }
        const Vec3 shift = vector(p.residual, lane), turn = vector(p.residual + 3, lane);
        if (lane == 0) p.magnitude = 0;
        p.magnitude += static_cast<double>(cg.inverse_diagonal[lane]) *
                       (p.mass[lane] * shift.squaredNorm() + turn.dot(torque_of(p, lane, turn)));
    });
}

// The two scalar products of an iteration are taken together (Chronopoulos and Gear, 1989).
template <class Real>
template <class ForBlocks>
void ConjugateGradients<Real>::solve_unit(bool first_iteration, const LaneLayout& layout,
                                          std::span<const NewtonParticles> newton, const NewtonKernels<Real>& kernels,
                                          size_t unit, double mean, double& io_reference, const ForBlocks& for_blocks) {
    const auto [begin, end] = layout.units()[unit];
    const auto total = [first = begin, last = end](std::span<const double> of_blocks) {
        double sum = 0;  // in stored order: the same bits for any number of threads
        for (size_t block = first; block < last; ++block) sum += of_blocks[block];
        return sum;
    };
    double initial = 0, size = 0;
    for (size_t block = begin; block < end; ++block) initial += newton[block].magnitude, size += newton[block].size;
    if (first_iteration) io_reference = initial;
    std::fill(scale_.begin() + begin, scale_.begin() + end, 0.0);
    // A quiet piece of a violent scene needs no more than its share of what the scene is solved to.
    const double tolerance = kTolerance * kTolerance * std::max(1.0, std::max(io_reference, mean * size) / initial);
    if (!(initial > kRounding * kRounding * size) || tolerance >= 1) return;

    const double scale = 1 / std::sqrt(initial);
    std::fill(scale_.begin() + begin, scale_.begin() + end, scale);
    const CgArrays<Real> arrays = this->arrays(layout);
    for_blocks(begin, end, [&](size_t first, size_t last) {
        for (size_t block = first; block < last; ++block)
            for (int i = 0; i < 6; ++i)
                for (size_t lane = 0; lane < kLanes; ++lane)
                    particles_[block].residual[i][lane] = static_cast<Real>(scale * newton[block].residual[i][lane]);
        kernels.precondition(arrays, first, last);
    });
    double rz = total(magnitude_), last_rz = 1, alpha = 0;
    for (int k = 0; k < kMaxIterations && rz > tolerance; ++k) {
        for_blocks(begin, end, [&](size_t first, size_t last) { kernels.fit_groups(arrays, first, last); });
        for_blocks(begin, end, [&](size_t first, size_t last) { kernels.gather_product(arrays, first, last); });
        const double beta = k == 0 ? 0 : rz / last_rz;
        const double curvature = total(curvature_) - (k == 0 ? 0 : beta * rz / alpha);
        if (!(curvature > 0)) return;  // nothing left but rounding
        alpha = rz / curvature;
        last_rz = rz;
        for_blocks(begin, end, [&](size_t first, size_t last) {
            kernels.advance(arrays, static_cast<Real>(alpha), static_cast<Real>(beta), first, last);
        });
        rz = total(magnitude_);
    }
}

template <class Real>
void ConjugateGradients<Real>::solve(bool first_iteration, const LaneLayout& layout,
                                     std::span<const NewtonParticles> newton, const NewtonKernels<Real>& kernels,
                                     const WorkerPool& workers, std::span<double> io_reference) {
    const auto units = layout.units();
    double magnitude = 0, size = 0;
    for (const NewtonParticles& block : newton) magnitude += block.magnitude, size += block.size;
    const double mean = magnitude / size;  // of the squared residual, for a unit of size 1
    std::vector<uint32_t> apart;           // each by one thread
    for (uint32_t u = 0; u < units.size(); ++u) {
        if (units[u].end_block - units[u].begin_block < kSharedUnit) {
            apart.push_back(u);
            continue;
        }
        solve_unit(first_iteration, layout, newton, kernels, u, mean, io_reference[u],
                   [&](size_t begin, size_t end, const auto& body) {
                       workers.for_range(end - begin, SweepStore<double>::kGrain,
                                         [&](size_t first, size_t last) { body(begin + first, begin + last); });
                   });
    }
    workers.for_each(apart.size(), [&](size_t i) {
        solve_unit(first_iteration, layout, newton, kernels, apart[i], mean, io_reference[apart[i]],
                   [](size_t begin, size_t end, const auto& body) { body(begin, end); });
    });
}

template class ConjugateGradients<float>;
template class ConjugateGradients<double>;

}  // namespace sunder
