#include "nodes/files/state_file.h"

#include <algorithm>
#include <cmath>

#include "nodes/files/compression.h"
#include "nodes/files/ply_file.h"
#include "nodes/files/state_layout.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

// The four vectors of a placement, as particles and rigid bodies have them.
void put_placement(double*& p, const Vec3& x, const Quat& q, const Vec3& v, const Vec3& w) {
    for (int i = 0; i < 3; ++i) *p++ = x[i];
    *p++ = q.w(), *p++ = q.x(), *p++ = q.y(), *p++ = q.z();
    for (int i = 0; i < 3; ++i) *p++ = v[i];
    for (int i = 0; i < 3; ++i) *p++ = w[i];
}

void take_placement(const double* p, Vec3& x, Quat& q, Vec3& v, Vec3& w) {
    x = Vec3(p[0], p[1], p[2]), q = Quat(p[3], p[4], p[5], p[6]);
    v = Vec3(p[7], p[8], p[9]), w = Vec3(p[10], p[11], p[12]);
}

// Reads `n` doubles at `p` and says which of them is not finite, or -1. `may_be_infinite`: index that is exempt from
// infinity (never from NaN).
int load(const char* p, double* out, int n, int may_be_infinite = -1) {
    std::memcpy(out, p, sizeof(double) * static_cast<size_t>(n));
    for (int i = 0; i < n; ++i)
        if (!std::isfinite(out[i]) && (i != may_be_infinite || std::isnan(out[i]))) return i;
    return -1;
}

class Decoder {
public:
    Decoder(const PlyFile& file, std::string_view version, const std::string& where)
        : file_(file), version_(version), where_(where) {}

    Result<StateFile> decode() {
        for (Status (Decoder::*read)() :
             {&Decoder::check_layout, &Decoder::read_clock, &Decoder::read_particles, &Decoder::read_edges,
              &Decoder::read_groups, &Decoder::read_rigid_bodies, &Decoder::read_broken, &Decoder::read_contacts,
              &Decoder::read_rest, &Decoder::read_bending, &Decoder::read_damage, &Decoder::read_cause,
              &Decoder::read_inactive, &Decoder::read_offsets, &Decoder::read_strength_and_yielding})
            if (Status s = (this->*read)(); !s) return s.error();
        return std::move(out_);
    }

private:
    Status fault(const std::string& what) const { return bad_input(where_, what, "bake it again"); }
    Status not_finite(const PlyElement& e, size_t row, int property) const {
        return fault(e.name + " " + std::to_string(row) + ": " + e.properties[static_cast<size_t>(property)].name +
                     " is not finite");
    }
    const char* row(const PlyElement& e, size_t i) const { return file_.rows(e) + i * PlyFile::row_bytes(e); }

    Status check_layout() {
        std::vector<PlyElement> wanted = state_elements(version_);
        const std::vector<PlyElement>& found = file_.header().elements;
        for (const PlyElement& last : last_state_elements())
            if (wanted.size() < found.size() && found[wanted.size()].name == last.name) wanted.push_back(last);
        for (size_t e = 0; e < wanted.size(); ++e) {
            bool same = found.size() == wanted.size() && found[e].name == wanted[e].name &&
                        found[e].properties.size() == wanted[e].properties.size();
            for (size_t p = 0; same && p < wanted[e].properties.size(); ++p) {
                const PlyProperty &a = found[e].properties[p], &b = wanted[e].properties[p];
                same = a.name == b.name && a.type == b.type && !a.count_type;
            }
            if (!same)
                return fault("the elements are not those of a state frame: '" + wanted[e].name +
                             "' is missing or differs");
        }
        elements_ = &found;
        return {};
    }

    Status read_clock() {
        const PlyElement& e = (*elements_)[6];
        if (e.count != 1) return fault("has " + std::to_string(e.count) + " clocks instead of one");
        const char* at = row(e, 0);
        if (version_ != kSubFrameStateFileMagic)
            out_.frame = read_number<int32_t>(at), at += sizeof(int32_t);
        else if (load(at, &out_.frame, 1) >= 0)
            return not_finite(e, 0, 0);
        else
            at += sizeof(double);
        if (load(at, &out_.state.time, 1) >= 0) return not_finite(e, 0, 1);
        out_.at.frame = out_.frame;
        if (!knows_scale(version_)) return {};
        double v[2];
        if (const int bad = load(at + sizeof(double), v, 2); bad >= 0) return not_finite(e, 0, bad + 2);
        constexpr double kFarthest = 1e6;
        if (std::abs(v[0]) > kFarthest || v[1] < 0) return fault("lies at no simulated frame");
        out_.at = {v[0], v[1]};
        return {};
    }

