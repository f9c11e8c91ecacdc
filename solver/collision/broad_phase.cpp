#include "solver/collision/broad_phase.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "solver/collision/rank.h"
#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr int kLevels = 16;
constexpr double kLevelRatio = 4;              // of cell sizes from level to level: 16 levels span 1e9 in size
constexpr double kFinestCell = 1.5;            // of the median extent: most boxes cover 2-8 cells
constexpr int64_t kCellLimit = (1 << 19) - 1;  // cells a side of the origin; farther boxes share the outermost cell
constexpr double kFarthest = 1e150;            // m; beyond it differences and products may overflow
constexpr uint64_t kSweepTests = 2000;         // a box; beyond it the grid is cheaper than a sweep

double largest_extent(const Aabb& box) { return (box.max - box.min).maxCoeff(); }

/// Median of the usable boxes' largest extents; the lower one of two. 0 when there is none.
double median_extent(std::span<const Aabb> boxes, std::vector<double>& scratch) {
    scratch.clear();
    for (const Aabb& box : boxes)
        if (is_usable(box)) scratch.push_back(largest_extent(box));
    if (scratch.empty()) return 0;
    return number_of_rank(scratch, (scratch.size() - 1) / 2);
}

/// Cells of one level. Coordinates are clamped to what a key can hold; clamping is monotone, so boxes that overlap
/// still share a cell.
struct Level {
    Vec3 origin;
    double inverse_size;
    uint64_t tag;

    int64_t cell(double x, int axis) const {
        const double c = std::floor((x - origin[axis]) * inverse_size);
        return static_cast<int64_t>(std::clamp(c, -double(kCellLimit), double(kCellLimit)));
    }
    std::array<int64_t, 3> cell(const Vec3& p) const { return {cell(p.x(), 0), cell(p.y(), 1), cell(p.z(), 2)}; }
    uint64_t key(int64_t x, int64_t y, int64_t z) const {
        const auto bits = [](int64_t c) { return static_cast<uint64_t>(c + kCellLimit) & 0xfffff; };
        return tag << 60 | bits(x) << 40 | bits(y) << 20 | bits(z);
    }
};

uint64_t scrambled(uint64_t x) {  // finaliser of splitmix64
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

/// Entries of one cell lie in one bucket, in the order in which they were made.
void sort_into_buckets(OverlapScratch& s) {
    const uint64_t n_buckets = std::bit_ceil(std::max<size_t>(s.entries.size(), 16));
    s.bucket_begin.assign(n_buckets + 1, 0);
    const auto bucket = [&](const OverlapScratch::Entry& e) { return scrambled(e.key) & (n_buckets - 1); };
    for (const auto& e : s.entries) ++s.bucket_begin[bucket(e) + 1];
    for (size_t k = 0; k < n_buckets; ++k) s.bucket_begin[k + 1] += s.bucket_begin[k];
    s.sorted.resize(s.entries.size());
    for (const auto& e : s.entries) s.sorted[s.bucket_begin[bucket(e)]++] = e;
    for (size_t k = n_buckets; k > 0; --k) s.bucket_begin[k] = s.bucket_begin[k - 1];
    s.bucket_begin[0] = 0;
}

}  // namespace

bool is_usable(const Aabb& box) {
    return (box.min.array() <= box.max.array()).all() && (box.min.array() > -kFarthest).all() &&
           (box.max.array() < kFarthest).all();
}

bool LiveRings::joined(ParticleIndex i, ParticleIndex j) const {
    if (i >= begin.size()) return false;
    const auto first = member.begin() + begin[i], last = member.begin() + end[i];
    const auto found = std::lower_bound(first, last, ParticleId(size_t{j}));
    if (found == last || *found != j) return false;
    return edge.empty() || edge_intact[edge[found - member.begin()]] != 0;
}

