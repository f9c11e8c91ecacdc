#include "nodes/types/state_cache.h"

#include <algorithm>
#include <limits>

namespace sunder {

size_t memory_of(const FrameState& state) {
    const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
    return sizeof state + bytes(state.position) + bytes(state.orientation) + bytes(state.velocity) +
           bytes(state.angular_velocity) + bytes(state.plastic_deformation) + bytes(state.yield) + bytes(state.strain) +
           bytes(state.group_rotation) + bytes(state.edge_intact) + bytes(state.rigid_bodies) + bytes(state.contacts) +
           bytes(state.broken) + bytes(state.still_time) + bytes(state.asleep) + bytes(state.rest_load) +
           bytes(state.rest_conditions) + bytes(state.edge_damage) + bytes(state.edge_hold) +
           bytes(state.stiffness_factor) + bytes(state.plastic_curvature) + bytes(state.inactive) +
           bytes(state.layer_strain) + bytes(state.edge_offset) + bytes(state.yielding_rate);
}

bool StateCache::is_given(int frame) const { return std::ranges::find(given_, frame) != given_.end(); }

bool StateCache::is_at_an_end(int frame) const { return frame == newest_put_ || frame == entries_.begin()->first; }

bool StateCache::is_kept(int frame) const {
    return is_at_an_end(frame) || is_given(frame) || (frame - entries_.begin()->first) % stride_ == 0;
}

void StateCache::put(int frame, Entry entry, size_t limit) {
    erase(frame);
    const int before = newest_put_;
    newest_put_ = frame;
    bytes_ += memory_of(*entry.state);
    entries_.emplace(frame, std::move(entry));
    if (entries_.contains(before) && !is_kept(before)) erase(before);
    thin(limit);
}

void StateCache::give(int frame, Entry entry, size_t limit) {
    for (auto it = entries_.upper_bound(frame); it != entries_.end() && !is_given(it->first);) erase((it++)->first);
    put(frame, std::move(entry), std::numeric_limits<size_t>::max());
    given_.push_back(frame);
    thin(limit);
}

void StateCache::thin(size_t limit) {
    const auto may_go = [&](const auto& kept) { return !is_at_an_end(kept.first) && !is_given(kept.first); };
    while (bytes_ > limit && std::ranges::any_of(entries_, may_go)) {
        stride_ *= 2;
        for (auto it = entries_.begin(); it != entries_.end();) {
            const int frame = (it++)->first;
            if (!is_kept(frame)) erase(frame);
        }
    }
    while (bytes_ > limit && given_.size() > 1) erase(given_.front());
}

const StateCache::Entry* StateCache::at(int frame) const {
    const auto found = entries_.find(frame);
    return found == entries_.end() ? nullptr : &found->second;
}

bool StateCache::latest(int frame, int& out_frame) const {
    auto it = entries_.upper_bound(frame);
    if (it == entries_.begin()) return false;
    out_frame = (--it)->first;
    return true;
}

void StateCache::erase(int frame) {
    const auto found = entries_.find(frame);
    if (found == entries_.end()) return;
    bytes_ -= memory_of(*found->second.state);
    std::erase(given_, frame);
    entries_.erase(found);
}

void StateCache::clear() { *this = StateCache(); }

}  // namespace sunder