    Status read_particles() {
        const PlyElement& e = (*elements_)[0];
        const size_t n = e.count;
        FrameState& s = out_.state;
        s.position.resize(n), s.orientation.resize(n), s.velocity.resize(n), s.angular_velocity.resize(n);
        s.plastic_deformation.resize(n), s.yield.resize(n), s.strain.resize(n);
        out_.body.resize(n), out_.fragment.resize(n);
        double v[kParticleDoubles];
        for (size_t i = 0; i < n; ++i) {
            if (const int bad = load(row(e, i), v, kParticleDoubles, 22); bad >= 0) return not_finite(e, i, bad);
            take_placement(v, s.position[i], s.orientation[i], s.velocity[i], s.angular_velocity[i]);
            for (int k = 0; k < 9; ++k) s.plastic_deformation[i](k / 3, k % 3) = v[13 + k];
            s.yield[i] = v[22], s.strain[i] = v[23];
            const char* p = row(e, i) + sizeof v;
            const int32_t body = read_number<int32_t>(p), fragment = read_number<int32_t>(p + 4);
            if (body < 0 || fragment < 0)
                return fault("particle " + std::to_string(i) + " has a negative body or fragment");
            out_.body[i] = static_cast<uint32_t>(body), out_.fragment[i] = static_cast<uint32_t>(fragment);
        }
        return {};
    }

    Status read_edges() {
        const PlyElement& e = (*elements_)[1];
        out_.edges.resize(e.count), out_.state.edge_intact.resize(e.count);
        for (size_t i = 0; i < e.count; ++i) {
            const char* p = row(e, i);
            const uint32_t a = read_number<uint32_t>(p), b = read_number<uint32_t>(p + 4);
            const uint8_t intact = read_number<uint8_t>(p + 8);
            if (a >= b || b >= out_.body.size())
                return fault("edge " + std::to_string(i) + " joins particles " + std::to_string(a) + " and " +
                             std::to_string(b) + " of " + std::to_string(out_.body.size()));
            if (intact > 1) return fault("edge " + std::to_string(i) + ": intact is neither 0 nor 1");
            out_.edges[i] = {a, b};
            out_.state.edge_intact[i] = intact;
        }
        return {};
    }

    Status read_groups() {
        const PlyElement& e = (*elements_)[2];
        if (e.count != out_.body.size())
            return fault("has " + std::to_string(e.count) + " groups for " + std::to_string(out_.body.size()) +
                         " particles");
        out_.state.group_rotation.resize(e.count);
        double q[4];
        for (size_t i = 0; i < e.count; ++i) {
            if (const int bad = load(row(e, i), q, 4); bad >= 0) return not_finite(e, i, bad);
            out_.state.group_rotation[i] = Quat(q[0], q[1], q[2], q[3]);
        }
        return {};
    }

    Status read_rigid_bodies() {
        const PlyElement& e = (*elements_)[3];
        out_.state.rigid_bodies.resize(e.count);
        double v[13];
        for (size_t i = 0; i < e.count; ++i) {
            if (const int bad = load(row(e, i), v, 13); bad >= 0) return not_finite(e, i, bad);
            RigidBodyState& r = out_.state.rigid_bodies[i];
            take_placement(v, r.position, r.orientation, r.velocity, r.angular_velocity);
        }
        return {};
    }

    Status read_broken() {
        const PlyElement& e = (*elements_)[4];
        out_.state.broken.resize(e.count);
        double v[2];
        for (size_t i = 0; i < e.count; ++i) {
            BrokenEdge& b = out_.state.broken[i];
            b.edge = EdgeId(read_number<uint32_t>(row(e, i)));
            if (b.edge >= out_.edges.size())
                return fault("broken_edge " + std::to_string(i) + " names edge " + std::to_string(b.edge) + " of " +
                             std::to_string(out_.edges.size()));
            if (const int bad = load(row(e, i) + 4, v, 2); bad >= 0) return not_finite(e, i, bad + 1);
            b.time = v[0], b.strain = v[1];
        }
        return {};
    }

