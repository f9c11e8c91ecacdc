#include "solver/collision/pairs_between_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "solver/collision/rank.h"
#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr size_t kGrain = 256;          // fewest a thread is worth waking for
constexpr double kSkin = 0.15;          // of a box: how much it is grown on every side
constexpr uint32_t kManyPartners = 16;  // a piece that meets more is not asked for each which of it meets it
constexpr size_t kMostAgain = 6;        // looked for again: one of so many at most
constexpr size_t kMostTests = 256;      // of pieces' boxes, a movable
constexpr int kPause = 8;               // updates

Aabb moved(const Aabb& box, const Vec3& by) { return {box.min + by, box.max + by}; }

Aabb grown(Aabb box) {
    const double by = kSkin * (box.max - box.min).maxCoeff();
    box.min.array() -= by, box.max.array() += by;
    return box;
}

// How far most boxes went, the median of a sample: a few that fly off do not change it.
Vec3 common_way(std::span<const Aabb> from, std::span<const Aabb> to) {
    constexpr size_t kSample = 128;
    const size_t stride = from.size() / kSample + 1;
    std::array<double, kSample> sample;
    Vec3 common = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
        size_t n = 0;
        for (size_t i = 0; i < from.size(); i += stride) {
            const double way = 0.5 * (to[i].min[axis] + to[i].max[axis] - (from[i].min[axis] + from[i].max[axis]));
            if (std::isfinite(way)) sample[n++] = way;
        }
        if (n > 0) common[axis] = number_of_rank(std::span(sample).first(n), n / 2);
    }
    return common;
}

}  // namespace

void PairsBetweenPieces::renumber(std::span<const ParticleId> former) {
    are_known_ = false, is_renumbered_ = true;
    if (grown_.empty()) return;
    SUNDER_ASSERT(with_.size() == grown_.size());
    std::vector<uint32_t> now(n_remembered_particles_, kNone);
    for (uint32_t i = 0; i < former.size(); ++i)
        if (former[i] < now.size()) now[former[i]] = i;
    const auto now_of = [&](uint32_t i) { return i < now.size() ? now[i] : kNone; };
    const std::vector<Aabb> grown = std::move(grown_);
    const std::vector<MovableId> with = std::move(with_);
    grown_.assign(former.size(), Aabb()), with_.assign(former.size(), MovableId::none());
    for (uint32_t i = 0; i < former.size(); ++i)
        if (former[i] < now.size()) grown_[i] = grown[former[i]], with_[i] = MovableId(now_of(with[former[i]]));
    n_remembered_particles_ = former.size();
    std::erase_if(pairs_, [&](Pair& pair) {
        pair = {now_of(pair.first), now_of(pair.second)};
        return pair.first == kNone || pair.second == kNone;
    });
}

void PairsBetweenPieces::take_pieces(std::span<const PieceId> piece, size_t n_movables) {
    piece_.assign(piece.begin(), piece.end());
    uint32_t n_items = 0;
    for (const PieceId p : piece) n_items = std::max(n_items, p + 1);
    for (size_t i = piece.size(); i < n_movables; ++i) piece_.push_back(PieceId(n_items++));
    begin_.assign(n_items + 1, 0);
    for (const PieceId p : piece_) ++begin_[p + 1];
    for (uint32_t p = 0; p < n_items; ++p) begin_[p + 1] += begin_[p];
    member_.resize(piece_.size());
    std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (MovableId i(0); i < piece_.size(); ++i) member_[next[piece_[i]]++] = i;
}

std::span<const Pair> PairsBetweenPieces::update(std::span<const Aabb> boxes, std::span<const PieceId> piece,
                                                 PairFilter filter, const WorkerPool& workers) {
    SUNDER_ASSERT(piece.size() <= boxes.size() && (!are_known_ || piece_.size() == boxes.size()));
    if (self_collision_ != filter.self_collision) reset();
    self_collision_ = filter.self_collision;
    const size_t n = boxes.size();
    if (!are_known_) take_pieces(piece, n);
    are_known_ = true;
    if (begin_.size() <= 2) return {};  // a single piece
    filter.item = numbers(std::span<const PieceId>(piece_));
    filter.rings = {};  // those of different pieces hold nothing in common
    if (!grown_.empty()) {
        grown_.resize(n), with_.resize(n);
        n_remembered_particles_ = piece.size();
        ++age_;
        const size_t n_left = find_who_left(boxes, workers);
        const size_t most = std::min(n / kMostAgain, kMostTests * n / (begin_.size() - 1));
        if (n_left <= most) {
            if (n_left > 0) find_again(boxes, filter, workers);
            return pairs_;
        }
        if (age_ == 1 && !is_renumbered_) pause_ = kPause;
        grown_.clear();
    }
    find_all(boxes, filter, workers);
    is_renumbered_ = false;
    return pairs_;
}

