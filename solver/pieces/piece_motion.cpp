#include "solver/pieces/piece_motion.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/matching/unit_schedule.h"
#include "solver/pieces/free_rotation.h"
#include "solver/pieces/momentum.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// Contacts are solved along straight paths. What they would turn further than this in a substep is pinched and gets
// away before it does: it turns so far and no further, and the rest of the couple is lost, rad.
constexpr double kMostTurn = std::numbers::pi / 2;
constexpr double kTiny = 1e-300;
// A turn of a substep below which less than a hundredth of the energy is gained in 50 frames, rad.
constexpr double kLeastTumble = 0.02;

Vec3 ellipsoid_inertia(const SimulationMesh& rest, ParticleId i) {
    const Vec3 squared = rest.radii[i].cwiseProduct(rest.radii[i]);
    return rest.mass[i] / 5 * (squared.sum() * Vec3::Ones() - squared);
}

// The angular impulse of contacts that turns by kMostTurn at most.
Vec3 bounded(const Vec3& torque, const Mat3& inverse_inertia) {
    return std::min(1.0, kMostTurn / std::max((inverse_inertia * torque).norm(), kTiny)) * torque;
}

// A movable that turns by itself; `rest_frame`: its principal axes where it is not turned.
void turn_alone(Movables& movables, MovableId i, const Quat& rest_frame, const Vec3& moments, const Vec3& L, double h) {
    MovingParticle& p = movables.moving[i];
    const Turning after = turn_freely(movables.start_rotation[i] * rest_frame, moments, L, h);
    p.d = (after.frame * rest_frame.conjugate()).normalized();
    movables.angular_velocity[i] = after.angular_velocity;
}

// Centre of mass, m; `position`: of a particle.
template <class Position>
Vec3 center_of_mass(const SimulationMesh& rest, std::span<const ParticleId> particles, const Position& position) {
    const Vec3 origin = position(particles.front());  // relative: exact far from the world's origin
    Vec3 center = Vec3::Zero();
    double mass = 0;
    for (const ParticleId j : particles) mass += rest.mass[j], center += rest.mass[j] * (position(j) - origin);
    return origin + center / mass;
}

// Of the present or of the inertial positions.
Vec3 piece_center(const SimulationMesh& rest, std::span<const ParticleId> particles,
                  std::span<const MovingParticle> moving, Vec3 MovingParticle::*position) {
    return center_of_mass(rest, particles, [&](ParticleId j) -> const Vec3& { return moving[j].*position; });
}

bool moves_alone(const ContactPiece& p) { return p.rigid || p.inverse_mass == 0; }

void move_alone(const RoundPush& push, MovableId i, Movables& movables) {
    movables.moving[i].x += push.own;
    movables.moving[i].x_inertial += push.shift;
    movables.push[i].shift += push.shift;
    movables.push[i].torque += push.torque;
}

// What a round pushed particles of a piece by, besides their mean.
struct PushesInPiece {
    Vec3 own = Vec3::Zero(), shift = Vec3::Zero();  // means, m
    Vec3 orbit = Vec3::Zero();                      // of the piece, by forces at the particles' centres, rad
    bool any = false;
};

PushesInPiece pushes_in(const SimulationMesh& rest, std::span<const ParticleId> particles, const ContactPiece& piece,
                        const ContactProblem& problem, std::span<const Vec3> start_position) {
    PushesInPiece in;
    Vec3 angular = Vec3::Zero();
    for (const ParticleId j : particles) {
        const RoundPush& push = problem.push_on(j);
        if (push.own.isZero(0) && push.shift.isZero(0) && push.torque.isZero(0)) continue;
        in.any = true;
        angular += rest.mass[j] * (start_position[j] - piece.center).cross(push.shift);
        in.own += piece.inverse_mass * rest.mass[j] * push.own;
        in.shift += piece.inverse_mass * rest.mass[j] * push.shift;
    }
    in.orbit = piece.inverse_inertia * angular;
    return in;
}

