#include "fracture_tools/skin/normal_parts.h"

#include <algorithm>
#include <numeric>

#include "fracture_tools/mesh/counting_sort.h"

namespace sunder {

NormalParts::NormalParts(const SplitTopology& topology, uint32_t first_face, std::span<const uint32_t> smooth)
    : first_face_(first_face) {
    const uint32_t n_corners = static_cast<uint32_t>(smooth.size());
    const auto fan_of = [&](uint32_t c) { return topology.corner_fan(3 * first_face + c); };
    auto [fan_offset, by_fan] = group_by(n_corners, static_cast<uint32_t>(topology.n_fans()), fan_of);
    part_corner_ = std::move(by_fan);
    for (size_t f = 0; f + 1 < fan_offset.size(); ++f)
        std::sort(part_corner_.begin() + fan_offset[f], part_corner_.begin() + fan_offset[f + 1],
                  [&](uint32_t x, uint32_t y) { return std::pair(smooth[x], x) < std::pair(smooth[y], y); });
    vertex_part_.assign(topology.faces().n_vertices + 1, 0);
    for (uint32_t i = 0; i < n_corners; ++i) {
        const uint32_t c = part_corner_[i], fan = fan_of(c);
        if (part_fan_.empty() || part_fan_.back() != fan || part_smooth_.back() != smooth[c]) {
            part_fan_.push_back(fan), part_smooth_.push_back(smooth[c]), part_offset_.push_back(i);
            ++vertex_part_[topology.fan_pool_vertex(fan) + 1];
        }
    }
    part_offset_.push_back(n_corners);
    std::partial_sum(vertex_part_.begin(), vertex_part_.end(), vertex_part_.begin());
    corner_part_.resize(n_corners), part_listed_.resize(n_parts());
    for (uint32_t part = 0; part < n_parts(); ++part) {
        part_listed_[part] = part_offset_[part + 1] - part_offset_[part];
        for (uint32_t i = part_offset_[part]; i < part_offset_[part + 1]; ++i) corner_part_[part_corner_[i]] = part;
    }
    led_by_.resize(n_parts()), leads_.resize(n_parts());
    next_.resize(n_parts()), corner_leader_.resize(n_corners);
    leader_.reserve(n_parts()), vertex_.reserve(n_parts());  // what is not written to takes no memory
}

// Parts none of whose corners is listed take part in nothing.
void NormalParts::join_around(uint32_t pool_vertex, const SplitTopology& topology) {
    const uint32_t begin = vertex_part_[pool_vertex], end = vertex_part_[pool_vertex + 1];
    for (uint32_t part = begin; part < end; ++part) {
        led_by_[part] = next_[part] = kNone, leads_[part] = 0;
        if (part_listed_[part] == 0) continue;
        uint32_t before = part;
        while (before-- > begin)
            if (led_by_[before] != kNone && part_smooth_[before] == part_smooth_[part] &&
                topology.fan_class(part_fan_[before]) == topology.fan_class(part_fan_[part])) {
                led_by_[part] = led_by_[before], next_[before] = part;
                break;
            }
        if (led_by_[part] == kNone) led_by_[part] = part, leads_[part] = 1;
        for (uint32_t i = part_offset_[part]; i < part_offset_[part + 1]; ++i)
            corner_leader_[part_corner_[i]] = led_by_[part];
    }
}

void NormalParts::update(const SplitTopology& topology, const RangeRunner& run) {
    if (!topology.are_all_listed())
        for (const uint32_t f : topology.flipped_faces())
            for (uint32_t c = 0; c < 3 && f >= first_face_; ++c)
                part_listed_[corner_part_[3 * (f - first_face_) + c]] += topology.is_listed(f) ? 1 : -1;
    const auto changed = topology.changed_vertices();
    run(changed.size(), 128, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) join_around(changed[i], topology);
    });
    const size_t n_vertices = vertex_part_.size() - 1, n_chunks = topology.n_chunks();
    const auto first_part = [&](size_t chunk) {
        return vertex_part_[std::min(n_vertices, chunk * SplitTopology::kChunk)];
    };
    std::vector<uint32_t> first(n_chunks + 1, 0);
    for (size_t chunk = 0; chunk < n_chunks; ++chunk)
        first[chunk + 1] =
            std::accumulate(leads_.begin() + first_part(chunk), leads_.begin() + first_part(chunk + 1), first[chunk]);
    leader_.resize(first.back()), vertex_.resize(first.back());
    run(n_chunks, 4, [&](size_t begin, size_t end) {
        const uint8_t* const leads = leads_.data();
        const uint32_t* const fan = part_fan_.data();
        for (size_t chunk = begin; chunk < end; ++chunk) {
            uint32_t *leader = leader_.data() + first[chunk], *vertex = vertex_.data() + first[chunk];
            for (uint32_t part = first_part(chunk), last = first_part(chunk + 1); part < last; ++part)
                if (leads[part]) *leader++ = part, *vertex++ = topology.vertex_of_fan(fan[part]);
        }
    });
}

}  // namespace sunder
