// Things grouped by a small whole number, without comparing them.
#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace sunder {

struct Groups {
    std::vector<uint32_t> offset;  // (n_groups + 1), into the next
    std::vector<uint32_t> member;  // group after group, ascending in each

    std::span<const uint32_t> operator[](uint32_t group) const {
        return std::span(member).subspan(offset[group], offset[group + 1] - offset[group]);
    }
};

/// The numbers i of [0, n) by group_of(i), which lies in [0, n_groups).
template <class GroupOf>
Groups group_by(uint32_t n, uint32_t n_groups, const GroupOf& group_of) {
    Groups groups;
    groups.offset.assign(n_groups + 1, 0), groups.member.resize(n);
    for (uint32_t i = 0; i < n; ++i) ++groups.offset[group_of(i) + 1];
    std::partial_sum(groups.offset.begin(), groups.offset.end(), groups.offset.begin());
    std::vector<uint32_t> next(groups.offset.begin(), groups.offset.end() - 1);
    for (uint32_t i = 0; i < n; ++i) groups.member[next[group_of(i)]++] = i;
    return groups;
}

}  // namespace sunder