// A piece turns by its net spin without being stretched. What remains is linear, and small even where large pushes and
// their couples all but cancel, as on a piece that is pinched.
void move_piece(const SimulationMesh& rest, std::span<const ParticleId> particles, const ContactPiece& piece,
                const PieceMotion& motion, bool as_whole, const ContactProblem& problem, Movables& movables) {
    const PushesInPiece in = pushes_in(rest, particles, piece, problem, movables.start_position);
    if (!in.any) return;
    const double part = std::min(1.0, kMostTurn / std::max(motion.spin.norm(), kTiny));
    const Quat spin = rotation_of(part * motion.spin);
    const Mat3 turn = spin.toRotationMatrix();
    const Vec3 center = piece_center(rest, particles, movables.moving, &MovingParticle::x);
    const Vec3 shift = as_whole ? in.shift : Vec3(motion.shift + in.own);
    const Vec3 inertial_center = piece_center(rest, particles, movables.moving, &MovingParticle::x_inertial);
    for (const ParticleId j : particles) {
        MovingParticle& p = movables.moving[j];
        const RoundPush& push = problem.push_on(j);
        const Vec3 lever = movables.start_position[j] - piece.center;
        const Vec3 strain =
            as_whole ? Vec3(Vec3::Zero()) : Vec3(push.own - in.own + (motion.turn - motion.spin).cross(lever));
        p.x = center + shift + turn * (p.x - center) + part * strain;
        p.d = spin * p.d;  // of unit length but for a rounding a round, of which a substep has few
        p.x_inertial = inertial_center + in.shift + turn * (p.x_inertial - inertial_center) +
                       part * (push.shift - in.shift - in.orbit.cross(lever));
        p.d_inertial = spin * p.d_inertial;
        movables.push[j].shift += in.shift + part * (push.shift - in.shift);
        movables.push[j].torque += part * push.torque;
    }
}

// Where a free body comes to in h seconds, from where it is.
Quat free_turn(const Mat3& inverse_inertia, const Vec3& L, double h) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(inverse_inertia);
    Mat3 axes = eigen.eigenvectors();
    axes.col(2) *= axes.determinant();
    const Quat start(axes);
    return turn_freely(start, eigen.eigenvalues().cwiseInverse(), L, h).frame * start.conjugate();
}

// How far a piece turned since the start of the substep, in the mean.
Quat mean_turn(const SimulationMesh& rest, std::span<const ParticleId> particles, const Vec3& start_center,
               const Vec3& center, const Movables& movables) {
    Mat3 A = Mat3::Zero();
    for (const ParticleId j : particles) {
        const MovingParticle& p = movables.moving[j];
        const Mat3 H = to_matrix(movables.inertia[j]), moment = 0.5 * H.trace() * Mat3::Identity() - H;
        A += rest.mass[j] * (p.x - center) * (movables.start_position[j] - start_center).transpose() +
             (p.d * movables.start_rotation[j].conjugate()).toRotationMatrix() * moment;
    }
    return optimal_rotation(A, Quat::Identity());
}

// Whether it bends stiffly, free, and not in a pair (`smooth`).
bool turns_by_itself(const LiveModel& model, std::span<const ParticleId> particles, std::span<const uint8_t> kept,
                     std::span<const uint8_t> smooth, const Movables& movables, double h) {
    return particles.size() > 1 && !kept[particles.front()] && !smooth[particles.front()] &&
           bends_stiffly(model, particles, h) &&
           std::ranges::none_of(particles, [&](ParticleId j) { return movables.is_held_or_tied(j); });
}

PieceKind kind_of(size_t n_particles, bool is_unbroken) {
    if (n_particles == 1) return is_unbroken ? PieceKind::single : PieceKind::chip;
    return is_unbroken ? PieceKind::whole : PieceKind::torn;
}

}  // namespace

bool bends_stiffly(const LiveModel& model, std::span<const ParticleId> particles, double h) {
    return std::ranges::any_of(particles, [&](ParticleId j) { return model.bends(j); }) &&
           !resolves_waves(model, particles, h);
}

