#include "solver/collision/piece_pairs.h"

#include <algorithm>

#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr double kSkinInPiece = 0.15;    // of a mean box: how much boxes are grown on every side
constexpr size_t kMostAgainInPiece = 6;  // looked for again: one of so many at most,
constexpr size_t kMostAlone = 32;        // and no more, for each is tested against the whole piece
constexpr size_t kLeastShared = 512;     // particles of a piece that all threads work on together

Pair ascending(ParticleId i, ParticleId j) { return {std::min(i, j), std::max(i, j)}; }

// Calls find(k, near, out) for k in [0, n); puts what they found in order. `near` tells of whom each particle, from the
// first of the piece on, was last found near (LiveRings::mark_near).
template <class Find>
void collect(size_t n, size_t n_marks, const WorkerPool& workers, const Find& find, std::vector<Pair>& out) {
    std::vector<std::vector<Pair>> found(n);
    std::vector<std::vector<uint32_t>> near(static_cast<size_t>(workers.threads()));
    workers.for_each_in_slots(n, [&](size_t k, size_t slot) {
        near[slot].resize(n_marks, kNone);
        find(k, near[slot], found[k]);
    });
    for (const std::vector<Pair>& some : found) out.insert(out.end(), some.begin(), some.end());
}

}  // namespace

void PiecePairs::reset() {
    pieces_.clear();
    are_known_ = false;
}

void PiecePairs::renumber(std::span<const ParticleId> former) {
    std::vector<ParticleId> now;  // by former number
    for (ParticleId i(0); i < former.size(); ++i) {
        if (former[i].is_none()) continue;
        now.resize(former[i] + 1);
        now.back() = i;
    }
    const auto is_gone = [&](ParticleId i) { return i >= now.size() || now[i].is_none(); };
    std::erase_if(pieces_, [&](const Piece& p) { return std::ranges::any_of(p.member, is_gone); });
    for (Piece& p : pieces_) {
        for (ParticleId& i : p.member) i = now[i];
        for (ParticleId& i : p.ring) i = now[i];  // of the piece
        for (auto& [i, j] : p.pairs) i = now[i], j = now[j];
    }
    are_known_ = false;
}

void PiecePairs::take_pieces(std::span<const PieceId> piece, const LiveRings& rings, const WorkerPool& workers) {
    std::vector<Piece> old = std::move(pieces_);
    std::vector<uint32_t> size, index;                  // by piece; place in pieces_, from 1
    std::vector<uint32_t> parent(piece.size(), kNone);  // in `old`
    for (const PieceId p : piece) {
        if (p >= size.size()) size.resize(p + 1, 0);
        ++size[p];
    }
    for (uint32_t k = 0; k < old.size(); ++k)
        for (const ParticleId i : old[k].member) parent[i] = k;
    pieces_.clear();
    index.assign(size.size(), 0);
    for (ParticleId i(0); i < piece.size(); ++i) {
        const PieceId p = piece[i];
        if (size[p] < 3) continue;
        if (index[p] == 0) {
            pieces_.emplace_back();
            index[p] = static_cast<uint32_t>(pieces_.size());
        }
        pieces_[index[p] - 1].member.push_back(i);
    }
    std::vector<std::vector<uint32_t>> parts(old.size());  // in pieces_
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
        const std::vector<ParticleId>& member = pieces_[p].member;
        const uint32_t k = parent[member.front()];
        if (k != kNone && std::ranges::all_of(member, [&](ParticleId i) { return parent[i] == k; }))
            parts[k].push_back(p);
    }
    workers.for_each(old.size(), [&](size_t k) {
        for (const uint32_t p : parts[k]) {
            if (old[k].member.size() == pieces_[p].member.size()) {
                pieces_[p] = std::move(old[k]);
            } else {
                inherit(old[k], piece, pieces_[p]);
                remember_rings(rings, pieces_[p]);
            }
        }
    });
}

