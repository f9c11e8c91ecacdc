#include "solver/collision/detection.h"

#include <algorithm>
#include <array>

#include "solver/collision/detection_parts.h"
#include "solver/collision/rank.h"
#include "solver/data/invariant.h"

namespace sunder {
using namespace detail;

Aabb detail::swept_box(const DetectionInput& in, MovableIndex i, const Vec3& frame) {
    Aabb box;
    double turning = turning_reach(in, i);
    if (is_particle(in, i)) {
        const Sym3 support = support_matrix(in, i);
        const Vec3 half = Vec3(support[0], support[1], support[2]).cwiseSqrt();
        box = {in.particles.center[i] - half, in.particles.center[i] + half};
    } else {
        box = bounding_box(rigid(in, i));
        // What is near it is swept by its turning.
        turning += angular_velocity(in, i).norm() * in.duration * bounding_radius(rigid(in, i).shape);
    }
    const Vec3 shift = in.duration * (in.velocity[i] - frame);
    const Vec3 grow = Vec3::Constant(0.5 * in.margin + turning) +
                      kRounding * (box.max - box.min + box.max.cwiseAbs() + shift.cwiseAbs());
    box.min += shift.cwiseMin(0.0) - grow;
    box.max += shift.cwiseMax(0.0) + grow;
    return box;
}

void sweep_boxes(const DetectionInput& in, const Vec3& frame, size_t begin, size_t end, std::span<Aabb> io_boxes) {
    for (size_t i = begin; i < end; ++i) io_boxes[i] = swept_box(in, i, frame);
}

namespace {

// Pairs that may touch, in no order: of one piece, and others.
std::array<std::span<const Pair>, 2> candidates(const DetectionInput& in, const WorkerPool& workers,
                                                ContactScratch& s) {
    PairFilter filter;
    filter.n_particles = static_cast<uint32_t>(in.particles.size());
    filter.body = in.body;
    filter.self_collision = in.self_collision;
    filter.rings = in.rings;
    if (in.piece.size() != in.particles.size()) {
        find_overlaps(s.boxes, filter, workers, s.overlaps, s.pairs);
        for (auto& [i, j] : s.pairs)
            if (i > j) std::swap(i, j);
        return {s.pairs, {}};
    }

    const auto within =
        s.within.update({in.particles.center, in.velocity.first(in.particles.size()), s.radius, in.duration}, in.piece,
                        filter, workers);
    return {within, s.between.update(s.boxes, in.piece, filter, workers)};
}

// The median of a sample, component by component: a few that fly off do not move it.
Vec3 common_velocity(std::span<const Vec3> velocity) {
    constexpr size_t kSample = 128;
    const size_t stride = velocity.size() / kSample + 1;
    Vec3 common = Vec3::Zero();
    std::array<double, kSample> sample;
    for (int axis = 0; axis < 3; ++axis) {
        size_t n = 0;
        for (size_t i = 0; i < velocity.size(); i += stride) sample[n++] = velocity[i][axis];
        if (n > 0) common[axis] = number_of_rank(std::span(sample).first(n), n / 2);
    }
    return common;
}

// Calls find(k, begin, end, out) on chunks of each [0, sizes[k]), from several threads; appends what they found in
// their order.
template <class Find>
void in_chunks(const std::array<size_t, 3>& sizes, const WorkerPool& workers, const Find& find,
               std::vector<std::vector<Contact>>& chunks, std::vector<Contact>& out) {
    constexpr size_t kChunk = 256, kShared = 4;  // fewest chunks that another thread is worth waking for
    std::array<size_t, 4> first = {};            // chunk of each
    for (size_t k = 0; k < sizes.size(); ++k) first[k + 1] = first[k] + (sizes[k] + kChunk - 1) / kChunk;
    if (chunks.size() < first.back()) chunks.resize(first.back());
    const auto find_chunk = [&](size_t chunk) {
        size_t k = 0;
        while (chunk >= first[k + 1]) ++k;
        const size_t begin = (chunk - first[k]) * kChunk;
        chunks[chunk].clear();
        find(k, begin, std::min(sizes[k], begin + kChunk), chunks[chunk]);
    };
    if (first.back() < kShared)
        for (size_t chunk = 0; chunk < first.back(); ++chunk) find_chunk(chunk);
    else
        workers.for_each(first.back(), find_chunk);
    for (size_t chunk = 0; chunk < first.back(); ++chunk)
        out.insert(out.end(), chunks[chunk].begin(), chunks[chunk].end());
}

// What stages ask for again and again.
DetectionInput prepared(const DetectionInput& in, const WorkerPool& workers, ContactScratch& s) {
    const size_t n_particles = in.particles.size();
    s.turning.resize(n_movables(in));
    s.radius.resize(n_particles), s.support.resize(n_particles);
    workers.for_range(n_movables(in), 512, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            s.turning[i] = turning_reach(in, i);
            if (i >= n_particles) continue;
            s.radius[i] = in.particles.radii[i].maxCoeff() + 0.5 * in.margin + s.turning[i];
            s.support[i] = support_matrix(in, i);
        }
    });
    DetectionInput known = in;
    known.turning = s.turning, known.support = s.support;
    return known;
}