void remember_pieces(const StepContext& context, double h, const LiveTopology& live, std::span<const uint8_t> smooth,
                     const Movables& movables, Pieces& pieces) {
    SUNDER_ASSERT(h > 0 && pieces.whole.size() == live.n_pieces() + context.scene.rigid_bodies.size());
    SUNDER_ASSERT(pieces.held.size() == live.n_pieces() && pieces.angular.size() == live.n_pieces());
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        pieces.whole[piece] = ContactPiece();
        const auto particles = live.piece_particles(piece);
        const auto holds = [&](ParticleId j) {
            return live.count(j) == rest.group_offset[j + 1] - rest.group_offset[j];
        };
        pieces.whole[piece].kind = kind_of(particles.size(), std::ranges::all_of(particles, holds));
        const bool is_smooth = smooth[particles.front()] != 0 && particles.size() > 1;
        if (pieces.held[piece] || is_smooth) return;
        const PieceMomentum p = piece_momentum(rest, movables.inertia, particles, movables.start_position,
                                               movables.velocity, movables.angular_velocity);
        pieces.angular[piece] = p.angular;
        ContactPiece& c = pieces.whole[piece];
        c.center = p.center;
        c.inverse_mass = 1 / p.mass;
        c.inverse_inertia = p.inertia.inverse();
        c.spin = c.inverse_inertia * p.angular;
        c.rigid = particles.size() == 1;
        if (c.rigid)
            c.turned = h * movables.angular_velocity[particles.front()] +
                       c.inverse_inertia * movables.push[particles.front()].torque;
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const size_t i = rest.n_particles() + r;
        const Vec3 inverse = rigid_body_inertia(context.scene.rigid_bodies[r]).cwiseInverse();
        const Mat3 D = movables.start_rotation[i].toRotationMatrix();
        ContactPiece& c = pieces.whole[pieces.of[i]];
        c = ContactPiece();
        c.kind = PieceKind::rigid_body, c.rigid = true;
        c.center = movables.start_position[i];
        if (!(movables.inverse_mass[i] > 0)) continue;  // nothing turns a sleeper either
        c.inverse_mass = movables.inverse_mass[i];
        c.inverse_inertia = D * inverse.asDiagonal() * D.transpose();
        c.turned = h * movables.angular_velocity[i] + c.inverse_inertia * movables.push[i].torque;
    }
}

void predict_turns(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                   std::span<const uint8_t> smooth, Movables& movables) {
    if (model.thin.empty()) return;
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        if (!turns_by_itself(model, particles, kept, smooth, movables, h)) return;
        const PieceMomentum p = piece_momentum(rest, movables.inertia, particles, movables.start_position,
                                               movables.velocity, movables.angular_velocity);
        const Vec3 spin = rigid_spin(p, p.angular);
        if (!(h * spin.norm() > kFarTurn)) return;
        const Quat turn = free_turn(p.inertia.inverse(), p.angular, h);
        for (const ParticleId j : particles) {
            MovingParticle& m = movables.moving[j];
            const Vec3 lever = movables.start_position[j] - p.center;
            const Vec3 own = movables.velocity[j] - p.velocity - spin.cross(lever);
            m.x = m.x_inertial = p.center + h * p.velocity + turn * (lever + h * own);
            const Quat own_turn = rotation_of(h * (movables.angular_velocity[j] - spin));
            m.d = m.d_inertial = (turn * own_turn * movables.start_rotation[j]).normalized();
        }
    });
}

void keep_rigid_motion(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                       std::span<const uint8_t> smooth, std::span<const Vec3> position, Movables& movables) {
    if (model.thin.empty()) return;
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        if (!turns_by_itself(model, particles, kept, smooth, movables, h)) return;
        const Vec3 start =
            center_of_mass(rest, particles, [&](ParticleId j) -> const Vec3& { return movables.start_position[j]; });
        const PieceMomentum p =
            piece_momentum(rest, movables.inertia, particles, position, movables.velocity, movables.angular_velocity);
        const Quat turn = mean_turn(rest, particles, start, p.center, movables);
        if (!(rotation_vector(turn).norm() > kFarTurn)) return;
        const Vec3 spin = rigid_spin(p, p.angular);
        for (const ParticleId j : particles) {
            movables.velocity[j] = p.velocity + spin.cross(position[j] - p.center);
            movables.angular_velocity[j] = spin;
        }
    });
}