// What a piece knows of a part that came off it; takes the part's pairs out of it.
void PiecePairs::inherit(Piece& io_parent, std::span<const PieceId> piece, Piece& io_child) {
    Piece& child = io_child;
    child.turn = io_parent.turn;
    Vec3 center = Vec3::Zero();
    size_t k = 0;
    for (const ParticleId i : child.member) {
        while (io_parent.member[k] != i) ++k;
        child.remembered.push_back(io_parent.remembered[k]);
        child.grown.push_back(io_parent.grown[k]);
        center += io_parent.remembered[k] / static_cast<double>(child.member.size());
    }
    for (Vec3& x : child.remembered) x -= center;
    for (Aabb& box : child.grown) box.min -= center, box.max -= center;
    const PieceId own = piece[child.member.front()];
    std::erase_if(io_parent.pairs, [&](const Pair& pair) {
        const PieceId a = piece[pair.first], b = piece[pair.second];
        if (a == own && b == own) child.pairs.push_back(pair);
        return a != b || a == own;
    });
}

void PiecePairs::remember_rings(const LiveRings& rings, Piece& io_piece) {
    Piece& p = io_piece;
    p.ring.clear(), p.ring_end.clear();
    for (const ParticleId i : p.member) {
        p.ring.insert(p.ring.end(), rings.member.begin() + rings.begin[i], rings.member.begin() + rings.end[i]);
        p.ring_end.push_back(static_cast<uint32_t>(p.ring.size()));
    }
}

// Pairs that are no longer near one another: on each way from one to the other, one of the two lost a neighbour.
void PiecePairs::take_in(const LiveRings& rings, std::span<const PieceId> piece, Piece& io_piece) {
    Piece& p = io_piece;
    const ParticleId first = p.member.front();
    const size_t n_known = p.pairs.size();
    std::vector<uint32_t> place, near;  // in `member`; of whom it was last found near, or apart (particles from first)
    for (size_t k = 0; k < p.member.size(); ++k) {
        const ParticleId i = p.member[k];
        const std::span<const ParticleId> before = p.ring_of(k);
        if (before.size() == rings.end[i] - rings.begin[i]) continue;
        if (place.empty()) {
            place.resize(p.member.back() - first + 1), near.resize(place.size(), kNone);
            for (uint32_t m = 0; m < p.member.size(); ++m) place[p.member[m] - first] = m;
        }
        rings.mark_near(i, near, first);
        near[i - first] = i;
        const auto take = [&](ParticleId j) {
            if (near[j - first] == i || piece[j] != piece[i]) return;
            near[j - first] = i;
            if (overlap(p.grown[k], p.grown[place[j - first]])) p.pairs.push_back(ascending(i, j));
        };
        uint32_t slot = rings.begin[i];
        for (const ParticleId lost : before) {
            if (slot < rings.end[i] && rings.member[slot] == lost) {
                ++slot;
                continue;
            }
            take(lost);
            for (const ParticleId j : p.ring_of(place[lost - first])) take(j);
        }
    }
    if (place.empty()) return;
    const auto taken = p.pairs.begin() + static_cast<std::ptrdiff_t>(n_known);  // some twice: both lost a neighbour
    std::sort(taken, p.pairs.end());
    p.pairs.erase(std::unique(taken, p.pairs.end()), p.pairs.end());
    remember_rings(rings, p);
}

void PiecePairs::refresh(const PieceFrameKernels& kernels, const ParticleMotion& motion, const LiveRings& rings,
                         const WorkerPool& workers, Piece& io_piece) {
    Piece& p = io_piece;
    PieceFrame frame(kernels, motion, p.member, p.turn, workers);
    p.is_fresh = p.is_changed = false;
    if (!p.remembered.empty()) {
        std::vector<uint32_t> left;  // places in `member`
        frame.find_who_left(p.grown, left);
        if (!left.empty()) {
            frame.turn_to(p.remembered);
            p.turn = frame.turn();
            frame.find_who_left(p.grown, left);
        }
        if (left.empty()) return;
        if (left.size() <= std::min(p.member.size() / kMostAgainInPiece, kMostAlone)) {
            for (const uint32_t k : left) {
                p.remembered[k] = frame.position(k);
                const Aabb box = frame.box(k);
                const double by = kSkinInPiece * (box.max - box.min).maxCoeff();
                p.grown[k] = {box.min.array() - by, box.max.array() + by};
            }
            return find_again(rings, left, workers, p);
        }
    }
    p.is_fresh = p.is_changed = true;
    p.turn = Quat::Identity();
    frame.set_turn(p.turn);
    frame.find_boxes(p.grown);
    p.remembered.resize(p.member.size());
    double extent = 0;
    for (size_t k = 0; k < p.member.size(); ++k) {
        p.remembered[k] = frame.position(k);
        extent += (p.grown[k].max - p.grown[k].min).maxCoeff() / static_cast<double>(p.member.size());
    }
    for (Aabb& box : p.grown) box.min.array() -= kSkinInPiece * extent, box.max.array() += kSkinInPiece * extent;
    remember_rings(rings, p);
    find_pairs(rings, workers, p);
}

