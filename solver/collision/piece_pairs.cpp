#include "solver/collision/piece_pairs.h"

#include <Eigen/LU>
#include <algorithm>

#include "solver/polar_decomposition.h"

namespace sunder {
namespace {

constexpr uint32_t kNone = 0xffffffffu;
constexpr double kSkin = 0.15;     // of a mean box: how much boxes are grown on every side
constexpr size_t kMostAgain = 6;   // looked for again: one of so many at most,
constexpr size_t kMostAlone = 32;  // and no more, for each is tested against the whole piece
constexpr double kMostTurn = 0.5;  // rad a step; faster pieces are followed without their turning

struct RigidMotion {
    Vec3 center = Vec3::Zero(), velocity = Vec3::Zero(), spin = Vec3::Zero();
};

RigidMotion rigid_motion(const ParticleMotion& in, std::span<const uint32_t> members) {
    RigidMotion m;
    const double n = static_cast<double>(members.size());
    const Vec3 origin = in.position[members.front()];
    for (const uint32_t i : members) m.center += (in.position[i] - origin) / n, m.velocity += in.velocity[i] / n;
    m.center += origin;
    Vec3 L = Vec3::Zero();
    Mat3 H = Mat3::Zero();
    for (const uint32_t i : members) {
        const Vec3 r = in.position[i] - m.center;
        L += r.cross(in.velocity[i] - m.velocity);
        H += r.squaredNorm() * Mat3::Identity() - r * r.transpose();
    }
    const Vec3 spin = (H + 1e-9 * H.trace() * Mat3::Identity()).inverse() * L;
    if (spin.norm() * in.duration < kMostTurn) m.spin = spin;  // and not where it is not finite
    return m;
}

// Box in the frame of the piece: the particle's ball, moved by what it does beyond the piece's rigid motion. That
// motion is not straight, while contacts are found on straight paths: two that touch on them are no farther apart than
// their reach and what turning adds to it, theta (their reach + ...), hence theta / (1 - theta).
Aabb box_in_piece(const ParticleMotion& in, const RigidMotion& m, const Quat& turn, uint32_t i) {
    const Quat back = turn.conjugate();
    const Vec3 r = in.position[i] - m.center;
    const Vec3 way = in.duration * (in.velocity[i] - m.velocity - m.spin.cross(r));
    const double theta = in.duration * m.spin.norm();
    const double radius = in.radius[i] + theta / (1 - theta) * (in.radius[i] + way.norm());
    const Vec3 from = back * r, to = from + back * way, reach = Vec3::Constant(radius * (1 + 1e-9));
    return {from.cwiseMin(to) - reach, from.cwiseMax(to) + reach};
}

}  // namespace

void PiecePairs::reset() {
    pieces_.clear();
    are_known_ = false;
}

void PiecePairs::renumber(std::span<const uint32_t> former) {
    std::vector<uint32_t> now;  // by former number
    for (uint32_t i = 0; i < former.size(); ++i) {
        if (former[i] == kNone) continue;
        now.resize(former[i] + 1, kNone);
        now.back() = i;
    }
    const auto is_gone = [&](uint32_t i) { return i >= now.size() || now[i] == kNone; };
    std::erase_if(pieces_, [&](const Piece& p) { return std::ranges::any_of(p.member, is_gone); });
    for (Piece& p : pieces_) {
        for (uint32_t& i : p.member) i = now[i];
        for (std::vector<Pair>* pairs : {&p.pairs, &p.excluded})
            for (auto& [i, j] : *pairs) i = now[i], j = now[j];
    }
    are_known_ = false;
}

void PiecePairs::take_pieces(std::span<const uint32_t> piece) {
    std::vector<Piece> old = std::move(pieces_);
    std::vector<uint32_t> size, index;                  // by piece; place in pieces_, from 1
    std::vector<uint32_t> parent(piece.size(), kNone);  // in `old`
    for (const uint32_t p : piece) {
        if (p >= size.size()) size.resize(p + 1, 0);
        ++size[p];
    }
    for (uint32_t k = 0; k < old.size(); ++k)
        for (const uint32_t i : old[k].member) parent[i] = k;
    pieces_.clear();
    index.assign(size.size(), 0);
    for (uint32_t i = 0; i < piece.size(); ++i) {
        const uint32_t p = piece[i];
        if (size[p] < 3) continue;
        if (index[p] == 0) {
            pieces_.emplace_back();
            index[p] = static_cast<uint32_t>(pieces_.size());
        }
        pieces_[index[p] - 1].member.push_back(i);
    }
    for (Piece& now : pieces_) {
        const uint32_t k = parent[now.member.front()];
        if (k == kNone || std::ranges::any_of(now.member, [&](uint32_t i) { return parent[i] != k; })) continue;
        if (old[k].member.size() == now.member.size())
            now = std::move(old[k]);
        else
            inherit(old[k], piece, now);
    }
}

// What a piece knows of a part that came off it; takes the part's pairs out of it.
void PiecePairs::inherit(Piece& io_parent, std::span<const uint32_t> piece, Piece& io_child) {
    Piece& child = io_child;
    child.turn = io_parent.turn;
    Vec3 center = Vec3::Zero();
    size_t k = 0;
    for (const uint32_t i : child.member) {
        while (io_parent.member[k] != i) ++k;
        child.ring_size.push_back(io_parent.ring_size[k]);
        child.remembered.push_back(io_parent.remembered[k]);
        child.grown.push_back(io_parent.grown[k]);
        center += io_parent.remembered[k] / static_cast<double>(child.member.size());
    }
    for (Vec3& x : child.remembered) x -= center;
    for (Aabb& box : child.grown) box.min -= center, box.max -= center;
    const uint32_t own = piece[child.member.front()];
    const auto take = [&](std::vector<Pair>& io_from, std::vector<Pair>& to) {
        std::erase_if(io_from, [&](const Pair& pair) {
            const uint32_t a = piece[pair.first], b = piece[pair.second];
            if (a == own && b == own) to.push_back(pair);
            return a != b || a == own;
        });
    };
    take(io_parent.pairs, child.pairs), take(io_parent.excluded, child.excluded);
}

void PiecePairs::refresh(const ParticleMotion& in, const PairFilter& filter, Piece& io_piece) {
    Piece& p = io_piece;
    const RigidMotion m = rigid_motion(in, p.member);
    p.is_fresh = p.is_changed = false;
    if (!p.remembered.empty()) {
        Mat3 A = Mat3::Zero();
        for (size_t k = 0; k < p.member.size(); ++k)
            A += (in.position[p.member[k]] - m.center) * p.remembered[k].transpose();
        p.turn = optimal_rotation(A, p.turn);
        std::vector<uint32_t> left;  // places in `member`
        std::vector<Aabb> box;       // as left
        const size_t most = std::min(p.member.size() / kMostAgain, kMostAlone);
        for (uint32_t k = 0; k < p.member.size() && left.size() <= most; ++k) {
            const Aabb now = box_in_piece(in, m, p.turn, p.member[k]);
            if (!holds(p.grown[k], now)) left.push_back(k), box.push_back(now);
        }
        if (left.size() <= most) {
            take_in(filter, p);
            if (left.empty()) return;
            for (size_t k = 0; k < left.size(); ++k) {
                p.remembered[left[k]] = p.turn.conjugate() * (in.position[p.member[left[k]]] - m.center);
                const double by = kSkin * (box[k].max - box[k].min).maxCoeff();
                p.grown[left[k]] = {box[k].min.array() - by, box[k].max.array() + by};
            }
            return find_again(filter, left, p);
        }
    }
    p.is_fresh = p.is_changed = true;
    p.turn = Quat::Identity();
    p.remembered.clear(), p.grown.clear();
    double extent = 0;
    for (const uint32_t i : p.member) {
        p.remembered.push_back(in.position[i] - m.center);
        p.grown.push_back(box_in_piece(in, m, p.turn, i));
        extent += (p.grown.back().max - p.grown.back().min).maxCoeff() / static_cast<double>(p.member.size());
    }
    for (Aabb& box : p.grown) box.min.array() -= kSkin * extent, box.max.array() += kSkin * extent;
    find_pairs(filter, p);
}

// Pairs that are no longer near one another. An edge is on the way from one to the other only if it begins at either.
void PiecePairs::take_in(const PairFilter& filter, Piece& io_piece) {
    Piece& p = io_piece;
    const uint32_t first = p.member.front();
    std::vector<uint8_t> is_changed;
    for (size_t k = 0; k < p.member.size(); ++k) {
        const uint32_t i = p.member[k], size = filter.rings.end[i] - filter.rings.begin[i];
        if (p.ring_size[k] == size) continue;
        p.ring_size[k] = size;
        is_changed.resize(p.member.back() - first + 1, 0);
        is_changed[i - first] = 1;
    }
    if (is_changed.empty()) return;
    std::erase_if(p.excluded, [&](const Pair& pair) {
        const auto [i, j] = pair;
        if ((!is_changed[i - first] && !is_changed[j - first]) || filter.excludes(i, j)) return false;
        p.pairs.push_back(pair);
        p.is_changed = true;
        return true;
    });
}

// Pairs of those at these places of `member`.
void PiecePairs::find_again(const PairFilter& filter, std::span<const uint32_t> places, Piece& io_piece) {
    Piece& p = io_piece;
    const uint32_t first = p.member.front();
    std::vector<uint8_t> has_left(p.member.back() - first + 1, 0);
    for (const uint32_t k : places) has_left[p.member[k] - first] = 1;
    for (std::vector<Pair>* pairs : {&p.pairs, &p.excluded})
        std::erase_if(*pairs,
                      [&](const Pair& pair) { return has_left[pair.first - first] || has_left[pair.second - first]; });
    for (const uint32_t k : places) {
        const uint32_t i = p.member[k];
        for (size_t other = 0; other < p.member.size(); ++other) {
            const uint32_t j = p.member[other];
            if (!overlap(p.grown[k], p.grown[other]) || i == j || (has_left[j - first] && j < i)) continue;
            (filter.excludes(i, j) ? p.excluded : p.pairs).push_back({std::min(i, j), std::max(i, j)});
        }
    }
    p.is_changed = true;
}

void PiecePairs::find_pairs(const PairFilter& filter, Piece& io_piece) {
    Piece& p = io_piece;
    OverlapScratch scratch;
    find_overlaps(p.grown, {}, WorkerPool(1), scratch, p.pairs);  // other threads have other pieces
    for (auto& [i, j] : p.pairs) i = p.member[i], j = p.member[j];
    p.excluded.clear();
    filter.remove_excluded(scratch.near, p.pairs, &p.excluded);
    for (std::vector<Pair>* pairs : {&p.pairs, &p.excluded})
        for (auto& [i, j] : *pairs)
            if (i > j) std::swap(i, j);
    p.ring_size.clear();
    for (const uint32_t i : p.member) p.ring_size.push_back(filter.rings.end[i] - filter.rings.begin[i]);
}

std::span<const Pair> PiecePairs::update(const ParticleMotion& motion, std::span<const uint32_t> piece,
                                         const PairFilter& filter, const WorkerPool& workers) {
    if (self_collision_ != filter.self_collision) reset();
    self_collision_ = filter.self_collision;
    if (!filter.self_collision) return {};
    bool changed = !are_known_;
    if (!are_known_) take_pieces(piece);
    are_known_ = true;
    workers.for_each(pieces_.size(), [&](size_t k) { refresh(motion, filter, pieces_[k]); });
    for (const Piece& p : pieces_) changed |= p.is_changed, n_rebuilds_ += p.is_fresh;
    if (!changed) return pairs_;
    pairs_.clear();
    for (const Piece& p : pieces_) pairs_.insert(pairs_.end(), p.pairs.begin(), p.pairs.end());
    return pairs_;
}

}  // namespace sunder
