// What moves in a step, one by one: particles, then rigid bodies.
#pragma once

#include <vector>

#include "solver/contacts/solve/contact_response.h"
#include "solver/data/role.h"
#include "solver/matching/shape_matching.h"
#include "solver/scene/local_fields.h"

namespace sunder {

/// Pins that are letting go.
struct Tethers {
    // The stiffness that draws a particle to its pin, beside its inertia's, and where that is at the end of the step
    // (n_particles), or empty: there are none.
    std::vector<double> stiffness;
    std::vector<Pose> pose;

    bool hold(size_t particle) const { return !stiffness.empty() && stiffness[particle] > 0; }
    void clear() { stiffness.clear(), pose.clear(); }
};

/// What a contact or a stage of the step does to these it does for all of them, (n_movables) but where something else
/// is said.
struct Movables {
    std::vector<MovingParticle> moving;
    std::vector<Vec3> start_position;              // m
    std::vector<Quat> start_rotation;              // since rest
    std::vector<Vec3> velocity, angular_velocity;  // as forces take them; at the end as they came out
    std::vector<double> inverse_mass;              // 1/kg; held: 0
    std::vector<Sym3> inertia;                     // of particles, world (n_particles)
    std::vector<Role> role;
    std::vector<uint8_t> follows;  // 1: held where its source has it, or empty: nothing is
    Tethers tethers;
    // The implicit step: how long it takes, and where it starts from (second_order.h).
    std::vector<double> span;         // s
    std::vector<Vec3> base;           // m
    std::vector<Quat> base_rotation;  // since rest
    std::vector<ContactPush> push;    // what contacts did, for the momentum books
    std::vector<Pull> pull;           // of forces that differ from place to place, or empty: there are none

    size_t size() const { return moving.size(); }
    size_t n_particles() const { return inertia.size(); }
    bool is_held_or_tied(size_t i) const { return role[i] != Role::free || (i < n_particles() && tethers.hold(i)); }
    void resize(size_t n_particles, size_t n_movables);
};

inline void Movables::resize(size_t n_particles, size_t n_movables) {
    moving.resize(n_movables), start_position.resize(n_movables), start_rotation.resize(n_movables);
    velocity.resize(n_movables), angular_velocity.resize(n_movables), inverse_mass.resize(n_movables);
    inertia.resize(n_particles), role.assign(n_movables, Role::free), push.resize(n_movables);
}

}  // namespace sunder
