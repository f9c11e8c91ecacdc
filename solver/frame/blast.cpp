#include "solver/frame/blast.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "solver/frame/blast_shadow.h"
#include "solver/step/letting_go.h"
#include "solver/step/loops.h"

namespace sunder {
namespace {

constexpr double kFastest = 1e5;  // m/s; a step takes what is faster for numbers gone bad

// By active pins, whether they hold firmly or let go, and by activations.
std::vector<uint8_t> what_is_held(const StepContext& context, const FrameState& state) {
    std::vector<uint8_t> held(context.n_movables(), 0);
    for (size_t i = 0; i < state.inactive.size(); ++i) held[i] = is_kept(state, i);
    for (size_t k = 0; k < context.scene.pins.size(); ++k)
        if (context.input.pins[k].active)
            for (const ParticleId i : context.scene.pins[k].particles) held[i] = 1;
    return held;
}

const Vec3& place_of(const FrameState& s, size_t i) {
    return i < s.n_particles() ? s.position[i] : s.rigid_bodies[i - s.n_particles()].position;
}

Vec3 share_at(const Blast& blast, const Vec3& arm) {
    const double distance = arm.norm();
    if (!(distance > 0)) return Vec3::Zero();  // there is no way out of the very centre
    const Vec3 outwards = arm / distance;
    if (outwards.dot(blast.direction) < blast.least_cosine) return Vec3::Zero();
    return blast.falloff.at(distance) * outwards;
}

// The speed at the falloff's radius, m/s.
double speed_of(const Blast& blast, const Scene& scene, const std::vector<Vec3>& shares) {
    if (!(blast.energy > 0)) return blast.speed;
    const size_t n = scene.rest.n_particles();
    double sum = 0;  // kg
    for (size_t i = 0; i < shares.size(); ++i)
        sum += (i < n ? scene.rest.mass[i] : scene.rigid_bodies[i - n].mass) * shares[i].squaredNorm();
    return sum > 0 ? std::sqrt(2 * blast.energy / sum) : 0;
}

Status give(const StepContext& context, const LocalForce& force, const Blast& blast, FrameState& io_state) {
    const std::vector<Vec3> shares = shares_of(context, blast, io_state);
    const double speed = speed_of(blast, context.scene, shares);
    double largest = 0;
    for (const Vec3& share : shares) largest = std::max(largest, share.norm());
    if (!(speed * largest < kFastest))
        return Error{ErrorCode::numerical,
                     "would make something faster than 1e5 m/s",
                     "blast '" + force.name + "'",
                     "give it less energy, or let it reach more",
                     force.name,
                     "energy"};
    const size_t n = io_state.n_particles();
    for (size_t i = 0; i < shares.size(); ++i)
        (i < n ? io_state.velocity[i] : io_state.rigid_bodies[i - n].velocity) += speed * shares[i];
    return {};
}

}  // namespace

std::vector<Vec3> shares_of(const StepContext& context, const Blast& blast, const FrameState& state) {
    const std::vector<uint8_t> held = what_is_held(context, state);
    std::vector<Vec3> shares(context.n_movables(), Vec3::Zero());
    const BlastShadow shadow(context, blast, state);
    for_all(context, shares.size(), [&](size_t i) {
        const Vec3& there = place_of(state, i);
        if (held[i]) return;
        shares[i] = share_at(blast, there - blast.center);
        if (!shares[i].isZero(0) && shadow.hides(MovableId(i), there)) shares[i].setZero();
    });
    return shares;
}

Status give_blasts(const StepContext& context, FrameState& io_state) {
    for (const Force& force : context.input.forces) {
        const Blast* blast = force.local ? std::get_if<Blast>(&force.local->kind) : nullptr;
        if (!blast) continue;
        if (Status ok = give(context, *force.local, *blast, io_state); !ok) return ok;
    }
    return {};
}

}  // namespace sunder
