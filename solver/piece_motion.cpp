#include "solver/piece_motion.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/free_rotation.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// What a particle gives, over what it would between neighbours that are held: 1.5 inside a lattice, about 3 at a face,
// more at edges and corners.
constexpr double kGive = 3;
// What a load stands on gives way to the last round by so much more, where pins hold it: what is pushed together gives
// more than alone, and what does not give is the load, which stays lifted by it.
constexpr double kUnderLoads = 3;
// Contacts are solved along straight paths. What they would turn further than this in a substep is pinched and gets
// away before it does: it turns so far and no further, and the rest of the couple is lost, rad.
constexpr double kMostTurn = std::numbers::pi / 2;
constexpr double kTiny = 1e-300;
// A turn of a substep below which less than a hundredth of the energy is gained in 50 frames, and above which
// velocities, which are ways of a substep, point too far inwards, rad.
constexpr double kLeastTumble = 0.02, kMostTumble = 0.5;

Vec3 ellipsoid_inertia(const SimulationMesh& rest, ParticleId i) {
    const Vec3 squared = rest.radii[i].cwiseProduct(rest.radii[i]);
    return rest.mass[i] / 5 * (squared.sum() * Vec3::Ones() - squared);
}

// The angular impulse of contacts that turns by kMostTurn at most.
Vec3 bounded(const Vec3& torque, const Mat3& inverse_inertia) {
    return std::min(1.0, kMostTurn / std::max((inverse_inertia * torque).norm(), kTiny)) * torque;
}

// A movable that turns by itself; `rest_frame`: its principal axes where it is not turned.
void turn_alone(Workspace& w, MovableId i, const Quat& rest_frame, const Vec3& moments, const Vec3& L, double h) {
    MovingParticle& p = w.moving[i];
    const Turning after = turn_freely(w.start_rotation[i] * rest_frame, moments, L, h);
    p.d = (after.frame * rest_frame.conjugate()).normalized();
    w.angular_velocity[i] = after.angular_velocity;
}

// Centre of mass of the present or of the inertial positions, m.
Vec3 piece_center(const SimulationMesh& rest, std::span<const ParticleId> particles,
                  std::span<const MovingParticle> moving, Vec3 MovingParticle::*position) {
    const Vec3 origin = moving[particles.front()].*position;  // relative: exact far from the world's origin
    Vec3 center = Vec3::Zero();
    double mass = 0;
    for (const ParticleId j : particles) mass += rest.mass[j], center += rest.mass[j] * (moving[j].*position - origin);
    return origin + center / mass;
}

bool moves_alone(const ContactPiece& p) { return p.rigid || p.inverse_mass == 0; }

// Zero where nothing touches it.
const RoundPush& round_push(const Workspace& w, MovableIndex i) {
    static const RoundPush none;
    const uint32_t slot = w.islands.movable_slot[i];
    return slot == kNone ? none : w.round_push[slot];
}

void move_alone(MovableId i, Workspace& w) {
    const RoundPush& push = round_push(w, i);
    w.moving[i].x += push.own;
    w.moving[i].x_inertial += push.shift;
    w.push[i].shift += push.shift;
    w.push[i].torque += push.torque;
}

// What a round pushed particles of a piece by, besides their mean.
struct PushesInPiece {
    Vec3 own = Vec3::Zero(), shift = Vec3::Zero();  // means, m
    Vec3 orbit = Vec3::Zero();                      // of the piece, by forces at the particles' centres, rad
    bool any = false;
};

PushesInPiece pushes_in(const SimulationMesh& rest, std::span<const ParticleId> particles, const ContactPiece& piece,
                        const Workspace& w) {
    PushesInPiece in;
    Vec3 angular = Vec3::Zero();
    for (const ParticleId j : particles) {
        const RoundPush& push = round_push(w, j);
        if (push.own.isZero(0) && push.shift.isZero(0) && push.torque.isZero(0)) continue;
        in.any = true;
        angular += rest.mass[j] * (w.start_position[j] - piece.center).cross(push.shift);
        in.own += piece.inverse_mass * rest.mass[j] * push.own;
        in.shift += piece.inverse_mass * rest.mass[j] * push.shift;
    }
    in.orbit = piece.inverse_inertia * angular;
    return in;
}

