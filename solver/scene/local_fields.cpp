#include "solver/scene/local_fields.h"

#include <algorithm>
#include <optional>

#include "solver/scene/curl_noise.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

// A field's value at a place, m/s2 or, of a wind, m/s; none beyond its reach.
using AtPlace = std::optional<Vec3>;

AtPlace value(const Nothing&, const Vec3&) { return {}; }
AtPlace value(const Blast&, const Vec3&) { return {}; }
AtPlace value(const Guide&, const Vec3&) { return {}; }
AtPlace value(const Pressure&, const Vec3&) { return {}; }

AtPlace value(const PointField& f, const Vec3& x) {
    const Vec3 arm = x - f.center;
    const double distance = arm.norm();
    if (!(distance <= f.falloff.reach)) return {};
    return distance > 0 ? Vec3(f.strength * f.falloff.at(distance) / distance * arm) : Vec3(Vec3::Zero());
}

AtPlace value(const VortexField& f, const Vec3& x) {
    const Vec3 arm = x - f.center, across = arm - f.axis.dot(arm) * f.axis;
    const double distance = across.norm();
    if (!(distance <= f.falloff.reach)) return {};
    const double share = f.falloff.at(distance);
    Vec3 v = f.lift * (distance < f.falloff.radius ? 1 : share) * f.axis;
    if (distance > 0) v += share / distance * (f.swirl * f.axis.cross(across) - f.inflow * across);
    return v;
}

AtPlace value(const TurbulenceField& f, const Vec3& x) {
    if (!((x - f.center).norm() <= f.reach)) return {};
    return f.strength * curl_noise(x / f.size, f.time, f.octaves, f.seed);
}

AtPlace value(const GridField& f, const Vec3& x) {
    const VectorGrid& g = *f.grid;
    const Vec3 share = (x - g.low).cwiseQuotient(g.high - g.low);
    if (!(share.minCoeff() >= 0 && share.maxCoeff() <= 1)) return {};
    std::array<size_t, 3> first;
    Vec3 beyond;  // the first node, in spacings
    for (int i = 0; i < 3; ++i) {
        const double at = share[i] * (g.nodes[i] - 1);
        first[i] = std::min(static_cast<size_t>(at), size_t{g.nodes[i]} - 2);
        beyond[i] = at - static_cast<double>(first[i]);
    }
    Vec3 sum = Vec3::Zero();
    for (size_t corner = 0; corner < 8; ++corner) {
        const std::array<size_t, 3> step = {corner >> 2, corner >> 1 & 1, corner & 1};
        double weight = 1;
        for (int i = 0; i < 3; ++i) weight *= step[i] == 1 ? beyond[i] : 1 - beyond[i];
        const size_t row = (first[0] + step[0]) * g.nodes[1] + first[1] + step[1];
        sum += weight * g.values[row * g.nodes[2] + first[2] + step[2]];
    }
    return sum;
}

// Of a spring to what moves steadily from one place to another in a step, the implicit step of which is
//   v' = (v + h (w^2 (x_end - x) + 2 w v_target)) / (1 + h (2 w + h w^2)).
Pull pull_of(const Guide& guide, const SimulationMesh& rest, const Pulled& thing) {
    const size_t i = thing.movable;
    const double w = guide.rate, h = thing.h;
    const Pose own = guide.targets ? (*guide.targets)[rest.fragment[i]] : Pose{rest.rest_position[i], Quat::Identity()};
    const Pose from = interpolate(guide.pose, thing.begin), to = interpolate(guide.pose, thing.end);
    const Vec3 end = to.apply(own.position), velocity = (end - from.apply(own.position)) / h;
    const Vec3 spin = rotation_vector(to.orientation * from.orientation.conjugate()) / h;
    const Vec3 missing = rotation_vector(to.orientation * own.orientation * thing.turn.conjugate());
    const double drag = w * (2 + h * w);
    return {w * (w * (end - thing.place) + 2 * velocity), drag, w * (w * missing + 2 * spin), drag};
}

}  // namespace

LocalFields::LocalFields(const Scene& scene, const FrameInput& input, const FrameState& state,
                         std::span<const uint8_t> asleep)
    : rest_(scene.rest) {
    for (const Force& f : input.forces) {
        if (!f.local || !acts(f) || std::holds_alternative<Blast>(f.local->kind)) continue;
        const auto body = std::ranges::find(scene.bodies, f.local->body, &Body::name);
        const bool is_known = body != scene.bodies.end();
        const Pressure* gas = std::get_if<Pressure>(&f.local->kind);
        if (!is_known && (gas || !f.local->body.empty())) continue;
        const auto index = is_known ? static_cast<uint32_t>(std::distance(scene.bodies.begin(), body)) : kNone;
        forces_.push_back({f.local.get(), index, gas ? gas_in(*gas, rest_, state, asleep, index) : Gas()});
    }
}

Pull LocalFields::on(const Pulled& thing) const {
    Pull pull;
    const size_t i = thing.movable;
    for (const auto& [force, body, inside] : forces_) {
        const bool is_fragment = i < rest_.n_particles();
        if (body != kNone && !(is_fragment && rest_.body[i] == body)) continue;
        if (const Guide* guide = std::get_if<Guide>(&force->kind)) {
            if (!is_fragment) continue;
            const Pull own = pull_of(*guide, rest_, thing);
            pull.acceleration += own.acceleration, pull.drag += own.drag;
            pull.turn += own.turn, pull.turn_drag += own.turn_drag;
            continue;
        }
        if (const Pressure* gas = std::get_if<Pressure>(&force->kind)) {
            if (!is_fragment) continue;
            Vec3 lining = thing.turn * (*gas->lining)[rest_.fragment[i]];
            if (!inside.beyond.empty()) lining -= inside.beyond[rest_.fragment[i]];
            pull.acceleration -= inside.left * gas->pressure / rest_.mass[i] * lining;
            continue;
        }
        const AtPlace v = std::visit([&](const auto& kind) { return value(kind, thing.place); }, force->kind);
        if (!v) continue;
        if (force->drag > 0)
            pull.acceleration += force->drag * *v, pull.drag += force->drag;
        else
            pull.acceleration += *v;
    }
    return pull;
}

}  // namespace sunder
