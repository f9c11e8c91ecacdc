#include "solver/matching/lane_layout.h"

#include <algorithm>
#include <array>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr size_t kWindow = 512;    // particles that are sorted together: their records lie in the nearest cache
constexpr size_t kSmallUnit = 64;  // smaller pieces share a unit until it has as many particles

}  // namespace

bool LaneLayout::update(const LiveTopology& live, const WorkerPool& workers) {
    if (version_ == live.version()) return false;
    version_ = live.version();
    list_units(live);
    // Blocks and rows as they are counted: each window has its own.
    workers.for_each(windows_.size(), [&](size_t w) { sort_window(live, windows_[w]); });
    SUNDER_ASSERT(units_.size() <= windows_.size() && particle_.size() % kLanes == 0);
    uint32_t n_rows = 0;
    for (size_t u = 0; u < units_.size(); ++u) {
        Unit& unit = units_[u];
        uint32_t* const row_begin = row_begin_.data() + unit.begin_block + u;
        for (size_t block = 0; block < unit.n_blocks(); ++block) row_begin[block + 1] += row_begin[block];
        unit.begin_row = n_rows;
        unit.end_row = n_rows += row_begin[unit.n_blocks()];
    }
    neighbour_.resize(size_t{kLanes} * n_rows);
    workers.for_each(windows_.size(), [&](size_t w) { list_neighbours(live, windows_[w]); });
    return true;
}

void LaneLayout::list_units(const LiveTopology& live) {
    units_.clear(), windows_.clear(), particle_.clear();
    lane_.assign(live.ends().size(), kNone);
    particle_.reserve(lane_.size() + kLanes);
    const auto add_unit = [&](std::span<const ParticleId> particles) {
        const auto begin = static_cast<uint32_t>(n_blocks()), u = static_cast<uint32_t>(units_.size());
        particle_.insert(particle_.end(), particles.begin(), particles.end());
        particle_.resize((particle_.size() + kLanes - 1) / kLanes * kLanes);
        const auto end = static_cast<uint32_t>(n_blocks());
        units_.push_back({begin, end, 0, 0});
        for (uint32_t block = begin; block < end; block += kWindow / kLanes)
            windows_.push_back({u, block, std::min<uint32_t>(block + kWindow / kLanes, end)});
    };
    std::vector<ParticleId> small;
    for (size_t piece = 0; piece < live.n_pieces(); ++piece) {
        const auto particles = live.piece_particles(piece);
        if (particles.size() == 1) continue;
        if (particles.size() >= kSmallUnit) {
            add_unit(particles);
            continue;
        }
        small.insert(small.end(), particles.begin(), particles.end());
        if (small.size() < kSmallUnit) continue;
        add_unit(small);
        small.clear();
    }
    if (!small.empty()) add_unit(small);
    row_begin_.assign(n_blocks() + units_.size(), 0);
}

// Larger rings first, particles of one size as they were; rows of a block are counted where it ends.
void LaneLayout::sort_window(const LiveTopology& live, const Window& window) {
    ParticleId* const first = particle_.data() + size_t{kLanes} * window.begin_block;
    ParticleId* const end = particle_.data() + size_t{kLanes} * window.end_block;
    ParticleId* const last = std::find(first, end, ParticleId::none());  // padding ends a unit
    std::array<ParticleId, kWindow> before;
    std::copy(first, last, before.begin());
    const std::span<const ParticleId> particles(before.data(), static_cast<size_t>(last - first));
    uint32_t most = 0;
    for (const ParticleId g : particles) most = std::max(most, live.count(g));
    std::vector<uint32_t> place(most + 1, 0);  // of the next one, by how far its ring is from the largest
    for (const ParticleId g : particles) ++place[most - live.count(g) + 1];
    for (uint32_t i = 1; i <= most; ++i) place[i] += place[i - 1];
    for (const ParticleId g : particles) first[place[most - live.count(g)]++] = g;
    for (const ParticleId* at = first; at < last; ++at) lane_[*at] = static_cast<uint32_t>(at - particle_.data());
    for (size_t block = window.begin_block; block < window.end_block; ++block)
        row_begin_[block + window.unit + 1] = live.count(particle_[kLanes * block]);
}

void LaneLayout::list_neighbours(const LiveTopology& live, const Window& window) {
    const Unit& unit = units_[window.unit];
    const uint32_t first = kLanes * unit.begin_block;
    uint32_t* to = neighbour_.data() + size_t{kLanes} * (unit.begin_row + row_begin_[window.begin_block + window.unit]);
    for (size_t block = window.begin_block; block < window.end_block; ++block) {
        const uint32_t rows = live.count(particle_[kLanes * block]);
        for (uint32_t row = 0; row < rows; ++row)
            for (size_t lane = block * kLanes; lane < (block + 1) * kLanes; ++lane) {
                const ParticleId g = particle_[lane];
                const bool is_member = !g.is_none() && row < live.count(g);
                const size_t neighbour = is_member ? lane_[live.member(live.begin(g) + row)] : lane;
                *to++ = static_cast<uint32_t>(neighbour) - first;
            }
    }
}

}  // namespace sunder
