#include "fracture_tools/cells/label_repair.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

/// Moving the cells beside one pinched edge may pinch another: a few rounds cure nearly all, more only go in circles.
constexpr int kMaxRounds = 8;

class Labels {
public:
    Labels(const CellComplex& complex, const CellFaceLists& lists, std::vector<uint32_t>& label, uint32_t wanted)
        : complex_(complex), lists_(lists), label_(label), n_labels_(wanted) {
        for (uint32_t l : label_) n_labels_ = std::max(n_labels_, l + 1);
    }

    void join_parts();
    void fill_empty(uint32_t wanted);
    void merge_surplus(uint32_t wanted);
    size_t cure_pinched_edges(bool count_only);
    uint32_t compact();
    uint32_t n_parts() const {
        std::vector<uint32_t> component_of;
        return static_cast<uint32_t>(components(component_of).size());
    }

private:
    struct Component {
        uint32_t label;
        double volume;
        std::vector<uint32_t> cells;
    };
    struct BoundarySide {
        uint32_t label, low, high, cell;
    };

    uint32_t across(uint32_t face, uint32_t cell) const {
        const CellFace& f = complex_.faces[face];
        return f.cell == cell ? f.neighbour : f.cell;
    }
    template <class Visit>
    void for_faces(uint32_t cell, Visit visit) const {
        for (uint32_t s = lists_.offset[cell]; s < lists_.offset[cell + 1]; ++s) visit(lists_.face[s]);
    }
    std::vector<Component> components(std::vector<uint32_t>& out_component_of) const;
    std::vector<BoundarySide> boundary_sides() const;
    std::vector<std::vector<uint32_t>> fans_at(const BoundarySide* begin, const BoundarySide* end) const;
    template <class MayTake>
    uint32_t best_neighbour(const std::vector<uint32_t>& cells, MayTake may_take) const;
    uint32_t best_neighbour(const std::vector<uint32_t>& cells) const {
        return best_neighbour(cells, [](uint32_t) { return true; });
    }
    std::vector<double> label_volumes() const;

    const CellComplex& complex_;
    const CellFaceLists& lists_;
    std::vector<uint32_t>& label_;
    uint32_t n_labels_;
};

std::vector<Labels::Component> Labels::components(std::vector<uint32_t>& out_component_of) const {
    std::vector<Component> found;
    out_component_of.assign(label_.size(), kNone);
    for (uint32_t start = 0; start < label_.size(); ++start) {
        if (out_component_of[start] != kNone) continue;
        Component part{label_[start], 0, {start}};
        out_component_of[start] = static_cast<uint32_t>(found.size());
        for (size_t k = 0; k < part.cells.size(); ++k) {
            const uint32_t cell = part.cells[k];
            part.volume += complex_.cell_volume[cell];
            for_faces(cell, [&](uint32_t face) {
                const uint32_t other = across(face, cell);
                if (other == kNone || label_[other] != part.label || out_component_of[other] != kNone) return;
                out_component_of[other] = out_component_of[start];
                part.cells.push_back(other);
            });
        }
        found.push_back(std::move(part));
    }
    return found;
}

/// The label whose cells that `may_take` share the most area with these cells of one label; kNone where there is none.
template <class MayTake>
uint32_t Labels::best_neighbour(const std::vector<uint32_t>& cells, MayTake may_take) const {
    std::map<uint32_t, double> area;
    for (uint32_t cell : cells)
        for_faces(cell, [&](uint32_t face) {
            const uint32_t other = across(face, cell);
            if (other != kNone && label_[other] != label_[cell] && may_take(other))
                area[label_[other]] += complex_.face_area(complex_.faces[face]);
        });
    uint32_t best = kNone;
    double best_area = -1;
    for (const auto& [label, a] : area)
        if (a > best_area) best = label, best_area = a;
    return best;
}

/// Keeps the largest part of each label; the others go to the neighbour that they share most area with. Only kept parts
/// take others in, hence they grow in each round and this ends. What no kept part can reach is a separate part of the
/// solid and becomes a label of its own.
void Labels::join_parts() {
    while (true) {
        std::vector<uint32_t> component_of;
        const std::vector<Component> parts = components(component_of);
        std::vector<uint32_t> largest(n_labels_, kNone);
        for (uint32_t c = 0; c < parts.size(); ++c) {
            uint32_t& kept = largest[parts[c].label];
            if (kept == kNone || parts[c].volume > parts[kept].volume) kept = c;
        }
        auto is_kept = [&](uint32_t cell) { return largest[parts[component_of[cell]].label] == component_of[cell]; };
        std::vector<std::pair<uint32_t, uint32_t>> moves;  // part, new label
        uint32_t stranded = kNone;
        for (uint32_t c = 0; c < parts.size(); ++c) {
            if (largest[parts[c].label] == c) continue;
            const uint32_t to = best_neighbour(parts[c].cells, is_kept);
            if (to != kNone)
                moves.emplace_back(c, to);
            else if (stranded == kNone)
                stranded = c;
        }
        if (moves.empty() && stranded == kNone) return;
        if (moves.empty()) moves.emplace_back(stranded, n_labels_++);
        for (const auto& [part, label] : moves)
            for (uint32_t cell : parts[part].cells) label_[cell] = label;
    }
}