// Pairs of those at these places of `member`.
void PiecePairs::find_again(const LiveRings& rings, std::span<const uint32_t> places, const WorkerPool& workers,
                            Piece& io_piece) {
    Piece& p = io_piece;
    const ParticleId first = p.member.front();
    std::vector<uint8_t> has_left(p.member.back() - first + 1, 0);
    for (const uint32_t k : places) has_left[p.member[k] - first] = 1;
    std::erase_if(p.pairs,
                  [&](const Pair& pair) { return has_left[pair.first - first] || has_left[pair.second - first]; });
    const auto find = [&](size_t n, std::span<uint32_t> io_near, std::vector<Pair>& out) {
        const Aabb& own = p.grown[places[n]];
        const ParticleId i = p.member[places[n]];
        rings.mark_near(i, io_near, first);
        for (size_t other = 0; other < p.member.size(); ++other) {
            const ParticleId j = p.member[other];
            if (!overlap(own, p.grown[other]) || i == j || (has_left[j - first] && j < i)) continue;
            if (io_near[j - first] != i) out.push_back(ascending(i, j));
        }
    };
    collect(places.size(), has_left.size(), workers, find, p.pairs);
    p.is_changed = true;
}

void PiecePairs::find_pairs(const LiveRings& rings, const WorkerPool& workers, Piece& io_piece) {
    constexpr size_t kChunk = 4096;
    Piece& p = io_piece;
    const ParticleId first = p.member.front();
    OverlapScratch scratch;
    std::vector<Pair> places;  // in `member`
    find_overlaps(p.grown, {}, workers, scratch, places);
    const auto find = [&](size_t n, std::span<uint32_t> io_near, std::vector<Pair>& out) {
        uint32_t marked = kNone;
        for (const Pair& pair : std::span(places).subspan(n * kChunk, std::min(kChunk, places.size() - n * kChunk))) {
            const ParticleId i = p.member[pair.first], j = p.member[pair.second];
            if (i != marked) rings.mark_near(i, io_near, first);
            marked = i;
            if (io_near[j - first] != i) out.push_back(ascending(i, j));
        }
    };
    p.pairs.clear();
    collect((places.size() + kChunk - 1) / kChunk, p.member.back() - first + 1, workers, find, p.pairs);
}

std::span<const Pair> PiecePairs::update(const ParticleMotion& motion, std::span<const PieceId> piece,
                                         const PairFilter& filter, const WorkerPool& workers) {
    if (self_collision_ != filter.self_collision) reset();
    self_collision_ = filter.self_collision;
    if (!filter.self_collision) return {};
    SUNDER_ASSERT(filter.rings.edge.empty());
    SUNDER_ASSERT(filter.rings.begin.size() == piece.size() && filter.rings.end.size() == piece.size());
    bool changed = !are_known_;
    if (!are_known_) {
        workers.for_each(pieces_.size(), [&](size_t k) { take_in(filter.rings, piece, pieces_[k]); });
        take_pieces(piece, filter.rings, workers);
    }
    are_known_ = true;
    const PieceFrameKernels& kernels = piece_frame_kernels();
    // One that is so large a part of the scene that the others would not keep the threads busy is shared by all.
    const size_t least_shared = std::max(kLeastShared, piece.size() / (2 * static_cast<size_t>(workers.threads())));
    const auto is_shared = [&](const Piece& p) { return p.member.size() >= least_shared; };
    for (Piece& p : pieces_)
        if (is_shared(p)) refresh(kernels, motion, filter.rings, workers, p);
    const WorkerPool alone(1);
    workers.for_each(pieces_.size(), [&](size_t k) {
        if (!is_shared(pieces_[k])) refresh(kernels, motion, filter.rings, alone, pieces_[k]);
    });
    for (const Piece& p : pieces_) changed |= p.is_changed, n_rebuilds_ += p.is_fresh;
    if (!changed) return pairs_;
    pairs_.clear();
    for (const Piece& p : pieces_) pairs_.insert(pairs_.end(), p.pairs.begin(), p.pairs.end());
    return pairs_;
}

}  // namespace sunder