// By (a, b); those of one pair in the order in which they were found.
void put_in_order(size_t n_movables, const WorkerPool& workers, ContactScratch& s, std::vector<Contact>& out) {
    s.begin.assign(n_movables + 1, 0);
    for (const Contact& c : s.found) ++s.begin[c.a + 1];
    for (size_t i = 0; i < n_movables; ++i) s.begin[i + 1] += s.begin[i];
    s.order.resize(s.found.size());
    for (ContactId k(0); k < s.found.size(); ++k) s.order[s.begin[s.found[k].a]++] = k;  // now: where they end
    out.resize(s.found.size());
    workers.for_range(n_movables, 512, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            const auto begin = s.order.begin() + (i > 0 ? s.begin[i - 1] : 0), end = s.order.begin() + s.begin[i];
            const auto comes_first = [&](ContactId p, ContactId q) {
                return std::pair(s.found[p].b, p) < std::pair(s.found[q].b, q);
            };
            std::sort(begin, end, comes_first);
            for (auto k = begin; k < end; ++k) out[static_cast<size_t>(k - s.order.begin())] = s.found[*k];
        }
    });
}

}  // namespace

void find_contacts(const DetectionInput& input, ContactScratch& scratch, std::vector<Contact>& out) {
    const size_t n = n_movables(input);
    SUNDER_ASSERT(input.velocity.size() == n && (input.angular_velocity.empty() || input.angular_velocity.size() == n));
    SUNDER_ASSERT(input.role.size() <= n && (input.fixed.empty() || input.fixed.size() == n));
    SUNDER_ASSERT(input.duration >= 0 && input.margin > 0);
    const WorkerPool alone(1);
    const WorkerPool& workers = input.workers ? *input.workers : alone;
    const DetectionInput in = prepared(input, workers, scratch);
    scratch.boxes.resize(n);
    // Two things meet or miss whoever looks: in the frame that goes with most of them, what falls together hardly
    // moves.
    const Vec3 common = common_velocity(in.velocity);
    workers.for_range(n, 512, [&](size_t begin, size_t end) { sweep_boxes(in, common, begin, end, scratch.boxes); });
    std::array<std::span<const Pair>, 2> pairs = candidates(in, workers, scratch);
    scratch.found.clear();
    const auto search = [&](const std::array<std::span<const Pair>, 2>& among, size_t n_with_colliders) {
        in_chunks(
            {among[0].size(), among[1].size(), n_with_colliders}, workers,
            [&](size_t k, size_t begin, size_t end, std::vector<Contact>& found) {
                if (k < among.size())
                    contacts_of_pairs(in, scratch.boxes, among[k].subspan(begin, end - begin), found);
                else
                    contacts_with_colliders(in, begin, end, found);
            },
            scratch.chunks, scratch.found);
    };
    std::vector<Pair> first, others;
    if (!in.fixed.empty() && in.ends) {
        for (const std::span<const Pair> some : pairs)
            for (const Pair& p : some) (in.fixed[p.first] != in.fixed[p.second] ? first : others).push_back(p);
        search({first, {}}, 0);
        if (in.ends(scratch.found)) return out.assign(scratch.found.begin(), scratch.found.end());
        pairs = {others, {}};
    }
    search(pairs, n);
    put_in_order(n, workers, scratch, out);
}

}  // namespace sunder