std::vector<double> Labels::label_volumes() const {
    std::vector<double> volume(n_labels_, 0);
    for (size_t i = 0; i < label_.size(); ++i) volume[label_[i]] += complex_.cell_volume[i];
    return volume;
}

/// Gives labels without cells half of the largest one that can be halved.
void Labels::fill_empty(uint32_t wanted) {
    std::vector<std::vector<uint32_t>> cells(n_labels_);
    for (uint32_t i = 0; i < label_.size(); ++i) cells[label_[i]].push_back(i);
    std::vector<double> volume = label_volumes();
    const auto used =
        static_cast<uint32_t>(std::count_if(cells.begin(), cells.end(), [](const auto& c) { return !c.empty(); }));
    for (uint32_t empty = 0, missing = wanted > used ? wanted - used : 0; missing > 0 && empty < n_labels_; ++empty) {
        if (!cells[empty].empty()) continue;
        uint32_t from = kNone;
        for (uint32_t l = 0; l < n_labels_; ++l)
            if (cells[l].size() > 1 && (from == kNone || volume[l] > volume[from])) from = l;
        if (from == kNone) return;
        auto farthest = [&](const Vec3& p) {
            return *std::max_element(cells[from].begin(), cells[from].end(), [&](uint32_t x, uint32_t y) {
                return (complex_.cell_centroid[x] - p).squaredNorm() < (complex_.cell_centroid[y] - p).squaredNorm();
            });
        };
        const Vec3 one_end = complex_.cell_centroid[farthest(complex_.cell_centroid[cells[from].front()])];
        const Vec3 other_end = complex_.cell_centroid[farthest(one_end)];
        std::vector<uint32_t> kept;
        for (uint32_t cell : cells[from]) {
            const Vec3& p = complex_.cell_centroid[cell];
            const bool goes = (p - other_end).squaredNorm() < (p - one_end).squaredNorm();
            (goes ? cells[empty] : kept).push_back(cell);
        }
        if (cells[empty].empty()) {  // all in one place: any half will do
            cells[empty].assign(kept.begin() + kept.size() / 2, kept.end());
            kept.resize(kept.size() / 2);
        }
        cells[from] = std::move(kept);
        for (uint32_t cell : cells[empty]) label_[cell] = empty;
        for (uint32_t l : {from, empty}) {
            volume[l] = 0;
            for (uint32_t cell : cells[l]) volume[l] += complex_.cell_volume[cell];
        }
        --missing;
    }
}

/// Separate parts of the solid may have made too many labels: the smallest ones join a neighbour.
void Labels::merge_surplus(uint32_t wanted) {
    std::vector<std::vector<uint32_t>> cells(n_labels_);
    for (uint32_t i = 0; i < label_.size(); ++i) cells[label_[i]].push_back(i);
    std::vector<double> volume = label_volumes();
    size_t used = std::count_if(cells.begin(), cells.end(), [](const auto& c) { return !c.empty(); });
    std::vector<uint8_t> is_island(n_labels_, 0);
    while (used > wanted) {
        uint32_t smallest = kNone;
        for (uint32_t l = 0; l < n_labels_; ++l)
            if (!cells[l].empty() && !is_island[l] && (smallest == kNone || volume[l] < volume[smallest])) smallest = l;
        if (smallest == kNone) return;
        const uint32_t to = best_neighbour(cells[smallest]);
        if (to == kNone) {
            is_island[smallest] = 1;
            continue;
        }
        for (uint32_t cell : cells[smallest]) label_[cell] = to;
        cells[to].insert(cells[to].end(), cells[smallest].begin(), cells[smallest].end());
        volume[to] += volume[smallest];
        cells[smallest].clear();
        --used;
    }
}