void start_in_shape(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                    const Pieces& pieces, Movables& movables) {
    if (model.thin.empty()) return;
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const ContactPiece& c = pieces.whole[piece];
        const auto particles = model.live.piece_particles(piece);
        if (pieces.held[piece] || moves_alone(c) || pieces.is_touched[piece] || kept[particles.front()]) return;
        if (!bends_stiffly(model, particles, h)) return;
        const Vec3 center = piece_center(rest, particles, movables.moving, &MovingParticle::x);
        const Quat turn = mean_turn(rest, particles, c.center, center, movables);
        for (const ParticleId j : particles) {
            MovingParticle& p = movables.moving[j];
            p.x = center + turn * (movables.start_position[j] - c.center);
            p.d = (turn * movables.start_rotation[j]).normalized();
        }
    });
}

void tumble_pieces(const StepContext& context, double h, const LiveModel& model, std::span<const uint8_t> kept,
                   const Pieces& pieces, std::span<GroupGoal> goals, Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const ContactPiece& c = pieces.whole[piece];
        const auto particles = model.live.piece_particles(piece);
        if (moves_alone(c) || pieces.is_touched[piece] || kept[particles.front()]) return;
        const Vec3& L = pieces.angular[piece];
        const double turn = h * (c.inverse_inertia * L).norm();
        if (turn < kLeastTumble || resolves_waves(model, particles, h)) return;
        if (turn > kFarTurn && !bends_stiffly(model, particles, h)) return;
        const Quat wanted = free_turn(c.inverse_inertia, L, h);
        const Vec3 center = piece_center(rest, particles, movables.moving, &MovingParticle::x);
        const Quat more = wanted * mean_turn(rest, particles, c.center, center, movables).conjugate();
        for (const ParticleId j : particles) {
            MovingParticle& p = movables.moving[j];
            p.x = center + more * (p.x - center);
            p.d = (more * p.d).normalized();
            goals[j].rotation = (more * goals[j].rotation).normalized();
        }
    });
}

void note_what_pins_take(const SimulationMesh& rest, double h, const LiveTopology& live, const ContactProblem& problem,
                         IslandId island, const Movables& movables, Pieces& pieces) {
    std::vector<ParticleId> free;
    for (const PieceId piece : problem.islands.pieces_of(island)) {
        if (piece >= live.n_pieces() || !pieces.held[piece]) continue;
        const auto taken = [&](ParticleId j) -> Vec3 {
            const RoundPush& push = problem.push_on(j);
            return rest.mass[j] * (push.shift - push.own);
        };
        free.clear();
        bool any = false;
        for (const ParticleId j : live.piece_particles(piece)) {
            if (movables.role[j] != Role::free) continue;
            free.push_back(j);
            any |= !taken(j).isZero(0);
        }
        if (!any) continue;
        const PieceMomentum p = piece_momentum(rest, movables.inertia, free, movables.start_position, movables.velocity,
                                               movables.angular_velocity);
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
        for (const ParticleId j : free) {
            linear += taken(j);
            angular += (movables.start_position[j] - p.center).cross(taken(j));
        }
        pieces.whole[piece].center = p.center;
        const Vec3 turn = p.inertia.inverse() * angular / h;
        pieces.change[piece] = {linear / (p.mass * h), turn, turn};
    }
}