// A piece turns by its net spin without being stretched. What remains is linear, and small even where large pushes and
// their couples all but cancel, as on a piece that is pinched.
void move_piece(const SimulationMesh& rest, std::span<const ParticleId> particles, const ContactPiece& piece,
                const PieceMotion& motion, bool as_whole, Workspace& w) {
    const PushesInPiece in = pushes_in(rest, particles, piece, w);
    if (!in.any) return;
    const double part = std::min(1.0, kMostTurn / std::max(motion.spin.norm(), kTiny));
    const Quat spin = rotation_of(part * motion.spin);
    const Mat3 turn = spin.toRotationMatrix();
    const Vec3 center = piece_center(rest, particles, w.moving, &MovingParticle::x);
    const Vec3 shift = as_whole ? in.shift : Vec3(motion.shift + in.own);
    const Vec3 inertial_center = piece_center(rest, particles, w.moving, &MovingParticle::x_inertial);
    for (const ParticleId j : particles) {
        MovingParticle& p = w.moving[j];
        const RoundPush& push = round_push(w, j);
        const Vec3 lever = w.start_position[j] - piece.center;
        const Vec3 strain =
            as_whole ? Vec3(Vec3::Zero()) : Vec3(push.own - in.own + (motion.turn - motion.spin).cross(lever));
        p.x = center + shift + turn * (p.x - center) + part * strain;
        p.d = spin * p.d;  // of unit length but for a rounding a round, of which a substep has few
        p.x_inertial = inertial_center + in.shift + turn * (p.x_inertial - inertial_center) +
                       part * (push.shift - in.shift - in.orbit.cross(lever));
        p.d_inertial = spin * p.d_inertial;
        w.push[j].shift += in.shift + part * (push.shift - in.shift);
        w.push[j].torque += part * push.torque;
    }
}

// How far a piece turned since the start of the substep, in the mean.
Quat mean_turn(const SimulationMesh& rest, std::span<const ParticleId> particles, const Vec3& start_center,
               const Vec3& center, const Workspace& w) {
    Mat3 A = Mat3::Zero();
    for (const ParticleId j : particles) {
        const MovingParticle& p = w.moving[j];
        const Mat3 H = to_matrix(w.inertia[j]), moment = 0.5 * H.trace() * Mat3::Identity() - H;
        A += rest.mass[j] * (p.x - center) * (w.start_position[j] - start_center).transpose() +
             (p.d * w.start_rotation[j].conjugate()).toRotationMatrix() * moment;
    }
    return optimal_rotation(A, Quat::Identity());
}

}  // namespace