    Status read_contacts() {
        const PlyElement& e = (*elements_)[5];
        out_.state.contacts.resize(e.count);
        const int n = knows_rest(version_) ? 10 : 7;
        double v[10] = {};
        for (size_t i = 0; i < e.count; ++i) {
            ContactMemory& c = out_.state.contacts[i];
            c.a = MovableId(read_number<uint32_t>(row(e, i)));
            c.b = MovableId(read_number<uint32_t>(row(e, i) + 4));
            if (const int bad = load(row(e, i) + 8, v, n); bad >= 0) return not_finite(e, i, bad + 2);
            c.point = Vec3(v[0], v[1], v[2]);
            c.normal_force = v[3];
            c.friction_force = Vec3(v[4], v[5], v[6]);
            c.rolling_torque = Vec3(v[7], v[8], v[9]);
        }
        return {};
    }

    Status read_rest() {
        if (!knows_rest(version_)) return {};  // all is awake
        const PlyElement &rest = (*elements_)[7], &condition = (*elements_)[8];
        FrameState& s = out_.state;
        if (rest.count != 0 && rest.count != s.n_particles() + s.rigid_bodies.size())
            return fault("says of " + std::to_string(rest.count) +
                         " particles and rigid bodies whether they sleep, of " +
                         std::to_string(s.n_particles() + s.rigid_bodies.size()));
        s.still_time.resize(rest.count), s.asleep.resize(rest.count), s.rest_load.resize(rest.count);
        s.rest_conditions.resize(condition.count);
        for (size_t i = 0; i < rest.count; ++i) {
            double v[2];
            if (const int bad = load(row(rest, i), v, 2); bad >= 0) return not_finite(rest, i, bad);
            s.still_time[i] = v[0], s.rest_load[i] = v[1];
            s.asleep[i] = read_number<uint8_t>(row(rest, i) + sizeof v);
            if (s.asleep[i] > 1) return fault("rest " + std::to_string(i) + ": asleep is neither 0 nor 1");
        }
        for (size_t i = 0; i < condition.count; ++i)
            s.rest_conditions[i] =
                read_number<uint32_t>(row(condition, i)) | uint64_t{read_number<uint32_t>(row(condition, i) + 4)} << 32;
        return {};
    }

    Status read_bending() {
        if (!knows_bending(version_)) return {};
        const PlyElement& e = (*elements_)[9];
        FrameState& s = out_.state;
        if (e.count != s.n_particles() && !(e.count == 0 && knows_damage(version_)))
            return fault("tells how " + std::to_string(e.count) + " particles are bent, of " +
                         std::to_string(s.n_particles()));
        s.plastic_curvature.resize(e.count), s.layer_strain.resize(e.count);
        double v[kBendingDoubles];
        for (size_t i = 0; i < e.count; ++i) {
            if (const int bad = load(row(e, i), v, kBendingDoubles); bad >= 0) return not_finite(e, i, bad);
            for (int k = 0; k < 9; ++k) s.plastic_curvature[i](k / 3, k % 3) = v[k];
            std::copy(v + 9, v + kBendingDoubles, s.layer_strain[i].begin());
        }
        return {};
    }

    Status read_damage() {
        if (!knows_damage(version_)) return {};
        const PlyElement &damage = (*elements_)[10], &stiffness = (*elements_)[11];
        FrameState& s = out_.state;
        const bool is_sound = knows_cause(version_) && damage.count == 0 && stiffness.count == 0;
        if (is_sound) return {};
        if (damage.count != out_.edges.size() || stiffness.count != s.n_particles())
            return fault("tells the damage of " + std::to_string(damage.count) + " edges and the stiffness of " +
                         std::to_string(stiffness.count) + " particles, of " + std::to_string(out_.edges.size()) +
                         " and " + std::to_string(s.n_particles()));
        s.edge_damage.resize(damage.count), s.edge_hold.resize(damage.count);
        s.stiffness_factor.resize(stiffness.count);
        double v[2];
        for (size_t i = 0; i < damage.count; ++i) {
            if (const int bad = load(row(damage, i), v, 2); bad >= 0) return not_finite(damage, i, bad);
            s.edge_damage[i] = v[0], s.edge_hold[i] = v[1];
        }
        for (size_t i = 0; i < stiffness.count; ++i)
            if (load(row(stiffness, i), &s.stiffness_factor[i], 1) >= 0) return not_finite(stiffness, i, 0);
        return {};
    }