void slow_held_pieces(const StepContext& context, const LiveTopology& live, const Movables& movables, Pieces& pieces) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        PieceVelocity& change = pieces.change[piece];
        if (!pieces.held[piece] || (change.velocity.isZero(0) && change.turn.isZero(0))) return;
        double slope = 0, curvature = 0;  // of the energy along the change, J
        for (const ParticleId j : live.piece_particles(piece)) {
            if (movables.role[j] != Role::free) continue;
            const Vec3 by =
                change.velocity + change.turn.cross(movables.start_position[j] - pieces.whole[piece].center);
            const Vec3 spun = product(movables.inertia[j], change.spin);
            slope += rest.mass[j] * by.dot(movables.velocity[j]) + spun.dot(movables.angular_velocity[j]);
            curvature += rest.mass[j] * by.squaredNorm() + spun.dot(change.spin);
        }
        const double share = slope < 0 ? std::min(1.0, -slope / curvature) : 0.0;
        change = {share * change.velocity, share * change.turn, share * change.spin};
    });
}

void turn_pieces(const SimulationMesh& rest, const LiveTopology& live, std::span<const PieceId> which,
                 const Movables& movables, Pieces& pieces) {
    for (const PieceId piece : which) {
        ContactPiece& p = pieces.whole[piece];
        if (moves_alone(p)) continue;
        Vec3 angular = Vec3::Zero();  // L of the displacements, kg m2
        for (const ParticleId j : live.piece_particles(piece)) {
            const Vec3 lever = movables.start_position[j] - p.center,
                       shift = movables.moving[j].x - movables.start_position[j];
            const Vec3 own = turned_by(movables.moving[j].d * movables.start_rotation[j].conjugate());
            angular += rest.mass[j] * lever.cross(shift) + product(movables.inertia[j], own);
        }
        p.turned = p.inverse_inertia * angular;
    }
}

void move_pieces(const SimulationMesh& rest, const LiveTopology& live, const ContactProblem& problem, IslandId island,
                 bool as_wholes, Movables& movables, Pieces& pieces) {
    for (const MovableId i : problem.islands.movables_of(island))
        if (moves_alone(pieces.whole[pieces.of[i]])) move_alone(problem.push_on(i), i, movables);
    for (const PieceId piece : problem.islands.pieces_of(island)) {
        ContactPiece& p = pieces.whole[piece];
        if (moves_alone(p))
            p.turned += pieces.motion[piece].spin;
        else
            move_piece(rest, live.piece_particles(piece), p, pieces.motion[piece], as_wholes, problem, movables);
        pieces.motion[piece] = PieceMotion();
    }
}

void turn_rigid_things(const StepContext& context, double h, const LiveTopology& live, const Pieces& pieces,
                       Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        if (!pieces.whole[piece].rigid) return;
        const ParticleId i = live.piece_particles(piece).front();
        turn_alone(movables, i, rest.rest_orientation[i], ellipsoid_inertia(rest, i),
                   pieces.angular[piece] + bounded(movables.push[i].torque, pieces.whole[piece].inverse_inertia) / h,
                   h);
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r) {
        const MovableId i(rest.n_particles() + r);
        const Vec3 moments = rigid_body_inertia(context.scene.rigid_bodies[r]);
        const Quat& D = movables.start_rotation[i];
        const Vec3 L = D * moments.cwiseProduct(D.conjugate() * movables.angular_velocity[i]) +
                       bounded(movables.push[i].torque, pieces.whole[pieces.of[i]].inverse_inertia) / h;
        turn_alone(movables, i, Quat::Identity(), moments, L, h);
    }
}

void change_velocities(const StepContext& context, const LiveTopology& live, const Pieces& pieces, Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        const PieceVelocity& change = pieces.change[piece];
        if (change.velocity.isZero(0) && change.turn.isZero(0) && change.spin.isZero(0)) return;
        // From where the contacts were solved: a spin about what was the thin axis of a piece that has turned since
        // would swing its ends.
        for (const ParticleId j : live.piece_particles(piece)) {
            if (movables.role[j] != Role::free) continue;
            movables.velocity[j] +=
                change.velocity + change.turn.cross(movables.start_position[j] - pieces.whole[piece].center);
            movables.angular_velocity[j] += change.spin;
        }
    });
    for (size_t r = 0; r < context.scene.rigid_bodies.size(); ++r)
        movables.angular_velocity[rest.n_particles() + r] += pieces.change[live.n_pieces() + r].spin;
}

}  // namespace sunder