size_t PairsBetweenPieces::find_who_left(std::span<const Aabb> boxes, const WorkerPool& workers) {
    origin_ = common_way(grown_, boxes);
    has_left_.resize(boxes.size());
    workers.for_range(boxes.size(), kGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            has_left_[i] = with_[i] != first_of_piece(i) || !holds(grown_[i], moved(boxes[i], -origin_));
    });
    return static_cast<size_t>(std::ranges::count(has_left_, uint8_t{1}));
}

// Pairs of who left.
void PairsBetweenPieces::find_again(std::span<const Aabb> boxes, const PairFilter& filter, const WorkerPool& workers) {
    constexpr size_t kChunk = 16;
    std::erase_if(pairs_, [&](const Pair& pair) { return has_left_[pair.first] || has_left_[pair.second]; });
    left_.clear();
    for (MovableId i(0); i < boxes.size(); ++i) {
        if (!has_left_[i]) continue;
        grown_[i] = grown(moved(boxes[i], -origin_)), with_[i] = first_of_piece(i);
        if (is_usable(grown_[i])) left_.push_back(i);
    }
    bound_pieces(grown_, workers);
    of_pieces_.usable.resize(box_.size());
    for (size_t p = 0; p < box_.size(); ++p) of_pieces_.usable[p] = is_usable(box_[p]);
    of_pieces_.sweep.sort(box_, of_pieces_.usable, workers);
    const auto find = [&](MovableId i, std::vector<uint32_t>& met, std::vector<Pair>& out) {
        const Aabb& own = grown_[i];
        of_pieces_.sweep.find_with(own, met);
        for (const uint32_t p : met) {
            if (p == piece_[i]) continue;
            for (const MovableId j : members(p))
                if (overlap(own, grown_[j]) && !(has_left_[j] && j < i) && filter.is_possible(i, j))
                    out.push_back(std::minmax(i.value, j.value));
        }
    };
    const size_t n_chunks = (left_.size() + kChunk - 1) / kChunk;
    std::vector<std::vector<Pair>>& found = of_movables_.chunks;
    if (found.size() < n_chunks) found.resize(n_chunks);
    met_.resize(static_cast<size_t>(workers.threads()));
    workers.for_each_in_slots(n_chunks, [&](size_t k, size_t slot) {
        found[k].clear();
        for (size_t m = kChunk * k; m < std::min(left_.size(), kChunk * (k + 1)); ++m)
            find(left_[m], met_[slot], found[k]);
    });
    for (size_t k = 0; k < n_chunks; ++k) pairs_.insert(pairs_.end(), found[k].begin(), found[k].end());
}

void PairsBetweenPieces::bound_pieces(std::span<const Aabb> boxes, const WorkerPool& workers) {
    box_.resize(begin_.size() - 1);
    workers.for_range(begin_.back(), kGrain, [&](size_t begin, size_t end) {  // by movables: pieces differ in size
        const auto piece_from = [&](size_t at) {
            return static_cast<size_t>(std::ranges::lower_bound(begin_, at) - begin_.begin());
        };
        for (size_t p = piece_from(begin), last = piece_from(end); p < last; ++p) {
            box_[p] = Aabb();
            for (const MovableId i : members(p)) box_[p].extend(boxes[i].min), box_[p].extend(boxes[i].max);
        }
    });
}

void PairsBetweenPieces::find_all(std::span<const Aabb> exact, const PairFilter& filter, const WorkerPool& workers) {
    const size_t n = exact.size();
    age_ = 0;
    ++n_rebuilds_;
    std::span<const Aabb> boxes = exact;
    if (pause_ > 0) {
        --pause_;
    } else {
        origin_ = Vec3::Zero();
        grown_.resize(n), with_.resize(n);
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i) grown_[i] = grown(exact[i]), with_[i] = first_of_piece(i);
        });
        boxes = grown_;
    }
    bound_pieces(boxes, workers);
    find_overlaps(box_, {}, workers, of_pieces_, meetings_);
    pairs_.clear();
    if (meetings_.empty()) return;

    partners_.assign(box_.size(), 0);
    for (const auto& [p, q] : meetings_) ++partners_[p], ++partners_[q];
    exposed_.assign(n, Aabb());
    const auto expose = [&](uint32_t p, const Aabb& to) {
        if (partners_[p] == 0) return;  // all of it is
        const bool all = partners_[p] > kManyPartners;
        for (const MovableId i : members(p))
            if (all || overlap(boxes[i], to)) exposed_[i] = boxes[i];
        if (all) partners_[p] = 0;
    };
    for (const auto& [p, q] : meetings_) expose(p, box_[q]), expose(q, box_[p]);
    find_overlaps(exposed_, filter, workers, of_movables_, pairs_);
    for (auto& [i, j] : pairs_)
        if (i > j) std::swap(i, j);
}

}  // namespace sunder
