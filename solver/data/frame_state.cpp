#include "solver/data/frame_state.h"

#include <xxhash.h>

#include <algorithm>

namespace sunder {
namespace {

// Hashes the bits of the numbers alone (never padding), array after array with its length first.
class Hasher {
public:
    Hasher() : state_(XXH3_createState()) { XXH3_64bits_reset(state_); }
    ~Hasher() { XXH3_freeState(state_); }
    Hasher(const Hasher&) = delete;
    Hasher& operator=(const Hasher&) = delete;

    void add(const void* data, size_t bytes) { XXH3_64bits_update(state_, data, bytes); }
    void add(double v) { add(&v, sizeof v); }
    void add(uint64_t v) { add(&v, sizeof v); }
    void add(const Vec3& v) { add(v.data(), sizeof(double) * 3); }
    void add(const Quat& q) { add(q.coeffs().data(), sizeof(double) * 4); }
    void add(const Mat3& m) { add(m.data(), sizeof(double) * 9); }
    template <class T>
    void add(const std::vector<T>& values) {
        add(uint64_t{values.size()});
        for (const T& v : values) add(v);
    }
    void add(const std::vector<uint8_t>& values) {
        add(uint64_t{values.size()});
        add(values.data(), values.size());
    }
    void add(const LayerStrain& layers) { add(layers.data(), sizeof layers); }
    void add(const EdgeOffsets& e) {
        for (const MemberOffset& member : e) add(member.shift), add(member.turn);
    }
    void add(const RigidBodyState& r) { add(r.position), add(r.orientation), add(r.velocity), add(r.angular_velocity); }
    void add(const ContactMemory& c) {
        add(uint64_t{c.a.value}), add(uint64_t{c.b.value});
        add(c.point), add(c.normal_force), add(c.friction_force), add(c.rolling_torque);
    }
    void add(const Inactivity& i) {
        add(uint64_t{i.what}), add(i.due[0]), add(i.due[1]), add(i.push), add(i.former_push);
        if (i.followed != HUGE_VAL) add(i.followed);
    }
    void add(const BrokenEdge& b) { add(uint64_t{b.edge.value}), add(b.time), add(b.strain); }
    uint64_t digest() const { return XXH3_64bits_digest(state_); }

private:
    XXH3_state_t* state_;
};

}  // namespace

bool has_offsets(const FrameState& state) {
    return std::ranges::any_of(state.edge_offset, [](const EdgeOffsets& e) { return e != EdgeOffsets(); });
}

bool is_yielding(const FrameState& state) {
    return std::ranges::any_of(state.yielding_rate, [](double rate) { return rate != 0; });
}

uint64_t state_hash(const FrameState& s) {
    Hasher h;
    h.add(s.time);
    h.add(s.position), h.add(s.orientation), h.add(s.velocity), h.add(s.angular_velocity);
    h.add(s.plastic_deformation), h.add(s.yield), h.add(s.strain), h.add(s.group_rotation);
    h.add(s.edge_intact), h.add(s.rigid_bodies), h.add(s.contacts), h.add(s.broken);
    if (!s.asleep.empty()) h.add(s.still_time), h.add(s.asleep), h.add(s.rest_load), h.add(s.rest_conditions);
    if (!s.plastic_curvature.empty()) h.add(s.plastic_curvature), h.add(s.layer_strain);
    if (has_offsets(s)) h.add(s.edge_offset);
    if (is_yielding(s)) h.add(s.yielding_rate);
    if (!s.edge_damage.empty()) h.add(s.edge_damage), h.add(s.edge_hold), h.add(s.stiffness_factor);
    if (!s.inactive.empty()) h.add(s.inactive);
    if (!s.edge_bond.empty()) h.add(s.edge_bond);
    return h.digest();
}

uint64_t hash_of(std::span<const double> numbers) { return XXH3_64bits(numbers.data(), numbers.size_bytes()); }

bool FrameState::operator==(const FrameState& o) const {
    auto same_rotations = [](const std::vector<Quat>& a, const std::vector<Quat>& b) {
        if (a.size() != b.size()) return false;
        for (size_t i = 0; i < a.size(); ++i)
            if (a[i].coeffs() != b[i].coeffs()) return false;
        return true;
    };
    return time == o.time && position == o.position && same_rotations(orientation, o.orientation) &&
           velocity == o.velocity && angular_velocity == o.angular_velocity &&
           plastic_deformation == o.plastic_deformation && plastic_curvature == o.plastic_curvature &&
           layer_strain == o.layer_strain && edge_offset == o.edge_offset && yielding_rate == o.yielding_rate &&
           yield == o.yield && strain == o.strain && same_rotations(group_rotation, o.group_rotation) &&
           edge_intact == o.edge_intact && edge_damage == o.edge_damage && edge_hold == o.edge_hold &&
           stiffness_factor == o.stiffness_factor && inactive == o.inactive && edge_bond == o.edge_bond &&
           rigid_bodies == o.rigid_bodies && contacts == o.contacts && broken == o.broken &&
           still_time == o.still_time && asleep == o.asleep && rest_load == o.rest_load &&
           rest_conditions == o.rest_conditions;
}

}  // namespace sunder
