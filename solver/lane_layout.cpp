#include "solver/lane_layout.h"

#include <algorithm>

namespace sunder {
namespace {

constexpr size_t kWindow = 512;    // particles that are sorted together: their records lie in the nearest cache
constexpr size_t kSmallUnit = 64;  // smaller pieces share a unit until it has as many particles

}  // namespace

bool LaneLayout::update(const LiveTopology& live) {
    if (version_ == live.version()) return false;
    version_ = live.version();
    units_.clear(), particle_.clear(), neighbour_.clear(), row_begin_.clear();
    lane_.assign(live.ends().size(), kNone);
    particle_.reserve(lane_.size() + kLanes);
    neighbour_.reserve(live.n_slots() + live.n_slots() / 8);  // what is padding on a lattice, and a little more
    std::vector<uint32_t> small;
    for (size_t piece = 0; piece < live.n_pieces(); ++piece) {
        const auto particles = live.piece_particles(piece);
        if (particles.size() == 1) continue;
        if (particles.size() >= kSmallUnit) {
            add_unit(live, particles);
            continue;
        }
        small.insert(small.end(), particles.begin(), particles.end());
        if (small.size() < kSmallUnit) continue;
        add_unit(live, small);
        small.clear();
    }
    if (!small.empty()) add_unit(live, small);
    return true;
}

void LaneLayout::add_unit(const LiveTopology& live, std::span<const uint32_t> particles) {
    sorted_.assign(particles.begin(), particles.end());
    for (size_t first = 0; first < sorted_.size(); first += kWindow)
        std::stable_sort(sorted_.begin() + first, sorted_.begin() + std::min(first + kWindow, sorted_.size()),
                         [&](uint32_t a, uint32_t b) { return live.count(a) > live.count(b); });
    const auto begin_block = static_cast<uint32_t>(n_blocks()), begin_row = static_cast<uint32_t>(n_rows());
    const uint32_t first = kLanes * begin_block;
    for (const uint32_t g : sorted_) {
        lane_[g] = static_cast<uint32_t>(particle_.size());
        particle_.push_back(g);
    }
    particle_.resize((particle_.size() + kLanes - 1) / kLanes * kLanes, kNone);
    row_begin_.push_back(0);
    for (size_t block = begin_block; block < n_blocks(); ++block) {
        uint32_t rows = 0;
        for (size_t lane = block * kLanes; lane < (block + 1) * kLanes; ++lane)
            if (particle_[lane] != kNone) rows = std::max(rows, live.count(particle_[lane]));
        row_begin_.push_back(row_begin_.back() + rows);
        for (uint32_t row = 0; row < rows; ++row)
            for (size_t lane = block * kLanes; lane < (block + 1) * kLanes; ++lane) {
                const uint32_t g = particle_[lane];
                const bool is_member = g != kNone && row < live.count(g);
                const size_t neighbour = is_member ? lane_[live.member(live.begin(g) + row)] : lane;
                neighbour_.push_back(static_cast<uint32_t>(neighbour) - first);
            }
    }
    units_.push_back({begin_block, static_cast<uint32_t>(n_blocks()), begin_row, static_cast<uint32_t>(n_rows())});
}

}  // namespace sunder