    Status read_cause() {
        if (!knows_cause(version_)) return {};
        const PlyElement& e = (*elements_)[12];
        FrameState& s = out_.state;
        if (e.count != s.broken.size())
            return fault("tells why " + std::to_string(e.count) + " edges broke, of " +
                         std::to_string(s.broken.size()));
        for (size_t i = 0; i < e.count; ++i) {
            BrokenEdge& b = s.broken[i];
            if (load(row(e, i), &b.toughness, 1) >= 0) return not_finite(e, i, 0);
            const uint8_t kind = read_number<uint8_t>(row(e, i) + sizeof(double));
            const uint32_t number = read_number<uint32_t>(row(e, i) + sizeof(double) + 1);
            const size_t most = size_t{1} << 31;  // of what the file does not tell the number of
            const size_t counts[] = {0, s.n_particles(), s.rigid_bodies.size(), most, most};  // by kind
            if (kind >= std::size(counts) || (kind == 0 ? number != kNone : number >= counts[kind]))
                return fault("cause " + std::to_string(i) + ": there is no thing " + std::to_string(number) +
                             " of kind " + std::to_string(kind));
            b.by = {static_cast<Pusher::Kind>(kind), number};
        }
        return {};
    }

    const PlyElement* last_element(std::string_view name) const {
        const auto found = std::ranges::find(*elements_, name, &PlyElement::name);
        return found == elements_->end() ? nullptr : &*found;
    }

    Status read_offsets() {
        FrameState& s = out_.state;
        if (!s.plastic_curvature.empty()) s.edge_offset.assign(out_.edges.size(), EdgeOffsets());
        const PlyElement* const e = last_element("offset");
        if (!e) return {};
        if (e->count != s.edge_offset.size())
            return fault("tells the offsets of the ends of " + std::to_string(e->count) + " edges, of " +
                         std::to_string(s.edge_offset.size()));
        double v[kOffsetDoubles];
        for (size_t i = 0; i < e->count; ++i) {
            if (const int bad = load(row(*e, i), v, kOffsetDoubles); bad >= 0) return not_finite(*e, i, bad);
            for (size_t end = 0; end < 2; ++end)
                s.edge_offset[i][end] = {Eigen::Map<const Vec3>(v + 6 * end), Eigen::Map<const Vec3>(v + 6 * end + 3)};
        }
        return {};
    }

    Status read_strength_and_yielding() {
        std::vector<double>& rate = out_.state.yielding_rate;
        rate.assign(out_.state.plastic_curvature.size(), 0);
        if (Status s = read_numbers("strength", "the toughness", out_.body.size(), out_.toughness); !s) return s;
        return read_numbers("yielding", "the yielding", rate.size(), rate);
    }

    // Of `n` particles one number each, no less than 0, where the file tells them.
    Status read_numbers(std::string_view name, const std::string& what, size_t n, std::vector<double>& io_numbers) {
        const PlyElement* const e = last_element(name);
        if (!e) return {};
        if (e->count != n) return fault("tells " + what + " of another number of particles");
        io_numbers.resize(n);
        for (size_t i = 0; i < n; ++i) {
            if (load(row(*e, i), &io_numbers[i], 1, 0) >= 0) return not_finite(*e, i, 0);
            if (io_numbers[i] < 0) return fault(e->name + " " + std::to_string(i) + ": is less than 0");
        }
        return {};
    }

    Status read_inactive() {
        FrameState& s = out_.state;
        const PlyElement* const found = last_element("inactive");
        if (!found) return {};
        const PlyElement& e = *found;
        if (e.count != s.n_particles())
            return fault("tells what keeps " + std::to_string(e.count) + " particles, of " +
                         std::to_string(s.n_particles()));
        s.inactive.resize(e.count);
        for (size_t i = 0; i < e.count; ++i) {
            Inactivity& own = s.inactive[i];
            own.what = read_number<uint8_t>(row(e, i));
            constexpr int kAll = Inactivity::kHeld | Inactivity::kAsleep | Inactivity::kGlued | Inactivity::kTouched;
            if ((own.what & ~kAll) != 0)
                return fault("inactive " + std::to_string(i) + ": nothing keeps it as " + std::to_string(own.what));
            double v[4];
            for (int k = 0; k < 4; ++k)  // what is not due is so at infinity
                if (load(row(e, i) + 1 + 8 * k, v + k, 1, k < 2 ? 0 : -1) >= 0) return not_finite(e, i, 1 + k);
            own.due = {v[0], v[1]}, own.push = v[2], own.former_push = v[3];
        }
        std::vector<double> followed;
        if (Status ok = read_numbers("followed", "until when it follows", e.count, followed); !ok) return ok;
        for (size_t i = 0; i < followed.size(); ++i) s.inactive[i].followed = followed[i];
        return {};
    }