/// The sides of the faces that bound labels, those of one label and edge together.
std::vector<Labels::BoundarySide> Labels::boundary_sides() const {
    std::vector<BoundarySide> sides;
    for (const CellFace& f : complex_.faces) {
        if (f.neighbour != kNone && label_[f.cell] == label_[f.neighbour]) continue;
        for (int c = 0; c < 3; ++c) {
            const auto [low, high] = std::minmax(f.vertices[c], f.vertices[(c + 1) % 3]);
            sides.push_back({label_[f.cell], low, high, f.cell});
            if (f.neighbour != kNone) sides.push_back({label_[f.neighbour], low, high, f.neighbour});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const BoundarySide& x, const BoundarySide& y) {
        return std::tie(x.label, x.low, x.high, x.cell) < std::tie(y.label, y.low, y.high, y.cell);
    });
    return sides;
}

/// Cells of one label around one edge, in groups that hang together by faces at that edge.
std::vector<std::vector<uint32_t>> Labels::fans_at(const BoundarySide* begin, const BoundarySide* end) const {
    std::vector<std::vector<uint32_t>> fans;
    auto is_taken = [&](uint32_t cell) {
        return std::any_of(fans.begin(), fans.end(),
                           [&](const auto& fan) { return std::find(fan.begin(), fan.end(), cell) != fan.end(); });
    };
    for (const BoundarySide* side = begin; side != end; ++side) {
        if (label_[side->cell] != side->label || is_taken(side->cell)) continue;
        fans.push_back({side->cell});
        for (size_t k = 0; k < fans.back().size(); ++k) {
            const uint32_t cell = fans.back()[k];
            for_faces(cell, [&](uint32_t face) {
                const Triangle& v = complex_.faces[face].vertices;
                const bool has_edge = std::find(v.begin(), v.end(), side->low) != v.end() &&
                                      std::find(v.begin(), v.end(), side->high) != v.end();
                const uint32_t other = across(face, cell);
                if (has_edge && other != kNone && label_[other] == side->label && !is_taken(other))
                    fans.back().push_back(other);
            });
        }
    }
    return fans;
}

/// Where a label has several fans around an edge, all but the largest go to a neighbour. Gives the number of edges
/// found.
size_t Labels::cure_pinched_edges(bool count_only) {
    const std::vector<BoundarySide> sides = boundary_sides();
    size_t found = 0;
    for (size_t i = 0, j; i < sides.size(); i = j) {
        auto same = [&](const BoundarySide& s) {
            return s.label == sides[i].label && s.low == sides[i].low && s.high == sides[i].high;
        };
        for (j = i; j < sides.size() && same(sides[j]);) ++j;
        if (j - i <= 2) continue;
        ++found;
        if (count_only) continue;
        std::vector<std::vector<uint32_t>> fans = fans_at(&sides[i], &sides[0] + j);
        auto volume = [&](const std::vector<uint32_t>& cells) {
            double v = 0;
            for (uint32_t cell : cells) v += complex_.cell_volume[cell];
            return v;
        };
        std::stable_sort(fans.begin(), fans.end(), [&](const auto& x, const auto& y) { return volume(x) > volume(y); });
        for (size_t k = 1; k < fans.size(); ++k)
            if (const uint32_t to = best_neighbour(fans[k]); to != kNone)
                for (uint32_t cell : fans[k]) label_[cell] = to;
    }
    return found;
}

uint32_t Labels::compact() {
    std::vector<uint32_t> number(n_labels_, kNone);
    for (uint32_t l : label_) number[l] = 0;
    uint32_t n = 0;
    for (uint32_t& x : number)
        if (x != kNone) x = n++;
    for (uint32_t& l : label_) l = number[l];
    return n;
}

}  // namespace

LabelRepair repair_labels(const CellComplex& complex, uint32_t wanted, std::vector<uint32_t>& io_label) {
    SUNDER_ASSERT(io_label.size() == complex.n_cells());
    const CellFaceLists lists(complex);
    std::vector<uint32_t> all_one(complex.n_cells(), 0);
    wanted = std::max(wanted, Labels(complex, lists, all_one, 1).n_parts());  // merging cannot go below that
    auto make_whole = [&](std::vector<uint32_t>& io) {
        // Halving may part a label, joining may empty one: twice is enough in practice, and harmless where it is not.
        for (int k = 0; k < 3; ++k) {
            Labels labels(complex, lists, io, wanted);
            labels.join_parts();
            labels.merge_surplus(wanted);
            labels.fill_empty(wanted);
        }
        Labels labels(complex, lists, io, wanted);
        labels.join_parts();
        return labels.cure_pinched_edges(true);
    };
    size_t fewest = make_whole(io_label);
    std::vector<uint32_t> trial = io_label;
    for (int round = 0; round < kMaxRounds && fewest > 0; ++round) {
        Labels(complex, lists, trial, wanted).cure_pinched_edges(false);
        if (const size_t left = make_whole(trial); left < fewest) fewest = left, io_label = trial;
    }
    return {Labels(complex, lists, io_label, wanted).compact(), fewest};
}

}  // namespace sunder