bool LiveRings::near(ParticleIndex i, ParticleIndex j) const {
    if (i >= begin.size() || j >= begin.size()) return false;
    if (joined(i, j)) return true;
    const auto intact = [&](uint32_t s) { return edge.empty() || edge_intact[edge[s]] != 0; };
    for (uint32_t s = begin[i], t = begin[j]; s < end[i] && t < end[j];) {  // a third that both rings hold
        if (member[s] == member[t]) {
            if (intact(s) && intact(t)) return true;
            ++s, ++t;
        } else {
            member[s] < member[t] ? ++s : ++t;
        }
    }
    return false;
}

bool PairFilter::excludes(uint32_t i, uint32_t j) const {
    return !is_possible(i, j) || (same_body(i, j) && rings.near(i, j));
}

bool PairFilter::same_body(uint32_t i, uint32_t j) const {
    return i < n_particles && j < n_particles && (body.empty() || body[i] == body[j]);
}

bool PairFilter::is_possible(uint32_t i, uint32_t j) const {
    return (item.empty() || item[i] != item[j]) && (self_collision || !same_body(i, j));
}

void PairFilter::remove_excluded(std::vector<uint32_t>& io_marks, std::vector<Pair>& io_pairs) const {
    if (excludes_by_rings_alone() && rings.begin.empty()) return;
    io_marks.resize(n_particles, kNone);
    uint32_t marked = kNone;
    const auto is_excluded = [&](const Pair& pair) {
        const auto [i, j] = pair;
        if (!is_possible(i, j)) return true;
        if (rings.begin.empty() || !same_body(i, j)) return false;
        if (i != marked) rings.mark_near(ParticleId(i), io_marks);
        marked = i;
        return io_marks[j] == i;
    };
    std::erase_if(io_pairs, is_excluded);
}

void LiveRings::mark_near(ParticleId i, std::span<uint32_t> io_mark, uint32_t first) const {
    if (i >= begin.size()) return;
    if (edge.empty()) {
        for (const ParticleId third : member.subspan(begin[i], end[i] - begin[i])) {
            io_mark[third - first] = i;
            if (third >= begin.size()) continue;
            for (const ParticleId j : member.subspan(begin[third], end[third] - begin[third])) io_mark[j - first] = i;
        }
        return;
    }
    const auto intact = [&](uint32_t s) { return edge_intact[edge[s]] != 0; };
    for (uint32_t s = begin[i]; s < end[i]; ++s) {
        if (!intact(s)) continue;
        const ParticleId third = member[s];
        io_mark[third - first] = i;
        if (third < begin.size())
            for (uint32_t t = begin[third]; t < end[third]; ++t)
                if (intact(t)) io_mark[member[t] - first] = i;
    }
}

namespace {

// What the sweep finds and the filter does not exclude but for the rings, in chunks that threads share.
void find_in_sweep(const PairFilter& filter, const WorkerPool& workers, OverlapScratch& s, std::vector<Pair>& out) {
    constexpr size_t kRows = 128;
    const size_t n = s.sweep.n_rows(), n_chunks = (n + kRows - 1) / kRows;
    if (s.chunks.size() < n_chunks) s.chunks.resize(n_chunks);
    workers.for_each(n_chunks, [&](size_t k) {
        s.chunks[k].clear();
        s.sweep.find(k * kRows, std::min(n, (k + 1) * kRows), s.chunks[k]);
        if (filter.excludes_by_rings_alone()) return;
        std::erase_if(s.chunks[k], [&](const Pair& pair) { return !filter.is_possible(pair.first, pair.second); });
    });
    for (size_t k = 0; k < n_chunks; ++k) out.insert(out.end(), s.chunks[k].begin(), s.chunks[k].end());
}

}  // namespace

void find_overlaps(std::span<const Aabb> boxes, const PairFilter& filter, const WorkerPool& workers, OverlapScratch& s,
                   std::vector<Pair>& out) {
    out.clear();
    SUNDER_ASSERT(filter.item.empty() || filter.item.size() == boxes.size());
    SUNDER_ASSERT(filter.n_particles <= boxes.size());
    s.usable.resize(boxes.size());
    for (size_t i = 0; i < boxes.size(); ++i) s.usable[i] = is_usable(boxes[i]);
    const bool is_crowded = s.sweep.sort(boxes, s.usable, workers) > kSweepTests * boxes.size();
    if (is_crowded)
        find_in_grid(boxes, s, out);
    else
        find_in_sweep(filter, workers, s, out);
    if (!is_crowded && filter.rings.begin.empty()) return;
    s.near.clear();
    filter.remove_excluded(s.near, out);
}