    const PlyFile& file_;
    const std::string_view version_;
    const std::string& where_;
    const std::vector<PlyElement>* elements_ = nullptr;
    StateFile out_;
};

bool was_let_go(const FrameState& s) {
    return std::ranges::any_of(s.inactive, [](const Inactivity& i) { return i.followed != HUGE_VAL; });
}

}  // namespace

ByteBuffer encode_state(double frame, const FrameState& s, const SimulationMesh& rest, const SceneTime& at,
                        std::span<const double> toughness) {
    const size_t n = s.n_particles();
    SUNDER_ASSERT(rest.n_particles() == n && rest.n_edges() == s.edge_intact.size());
    SUNDER_ASSERT(toughness.empty() || toughness.size() == n);
    const bool knows_why =
        std::ranges::any_of(s.broken, [](const BrokenEdge& b) { return b.toughness != 0 || b.by != Pusher(); });
    const bool is_between = frame != std::floor(frame);
    const std::string_view version = is_between                    ? kSubFrameStateFileMagic
                                     : at != SceneTime{frame}      ? kScaledStateFileMagic
                                     : knows_why                   ? kCauseStateFileMagic
                                     : !s.edge_damage.empty()      ? kDamageStateFileMagic
                                     : s.plastic_curvature.empty() ? kStateFileMagic
                                                                   : kBendingStateFileMagic;
    std::vector<PlyElement> elements = state_elements(version);
    const size_t last_counts[] = {s.inactive.size(), was_let_go(s) ? s.inactive.size() : 0,
                                  has_offsets(s) ? s.edge_offset.size() : 0, toughness.size(),
                                  is_yielding(s) ? s.yielding_rate.size() : 0};
    const size_t counts[] = {n,
                             s.edge_intact.size(),
                             s.group_rotation.size(),
                             s.rigid_bodies.size(),
                             s.broken.size(),
                             s.contacts.size(),
                             1,
                             s.asleep.size(),
                             s.rest_conditions.size(),
                             s.plastic_curvature.size(),
                             s.edge_damage.size(),
                             s.stiffness_factor.size(),
                             s.broken.size()};
    for (size_t e = 0; e < elements.size(); ++e) elements[e].count = counts[e];
    for (size_t e = 0; e < std::size(last_counts); ++e) {
        if (last_counts[e] == 0) continue;
        elements.push_back(last_state_elements()[e]);
        elements.back().count = last_counts[e];
    }
    size_t total = 4096;
    for (const PlyElement& e : elements) total += e.count * PlyFile::row_bytes(e);
    ByteBuffer bytes;
    bytes.reserve(total);
    write_ply_header(bytes, {{std::string(version), "written by sunder " SUNDER_VERSION}, elements});
    for (size_t i = 0; i < n; ++i) {
        double v[kParticleDoubles], *p = v;
        put_placement(p, s.position[i], s.orientation[i], s.velocity[i], s.angular_velocity[i]);
        for (int k = 0; k < 9; ++k) *p++ = s.plastic_deformation[i](k / 3, k % 3);
        *p++ = s.yield[i], *p++ = s.strain[i];
        bytes.append(v, sizeof v);
        bytes.number(rest.body[i]), bytes.number(rest.fragment[i]);
    }
    for (size_t e = 0; e < rest.n_edges(); ++e)
        bytes.number(rest.edges[e].a.value), bytes.number(rest.edges[e].b.value), bytes.number(s.edge_intact[e]);
    for (const Quat& q : s.group_rotation)
        bytes.number(q.w()), bytes.number(q.x()), bytes.number(q.y()), bytes.number(q.z());
    for (const RigidBodyState& r : s.rigid_bodies) {
        double v[13], *p = v;
        put_placement(p, r.position, r.orientation, r.velocity, r.angular_velocity);
        bytes.append(v, sizeof v);
    }
    for (const BrokenEdge& b : s.broken) bytes.number(b.edge.value), bytes.number(b.time), bytes.number(b.strain);
    for (const ContactMemory& c : s.contacts) {
        bytes.number(c.a.value), bytes.number(c.b.value);
        const Vec3 &x = c.point, &f = c.friction_force, &t = c.rolling_torque;
        const double v[10] = {x.x(), x.y(), x.z(), c.normal_force, f.x(), f.y(), f.z(), t.x(), t.y(), t.z()};
        bytes.append(v, sizeof v);
    }
    is_between ? bytes.number(frame) : bytes.number(static_cast<int32_t>(frame));
    bytes.number(s.time);
    if (knows_scale(version)) bytes.number(at.frame), bytes.number(at.scale);
    for (size_t i = 0; i < s.asleep.size(); ++i)
        bytes.number(s.still_time[i]), bytes.number(s.rest_load[i]), bytes.number(s.asleep[i]);
    for (const uint64_t c : s.rest_conditions)
        bytes.number(static_cast<uint32_t>(c)), bytes.number(static_cast<uint32_t>(c >> 32));
    for (size_t i = 0; i < s.plastic_curvature.size(); ++i) {
        double v[kBendingDoubles];
        for (int k = 0; k < 9; ++k) v[k] = s.plastic_curvature[i](k / 3, k % 3);
        std::ranges::copy(s.layer_strain[i], v + 9);
        bytes.append(v, sizeof v);
    }
    for (size_t e = 0; e < s.edge_damage.size(); ++e) bytes.number(s.edge_damage[e]), bytes.number(s.edge_hold[e]);
    for (const double factor : s.stiffness_factor) bytes.number(factor);
    if (knows_cause(version))
        for (const BrokenEdge& b : s.broken) {
            bytes.number(b.toughness), bytes.number(static_cast<uint8_t>(b.by.kind)), bytes.number(b.by.number);
        }
    for (const Inactivity& i : s.inactive) {
        bytes.number(i.what), bytes.number(i.due[0]), bytes.number(i.due[1]);
        bytes.number(i.push), bytes.number(i.former_push);
    }
    for (size_t i = 0; i < last_counts[1]; ++i) bytes.number(s.inactive[i].followed);
    for (size_t e = 0; e < last_counts[2]; ++e)
        for (const MemberOffset& end : s.edge_offset[e])
            bytes.append(end.shift.data(), 3 * sizeof(double)), bytes.append(end.turn.data(), 3 * sizeof(double));
    for (const double strain : toughness) bytes.number(strain);
    for (size_t i = 0; i < last_counts[4]; ++i) bytes.number(s.yielding_rate[i]);
    return bytes;
}