void remember_pieces(const StepContext& context, double h, Workspace& w) {
    SUNDER_ASSERT(h > 0 && w.pieces.size() == w.live.n_pieces() + context.scene.rigid_bodies.size());
    SUNDER_ASSERT(w.piece_held.size() == w.live.n_pieces() && w.piece_angular.size() == w.live.n_pieces());
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(w.live, kParticleGrain, context.workers, [&](size_t piece) {
        w.pieces[piece] = ContactPiece();
        const auto particles = w.live.piece_particles(piece);
        const auto holds = [&](ParticleId j) {
            return w.live.count(j) == rest.group_offset[j + 1] - rest.group_offset[j];
        };
        w.pieces[piece].unbroken = std::ranges::all_of(particles, holds);
        w.pieces[piece].lone = particles.size() == 1;
        const bool is_smooth = w.pair.smooth[particles.front()] != 0 && particles.size() > 1;
        if (w.piece_held[piece] || is_smooth) return;
        const PieceMomentum p =
            piece_momentum(rest, w.inertia, particles, w.start_position, w.velocity, w.angular_velocity);
        w.piece_angular[piece] = p.angular;
        ContactPiece& c = w.pieces[piece];
        c.center = p.center;
        c.inverse_mass = 1 / p.mass;
        c.inverse_inertia = p.inertia.inverse();
        c.spin = c.inverse_inertia * p.angular;
        c.rigid = particles.size() == 1;
        if (c.rigid)
            c.turned = h * w.angular_velocity[particles.front()] + c.inverse_inertia * w.push[particles.front()].torque;
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const size_t i = rest.n_particles() + r;
        const Vec3 inverse = rigid_body_inertia(context.scene.rigid_bodies[r]).cwiseInverse();
        const Mat3 D = w.start_rotation[i].toRotationMatrix();
        ContactPiece& c = w.pieces[w.piece[i]];
        c = ContactPiece();
        c.rigid = c.unbroken = true;
        c.center = w.start_position[i];
        if (!(w.inverse_mass[i] > 0)) continue;  // nothing turns a sleeper either
        c.inverse_mass = w.inverse_mass[i];
        c.inverse_inertia = D * inverse.asDiagonal() * D.transpose();
        c.turned = h * w.angular_velocity[i] + c.inverse_inertia * w.push[i].torque;
    }
}

void tumble_pieces(const StepContext& context, double h, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(w.live, kParticleGrain, context.workers, [&](size_t piece) {
        const ContactPiece& c = w.pieces[piece];
        const auto particles = w.live.piece_particles(piece);
        if (moves_alone(c) || w.is_touched[piece] || w.kept[particles.front()]) return;
        const Vec3& L = w.piece_angular[piece];
        const double turn = h * (c.inverse_inertia * L).norm();
        if (turn < kLeastTumble || turn > kMostTumble || resolves_waves(w, particles, h)) return;
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(c.inverse_inertia);
        Mat3 axes = eigen.eigenvectors();
        axes.col(2) *= axes.determinant();
        const Quat start(axes);
        const Quat wanted = turn_freely(start, eigen.eigenvalues().cwiseInverse(), L, h).frame * start.conjugate();
        const Vec3 center = piece_center(rest, particles, w.moving, &MovingParticle::x);
        const Quat more = wanted * mean_turn(rest, particles, c.center, center, w).conjugate();
        for (const ParticleId j : particles) {
            MovingParticle& p = w.moving[j];
            p.x = center + more * (p.x - center);
            p.d = (more * p.d).normalized();
            w.goals[j].rotation = (more * w.goals[j].rotation).normalized();
        }
    });
}

void note_what_pins_take(const StepContext& context, double h, IslandId island, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    std::vector<ParticleId> free;
    for (const PieceId piece : w.islands.pieces_of(island)) {
        if (piece >= w.live.n_pieces() || !w.piece_held[piece]) continue;
        const auto taken = [&](ParticleId j) -> Vec3 {
            const RoundPush& push = round_push(w, j);
            return rest.mass[j] * (push.shift - push.own);
        };
        free.clear();
        bool any = false;
        for (const ParticleId j : w.live.piece_particles(piece)) {
            if (w.held[j]) continue;
            free.push_back(j);
            any |= !taken(j).isZero(0);
        }
        if (!any) continue;
        const PieceMomentum p = piece_momentum(rest, w.inertia, free, w.start_position, w.velocity, w.angular_velocity);
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
        for (const ParticleId j : free) {
            linear += taken(j);
            angular += (w.start_position[j] - p.center).cross(taken(j));
        }
        w.pieces[piece].center = p.center;
        const Vec3 turn = p.inertia.inverse() * angular / h;
        w.piece_change[piece] = {linear / (p.mass * h), turn, turn};
    }
}

void slow_held_pieces(const StepContext& context, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(w.live, kParticleGrain, context.workers, [&](size_t piece) {
        PieceVelocity& change = w.piece_change[piece];
        if (!w.piece_held[piece] || (change.velocity.isZero(0) && change.turn.isZero(0))) return;
        double slope = 0, curvature = 0;  // of the energy along the change, J
        for (const ParticleId j : w.live.piece_particles(piece)) {
            if (w.held[j]) continue;
            const Vec3 by = change.velocity + change.turn.cross(w.start_position[j] - w.pieces[piece].center);
            const Vec3 spun = product(w.inertia[j], change.spin);
            slope += rest.mass[j] * by.dot(w.velocity[j]) + spun.dot(w.angular_velocity[j]);
            curvature += rest.mass[j] * by.squaredNorm() + spun.dot(change.spin);
        }
        const double share = slope < 0 ? std::min(1.0, -slope / curvature) : 0.0;
        change = {share * change.velocity, share * change.turn, share * change.spin};
    });
}

void turn_pieces(const StepContext& context, IslandId island, Workspace& w) {
    for (const PieceId piece : w.islands.pieces_of(island)) {
        ContactPiece& p = w.pieces[piece];
        if (moves_alone(p)) continue;
        Vec3 angular = Vec3::Zero();  // L of the displacements, kg m2
        for (const ParticleId j : w.live.piece_particles(piece)) {
            const Vec3 lever = w.start_position[j] - p.center, shift = w.moving[j].x - w.start_position[j];
            const Vec3 own = turned_by(w.moving[j].d * w.start_rotation[j].conjugate());
            angular += context.scene.rest.mass[j] * lever.cross(shift) + product(w.inertia[j], own);
        }
        p.turned = p.inverse_inertia * angular;
    }
}

double sum_of_pulls(const Workspace& w, double h, ParticleIndex i) {
    double b = 0;
    for (uint32_t s = w.live.begin(i); s < w.live.end(i); ++s) {
        const ParticleId g = w.live.member(s);
        b += h * h * w.stiffness[g].k * (w.thin.empty() ? 1 : w.bending.softness(g));
    }
    return b;
}

namespace {

// The share of a push across a sheet, which is held chi times softer than along it: what bends gives way as far as
// bending waves run, b^(-1/2); a push deeper than the sheet is thick meets it as a membrane, and takes the share of a
// block. By the first alone hits create energy (a sheet flew apart at 60 m/s), by the second sheets tremble at rest.
double share_across(const BendingShape& sheet, double pulls, double give, double membrane, double way) {
    const double chi = sheet.softness.minCoeff(), deep = way * way / sheet.reach2;
    return (chi * std::min(1.0, give / std::sqrt(1 + pulls)) + deep * membrane) / (chi + deep);
}

}  // namespace

void divide_pushes(const StepContext& context, double h, bool last, IslandId island, Workspace& w) {
    SUNDER_ASSERT(h > 0 && island < w.islands.size());
    for (const PieceId piece : w.islands.pieces_of(island)) w.pieces[piece].own_share = last ? 1 : 0;
    double approach = 0;  // of the fastest that meets a sheet, m/s
    for (size_t k = 0; !w.thin.empty() && k < w.islands.contacts_of(island).size(); ++k)
        approach = std::max(approach, w.contacts[w.islands.contacts_of(island)[k]].approach_speed);
    for (const MovableId i : w.islands.movables_of(island)) {
        double share = 1;
        ContactPiece& p = w.pieces[w.piece[i]];
        if (!p.rigid && context.settings.method != Method::gauss_seidel && (last || p.unbroken)) {
            const bool bends = !w.thin.empty() && w.bending.pulls(i.value);
            const double pulls = sum_of_pulls(w, h, i.value), b = bends ? pulls / w.bending.softness(i.value) : pulls;
            const double n = last ? 1 : static_cast<double>(w.live.piece_particles(w.piece[i]).size());
            const double reach = std::max(1.0, std::min(waves_in_step(1 + b), math::cbrt(n)));
            const double give = last && p.is_held() && w.loads.how[island] == StandingLoads::How::together
                                    ? kUnderLoads * kGive
                                    : kGive;
            share = std::min(1.0, give * reach / (1 + b));
            if (bends) share = share_across(w.bending.shape(i.value), pulls, give, share, approach * h);
        }
        p.own_share = last ? std::min(p.own_share, share) : std::max(p.own_share, share);
    }
}

void move_pieces(const StepContext& context, bool as_wholes, IslandId island, Workspace& w) {
    for (const MovableId i : w.islands.movables_of(island))
        if (moves_alone(w.pieces[w.piece[i]])) move_alone(i, w);
    for (const PieceId piece : w.islands.pieces_of(island)) {
        ContactPiece& p = w.pieces[piece];
        if (moves_alone(p))
            p.turned += w.piece_motion[piece].spin;
        else
            move_piece(context.scene.rest, w.live.piece_particles(piece), p, w.piece_motion[piece], as_wholes, w);
        w.piece_motion[piece] = PieceMotion();
    }
}

void turn_rigid_things(const StepContext& context, double h, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(w.live, kParticleGrain, context.workers, [&](size_t piece) {
        if (!w.pieces[piece].rigid) return;
        const ParticleId i = w.live.piece_particles(piece).front();
        turn_alone(w, i, rest.rest_orientation[i], ellipsoid_inertia(rest, i),
                   w.piece_angular[piece] + bounded(w.push[i].torque, w.pieces[piece].inverse_inertia) / h, h);
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const MovableId i(rest.n_particles() + r);
        const Vec3 moments = rigid_body_inertia(context.scene.rigid_bodies[r]);
        const Quat& D = w.start_rotation[i];
        const Vec3 L = D * moments.cwiseProduct(D.conjugate() * w.angular_velocity[i]) +
                       bounded(w.push[i].torque, w.pieces[w.piece[i]].inverse_inertia) / h;
        turn_alone(w, i, Quat::Identity(), moments, L, h);
    }
}

void change_velocities(const StepContext& context, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(w.live, kParticleGrain, context.workers, [&](size_t piece) {
        const PieceVelocity& change = w.piece_change[piece];
        if (change.velocity.isZero(0) && change.turn.isZero(0) && change.spin.isZero(0)) return;
        // From where the contacts were solved: a spin about what was the thin axis of a piece that has turned since
        // would swing its ends.
        for (const ParticleId j : w.live.piece_particles(piece)) {
            if (w.held[j]) continue;
            w.velocity[j] += change.velocity + change.turn.cross(w.start_position[j] - w.pieces[piece].center);
            w.angular_velocity[j] += change.spin;
        }
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r)
        w.angular_velocity[rest.n_particles() + r] += w.piece_change[w.live.n_pieces() + r].spin;
}

}  // namespace sunder