void find_in_grid(std::span<const Aabb> boxes, OverlapScratch& s, std::vector<Pair>& out) {
    out.clear();
    const double median = median_extent(boxes, s.extents);
    if (s.extents.size() < 2) return;
    // Points have no extent; their cells then follow from how far they lie apart.
    Aabb bounds;
    for (const Aabb& box : boxes)
        if (is_usable(box)) {
            bounds.extend(box.min);
            bounds.extend(box.max);
        }
    const double spread = largest_extent(bounds);
    const double cell = kFinestCell * std::max(median, 1e-6 * spread);
    if (!(cell > 0)) {  // everything is one and the same point
        for (uint32_t i = 0; i < boxes.size(); ++i)
            for (uint32_t j = i + 1; j < boxes.size(); ++j)
                if (is_usable(boxes[i]) && is_usable(boxes[j])) out.push_back({i, j});
        return;
    }
    // Counted from the middle box, so that a single runaway cannot spoil the resolution of the rest.
    Vec3 origin;
    for (int axis = 0; axis < 3; ++axis) {
        s.extents.clear();
        for (const Aabb& box : boxes)
            if (is_usable(box)) s.extents.push_back(box.min[axis]);
        origin[axis] = number_of_rank(s.extents, s.extents.size() / 2);
    }
    Level levels[kLevels];
    double size = cell;
    for (int l = 0; l < kLevels; ++l, size *= kLevelRatio) levels[l] = {origin, 1 / size, static_cast<uint64_t>(l)};
    levels[kLevels - 1].inverse_size = 0;  // the coarsest level is a single cell: it takes what fits nowhere

    s.level.resize(boxes.size());
    bool inhabited[kLevels] = {};
    for (size_t i = 0; i < boxes.size(); ++i) {
        s.level[i] = kLevels;
        if (!is_usable(boxes[i])) continue;
        const double extent = largest_extent(boxes[i]);
        int l = 0;
        for (double fits = cell; l < kLevels - 1 && extent > fits; ++l) fits *= kLevelRatio;
        s.level[i] = static_cast<uint8_t>(l);
        inhabited[l] = true;
    }
    s.entries.clear();
    for (uint32_t i = 0; i < boxes.size(); ++i)
        for (int l = s.level[i]; l < kLevels; ++l) {
            if (!inhabited[l]) continue;
            const auto lo = levels[l].cell(boxes[i].min), hi = levels[l].cell(boxes[i].max);
            for (int64_t x = lo[0]; x <= hi[0]; ++x)
                for (int64_t y = lo[1]; y <= hi[1]; ++y)
                    for (int64_t z = lo[2]; z <= hi[2]; ++z)
                        s.entries.push_back({levels[l].key(x, y, z), i, l > s.level[i]});
        }
    sort_into_buckets(s);

    for (size_t bucket = 0; bucket + 1 < s.bucket_begin.size(); ++bucket)
        for (uint32_t p = s.bucket_begin[bucket]; p < s.bucket_begin[bucket + 1]; ++p) {
            if (s.sorted[p].visitor) continue;
            const Aabb& box_p = boxes[s.sorted[p].item];
            const Level& level = levels[s.sorted[p].key >> 60];
            for (uint32_t q = s.bucket_begin[bucket]; q < s.bucket_begin[bucket + 1]; ++q) {
                const auto &ep = s.sorted[p], &eq = s.sorted[q];
                if (eq.key != ep.key || (!eq.visitor && q <= p)) continue;  // residents meet once, visitors never
                const Aabb& box_q = boxes[eq.item];
                if (!overlap(box_p, box_q)) continue;
                const auto owner = level.cell(Vec3(box_p.min.cwiseMax(box_q.min)));
                if (level.key(owner[0], owner[1], owner[2]) != ep.key) continue;
                out.push_back({ep.item, eq.item});
            }
        }
}

}  // namespace sunder