Result<StateFile> decode_state(std::string bytes, const std::string& where) {
    auto file = PlyFile::parse(std::move(bytes), where);
    if (!file) return file.error();
    for (const std::string_view version :
         {kStateFileMagic, kBendingStateFileMagic, kDamageStateFileMagic, kCauseStateFileMagic, kScaledStateFileMagic,
          kSubFrameStateFileMagic, kStateFileMagic2, kStateFileMagic1})
        if (file->has_comment(version)) return Decoder(*file, version, where).decode();
    for (const std::string& c : file->header().comments)
        if (c.starts_with(kStateFileMark))
            return bad_input(where, "is a " + c + ", which this version does not know", "use a newer Sunder");
    return bad_input(where, "is a PLY file but no state frame of Sunder", "give a file that a bake_state node wrote");
}

Result<StateFile> read_state_file(const std::string& path) {
    auto bytes = read_baked_file(path);
    if (!bytes) return bytes.error();
    return decode_state(bytes.take(), path);
}

Status require_same_scene(const StateFile& file, const SimulationMesh& rest, const std::string& where) {
    const auto differs = [&](const std::string& what) {
        return bad_input(where, "is of another scene: " + what, "bake again with --restart");
    };
    if (file.body.size() != rest.n_particles())
        return differs(std::to_string(file.body.size()) + " particles instead of " +
                       std::to_string(rest.n_particles()));
    if (file.edges.size() != rest.n_edges())
        return differs(std::to_string(file.edges.size()) + " edges instead of " + std::to_string(rest.n_edges()));
    for (size_t i = 0; i < file.body.size(); ++i)
        if (file.body[i] != rest.body[i] || file.fragment[i] != rest.fragment[i])
            return differs("particle " + std::to_string(i) + " is another fragment");
    for (size_t e = 0; e < file.edges.size(); ++e)
        if (file.edges[e][0] != rest.edges[e].a || file.edges[e][1] != rest.edges[e].b)
            return differs("edge " + std::to_string(e) + " joins other particles");
    return {};
}

}  // namespace sunder
