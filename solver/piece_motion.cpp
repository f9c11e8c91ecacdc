#include "solver/piece_motion.h"

#include <algorithm>

#include "solver/free_rotation.h"
#include "solver/motion.h"

namespace sunder {
namespace {

// What a particle gives, over what it would between neighbours that are held: 1.5 inside a lattice, about 3 at a face,
// more at edges and corners.
constexpr double kGive = 3;

Vec3 ellipsoid_inertia(const SimulationMesh& rest, uint32_t i) {
    const Vec3 squared = rest.radii[i].cwiseProduct(rest.radii[i]);
    return rest.mass[i] / 5 * (squared.sum() * Vec3::Ones() - squared);
}

// A movable that turns by itself; `rest_frame`: its principal axes where it is not turned.
void turn_alone(Workspace& w, uint32_t i, const Quat& rest_frame, const Vec3& moments, const Vec3& L, double h) {
    MovingParticle& p = w.moving[i];
    const Turning after = turn_freely(w.start_rotation[i] * rest_frame, moments, L, h);
    p.d = (after.frame * rest_frame.conjugate()).normalized();
    p.D = p.d.toRotationMatrix();
    w.angular_velocity[i] = after.angular_velocity;
}

// Centre of mass of the present or of the inertial positions, m.
Vec3 piece_center(const SimulationMesh& rest, std::span<const uint32_t> particles,
                  std::span<const MovingParticle> moving, Vec3 MovingParticle::*position) {
    const Vec3 origin = moving[particles.front()].*position;  // relative: exact far from the world's origin
    Vec3 center = Vec3::Zero();
    double mass = 0;
    for (uint32_t j : particles) mass += rest.mass[j], center += rest.mass[j] * (moving[j].*position - origin);
    return origin + center / mass;
}

void move_piece(const SimulationMesh& rest, std::span<const uint32_t> particles, const ContactPiece& piece,
                std::span<MovingParticle> io_moving) {
    const Vec3 center = piece_center(rest, particles, io_moving, &MovingParticle::x);
    const Vec3 inertial_center = piece_center(rest, particles, io_moving, &MovingParticle::x_inertial);
    const Quat turn = rotation_of(piece.turn), couple_turn = rotation_of(piece.couple_turn);
    for (uint32_t j : particles) {
        MovingParticle& p = io_moving[j];
        p.x = center + piece.shift + turn * (p.x - center);
        p.d = (turn * p.d).normalized();
        p.D = p.d.toRotationMatrix();
        // Pushes are in x_inertial already, particle by particle; couples turn the whole.
        p.x_inertial = inertial_center + couple_turn * (p.x_inertial - inertial_center);
        p.d_inertial = (couple_turn * p.d_inertial).normalized();
    }
}

}  // namespace

void remember_pieces(const StepContext& context, double h, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for (uint32_t piece = 0; piece < w.live.n_pieces(); ++piece) {
        w.pieces[piece] = ContactPiece();
        if (w.piece_held[piece]) continue;
        const auto particles = w.live.piece_particles(piece);
        const PieceMomentum p =
            piece_momentum(rest, w.inertia, particles, w.start_position, w.velocity, w.angular_velocity);
        w.piece_angular[piece] = p.angular;
        ContactPiece& c = w.pieces[piece];
        c.center = p.center;
        c.inverse_mass = 1 / p.mass;
        c.inverse_inertia = p.inertia.inverse();
        c.rigid = particles.size() == 1;
        c.unbroken = std::ranges::all_of(
            particles, [&](uint32_t j) { return w.live.count(j) == rest.group_offset[j + 1] - rest.group_offset[j]; });
        if (c.rigid)
            c.turn = h * w.angular_velocity[particles.front()] + c.inverse_inertia * w.push[particles.front()].torque;
    }
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const size_t i = rest.n_particles() + r;
        const Vec3 inverse = rigid_body_inertia(context.scene.rigid_bodies[r]).cwiseInverse();
        const Mat3 D = w.start_rotation[i].toRotationMatrix();
        ContactPiece& c = w.pieces[w.piece[i]];
        c = ContactPiece();
        c.center = w.start_position[i];
        c.inverse_mass = w.inverse_mass[i];
        c.inverse_inertia = D * inverse.asDiagonal() * D.transpose();
        c.rigid = true;
        c.turn = h * w.angular_velocity[i] + c.inverse_inertia * w.push[i].torque;
    }
}

void divide_pushes(const StepContext& context, double h, bool last, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    const auto divide = [&](uint32_t i) {
        w.own_share[i] = 1;
        if (i >= rest.n_particles() || w.live.count(i) == 1 || context.settings.method == Method::gauss_seidel) return;
        if (!last && !w.pieces[w.piece[i]].unbroken) return;
        double b = 0;
        for (uint32_t s = w.live.begin(i); s < w.live.end(i); ++s) {
            b += h * h * w.stiffness[w.live.member(s)].k;
        }
        w.own_share[i] = std::min(1.0, kGive / (1 + b));
    };
    for (const ActiveContact& c : w.contacts) {
        divide(c.contact.a);
        if (!(c.contact.b & Contact::kStatic)) divide(c.contact.b);
    }
    weigh_contacts(bodies_of(w), w.contacts);
    if (!last) return;
    for (ActiveContact& c : w.contacts)
        if (!c.separate_pieces) c.inverse_mass_normal = 0;
}

void move_pieces(const StepContext& context, Workspace& w) {
    for (uint32_t piece = 0; piece < w.live.n_pieces(); ++piece) {
        ContactPiece& p = w.pieces[piece];
        if (p.rigid || (p.shift.isZero(0) && p.turn.isZero(0))) continue;
        move_piece(context.scene.rest, w.live.piece_particles(piece), p, w.moving);
        p.shift = p.turn = p.couple_turn = Vec3::Zero();
    }
}

void turn_rigid_things(const StepContext& context, double h, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for (uint32_t piece = 0; piece < w.live.n_pieces(); ++piece) {
        if (!w.pieces[piece].rigid) continue;
        const uint32_t i = w.live.piece_particles(piece).front();
        turn_alone(w, i, rest.rest_orientation[i], ellipsoid_inertia(rest, i),
                   w.piece_angular[piece] + w.push[i].torque / h, h);
    }
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const auto i = static_cast<uint32_t>(rest.n_particles() + r);
        const Vec3 moments = rigid_body_inertia(context.scene.rigid_bodies[r]);
        const Quat& D = w.start_rotation[i];
        const Vec3 L = D * moments.cwiseProduct(D.conjugate() * w.angular_velocity[i]) + w.push[i].torque / h;
        turn_alone(w, i, Quat::Identity(), moments, L, h);
    }
}

void change_velocities(const StepContext& context, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for (uint32_t piece = 0; piece < w.live.n_pieces(); ++piece) {
        const PieceVelocity& change = w.piece_change[piece];
        if (change.velocity.isZero(0) && change.spin.isZero(0)) continue;
        const auto particles = w.live.piece_particles(piece);
        const Vec3 center = piece_center(rest, particles, w.moving, &MovingParticle::x);
        for (uint32_t j : particles) {
            w.velocity[j] += change.velocity + change.spin.cross(w.moving[j].x - center);
            w.angular_velocity[j] += change.spin;
        }
    }
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r)
        w.angular_velocity[rest.n_particles() + r] += w.piece_change[w.live.n_pieces() + r].spin;
}

}  // namespace sunder
