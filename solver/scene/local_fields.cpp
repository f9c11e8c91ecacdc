#include "solver/scene/local_fields.h"

#include <optional>

#include "solver/scene/curl_noise.h"

namespace sunder {
namespace {

// A field's value at a place, m/s2 or, of a wind, m/s; none beyond its reach.
using AtPlace = std::optional<Vec3>;

AtPlace value(const Nothing&, const Vec3&) { return {}; }
AtPlace value(const Blast&, const Vec3&) { return {}; }

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

}  // namespace

LocalFields::LocalFields(const FrameInput& input) {
    for (const Force& f : input.forces)
        if (acts(f) && f.local && !std::holds_alternative<Blast>(f.local->kind)) forces_.push_back(f.local.get());
}

Pull LocalFields::at(const Vec3& place) const {
    Pull pull;
    for (const LocalForce* force : forces_) {
        const AtPlace v = std::visit([&](const auto& kind) { return value(kind, place); }, force->kind);
        if (!v) continue;
        if (force->drag > 0)
            pull.acceleration += force->drag * *v, pull.drag += force->drag;
        else
            pull.acceleration += *v;
    }
    return pull;
}

}  // namespace sunder
