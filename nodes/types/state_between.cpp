#include "nodes/types/state_between.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"
#include "solver/data/rotations.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

/// How long the way is, and how far along it we are.
struct Way {
    double duration;  // s
    double share;     // 0 .. 1
};

/// Where something is in both states.
struct Placement {
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    Vec3 spin = Vec3::Zero();  // rad/s
};

/// What moves as a whole, on its way.
struct Motion {
    Vec3 centre, velocity;
    Vec3 spin;        // rad/s
    Quat turned;      // from the beginning until now
    Quat whole_turn;  // from the beginning to the end
};

// How much of a parabola a path is. With displacement d and velocities v_a, v_b over the time h, one acceleration gives
// (v_a + v_b) h = 2 d; n steps of symplectic Euler miss that by a share 1/n of (v_b - v_a) h, a landing by up to all.
double curved_share(const Vec3& miss, const Vec3& change) {
    constexpr double kFits = 0.25, kFitsNot = 0.5;  // of the change of velocity times h
    const double share = miss.norm() / change.norm();
    return std::clamp((kFitsNot - share) / (kFitsNot - kFits), 0.0, 1.0);
}

void move_centre(const Placement& a, const Placement& b, const Way& way, Motion& out) {
    const double t = way.share, h = way.duration;
    const Vec3 d = b.position - a.position, change = (b.velocity - a.velocity) * h;
    out.centre = a.position + t * d;
    out.velocity = d / h;
    if (!(change.squaredNorm() > 0)) return;
    const double curved = curved_share((a.velocity + b.velocity) * h - 2 * d, change);
    out.centre -= (0.5 * curved * t * (1 - t)) * change;
    out.velocity -= (0.5 * curved * (1 - 2 * t) / h) * change;
}

Vec3 acceleration_of(const Placement& a, const Placement& b, double duration) {
    const Vec3 d = b.position - a.position, change = (b.velocity - a.velocity) * duration;
    if (!(change.squaredNorm() > 0)) return Vec3::Zero();
    const double curved = curved_share((a.velocity + b.velocity) * duration - 2 * d, change);
    return change * (curved / (duration * duration));
}

/// The rotation vector of `turn`, rad: the shorter way round, or as many whole turns more as come next to `expected`.
Vec3 steady_turn(const Quat& turn, const Vec3& expected) {
    constexpr double kWhole = 2 * std::numbers::pi;
    const Vec3 shortest = rotation_vector(turn);
    const double angle = shortest.norm(), far = expected.norm();
    if (far < 0.5 * std::numbers::pi) return shortest;
    const Vec3 axis = angle < 1e-9 ? Vec3(expected / far) : Vec3(shortest / angle);
    return axis * (angle + kWhole * std::round((expected.dot(axis) - angle) / kWhole));
}

/// `turn`: from the orientation in a to that in b.
Motion motion_of(const Placement& a, const Placement& b, const Quat& turn, const Way& way) {
    Motion m;
    move_centre(a, b, way, m);
    const Vec3 whole = steady_turn(turn, 0.5 * way.duration * (a.spin + b.spin));
    m.spin = whole / way.duration;
    m.turned = rotation_of(way.share * whole);
    m.whole_turn = rotation_of(whole);
    return m;
}

bool same(const Quat& a, const Quat& b) { return a.coeffs() == b.coeffs(); }

// That of the beginning where a yield is infinite ("never") in one of them.
double blend(double a, double b, double t) { return a == b || !std::isfinite(b - a) ? a : a + t * (b - a); }

/// The particles of a state on their way.
class Between {
public:
    Between(const SimulationMesh& rest, const FrameState& a, const FrameState& b, double share,
            std::span<const Carried> carried)
        : rest_(rest), a_(a), b_(b), way_{b.time - a.time, share}, out_(a), held_(a.n_particles()) {
        for (uint32_t i = 0; i < a.n_particles(); ++i)
            if (a.position[i] == b.position[i]) held_[i] = Carried{ParticleId(i), a.position[i], a.velocity[i]};
        for (const Carried& c : carried)
            if (a.position[c.particle] != b.position[c.particle]) held_[c.particle] = c;
    }

    FrameState run() {
        out_.time = time_between(a_.time, b_.time, way_.share);
        break_edges();
        for (size_t i = 0; i < std::min(out_.inactive.size(), b_.inactive.size()); ++i)  // a of a file may have none
            out_.inactive[i].followed = b_.inactive[i].followed;
        find_pieces();
        for_each_piece([&](std::span<const uint32_t> particles) { move_piece(particles); });
        for (size_t i = 0; i < out_.rigid_bodies.size(); ++i) move_rigid_body(i);
        blend_material();
        return std::move(out_);
    }

    std::vector<PieceMotion> motions(const FrameState& shown) {
        find_pieces();
        std::vector<PieceMotion> of_particle(a_.n_particles());
        for_each_piece([&](std::span<const uint32_t> particles) {
            if (rests(particles)) return;
            const Placement a = placement(a_, particles), b = placement(b_, particles);
            const Placement now = placement(shown, particles);
            const Motion begins = motion_of(a, b, turn(particles), way_);
            PieceMotion motion = {.centre = now.position,
                                  .velocity = now.velocity,
                                  .acceleration = acceleration_of(a, b, way_.duration),
                                  .spin = begins.spin};
            if (shown.time == a_.time && shown.time > 0) motion.velocity_lag = velocity_lag(particles, begins, motion);
            motion.acceleration -= mean_of_held(particles, [&](uint32_t i) {
                return Vec3(motion.acceleration_at(shown.position[i]) - held_[i]->acceleration);
            });
            for (const uint32_t i : particles) {
                of_particle[i] = motion;
                if (!held_[i]) continue;
                of_particle[i] = {.centre = held_[i]->position,
                                  .velocity = held_[i]->velocity,
                                  .acceleration = held_[i]->acceleration};
                if (turns(i)) of_particle[i].spin = motion.spin;
            }
        });
        return of_particle;
    }

private:
    template <class Visit>
    void for_each_piece(Visit&& visit) const {
        for (size_t begin = 0; begin < order_.size();) {
            size_t end = begin + 1;
            while (end < order_.size() && piece_[order_[end]] == piece_[order_[begin]]) ++end;
            visit(std::span<const uint32_t>(order_.data() + begin, end - begin));
            begin = end;
        }
    }

    void break_edges() {
        out_.broken.clear();
        for (const BrokenEdge& broken : b_.broken) {
            if (broken.time > out_.time) continue;
            out_.broken.push_back(broken);
            out_.edge_intact[broken.edge] = 0;
            if (out_.edge_damage.empty()) continue;
            out_.edge_damage[broken.edge] = b_.edge_damage[broken.edge];
            out_.edge_hold[broken.edge] = b_.edge_hold[broken.edge];
        }
    }

    // Particles piece after piece, of the pieces at the end.
    void find_pieces() {
        const size_t n = a_.n_particles();
        std::vector<uint32_t> sets = disjoint_sets(n);
        for (size_t e = 0; e < rest_.n_edges(); ++e)
            if (b_.edge_intact[e]) unite(sets, rest_.edges[e].a.value, rest_.edges[e].b.value);
        piece_.resize(n), order_.resize(n);
        for (uint32_t i = 0; i < n; ++i) piece_[i] = lowest(sets, i), order_[i] = i;
        std::ranges::stable_sort(order_, {}, [&](uint32_t i) { return piece_[i]; });
    }

    bool turns(uint32_t i) const { return !same(a_.orientation[i], b_.orientation[i]); }
    bool rests(std::span<const uint32_t> particles) const {
        return std::ranges::all_of(particles,
                                   [&](uint32_t i) { return a_.position[i] == b_.position[i] && !turns(i); });
    }

    // Zero if none is held.
    template <class Value>
    Vec3 mean_of_held(std::span<const uint32_t> particles, Value&& value) const {
        Vec3 sum = Vec3::Zero();
        double n = 0;
        for (const uint32_t i : particles)
            if (held_[i]) sum += value(i), ++n;
        return n > 0 ? Vec3(sum / n) : sum;
    }

    Placement placement(const FrameState& s, std::span<const uint32_t> particles) const {
        Placement p;
        double mass = 0;
        for (const uint32_t i : particles) {
            const double m = rest_.mass[i];
            mass += m;
            p.position += m * s.position[i], p.velocity += m * s.velocity[i], p.spin += m * s.angular_velocity[i];
        }
        p.position /= mass, p.velocity /= mass, p.spin /= mass;
        return p;
    }

    // The mean of how its particles turned.
    Quat turn(std::span<const uint32_t> particles) const {
        Eigen::Vector4d sum = Eigen::Vector4d::Zero(), first = sum;
        for (const uint32_t i : particles) {
            const Eigen::Vector4d q = (b_.orientation[i] * a_.orientation[i].conjugate()).coeffs();
            if (i == particles.front()) first = q;
            sum += (q.dot(first) < 0 ? -rest_.mass[i] : rest_.mass[i]) * q;
        }
        const double length = sum.norm();
        return length > 0 ? Quat(Eigen::Vector4d(sum / length)) : Quat::Identity();
    }

    // A step's velocity is that of its way: half a step before, but where steps go in pairs. No state tells which and
    // how long they were. What is blended does, from a state on: where it begins faster by lag times acceleration
    // (least squares over the piece). A lag is half a step, and so half the way, at most.
    double velocity_lag(std::span<const uint32_t> particles, const Motion& begins, const PieceMotion& motion) const {
        double along = 0, size = 0;
        for (const uint32_t i : particles) {
            const Vec3 acceleration = motion.acceleration_at(a_.position[i]);
            const Vec3 velocity = begins.velocity + begins.spin.cross(a_.position[i] - motion.centre);
            along += rest_.mass[i] * acceleration.dot(velocity - a_.velocity[i]);
            size += rest_.mass[i] * acceleration.squaredNorm();
        }
        return size > 0 ? std::clamp(along / size, 0.0, 0.5 * way_.duration) : 0;
    }

    void move_piece(std::span<const uint32_t> particles) {
        if (rests(particles)) return;
        const Placement a = placement(a_, particles), b = placement(b_, particles);
        const Motion m = motion_of(a, b, turn(particles), way_);
        const Quat back = m.whole_turn.conjugate();
        const double t = way_.share, h = way_.duration;
        for (const uint32_t i : particles) {
            const Vec3 from = a_.position[i] - a.position, to = back * (b_.position[i] - b.position);
            const Vec3 arm = m.turned * Vec3(from + t * (to - from));
            out_.position[i] = m.centre + arm;
            out_.velocity[i] = m.velocity + m.spin.cross(arm) + m.turned * Vec3((to - from) / h);
            const Quat end = back * b_.orientation[i];
            out_.orientation[i] = (m.turned * slerp(a_.orientation[i], t, end)).normalized();
            const Vec3 rest = rotation_vector(end * a_.orientation[i].conjugate());
            out_.angular_velocity[i] = m.spin + m.turned * Vec3(rest / h);
            out_.group_rotation[i] =
                (m.turned * slerp(a_.group_rotation[i], t, back * b_.group_rotation[i])).normalized();
        }
        hold(particles);
    }

    // What is held goes its own way, and the rest of its piece along with that: a plank that sags from a wall is no
    // flight, whose parabola would take the wall's end along.
    void hold(std::span<const uint32_t> particles) {
        const Vec3 away =
            mean_of_held(particles, [&](uint32_t i) { return Vec3(out_.position[i] - held_[i]->position); });
        const Vec3 speed =
            mean_of_held(particles, [&](uint32_t i) { return Vec3(out_.velocity[i] - held_[i]->velocity); });
        for (const uint32_t i : particles) {
            out_.position[i] = held_[i] ? held_[i]->position : Vec3(out_.position[i] - away);
            out_.velocity[i] = held_[i] ? held_[i]->velocity : Vec3(out_.velocity[i] - speed);
            if (!held_[i] || turns(i)) continue;
            out_.orientation[i] = a_.orientation[i];
            out_.angular_velocity[i] = a_.angular_velocity[i];
        }
    }

    void move_rigid_body(size_t i) {
        const RigidBodyState &a = a_.rigid_bodies[i], &b = b_.rigid_bodies[i];
        if (a.position == b.position && same(a.orientation, b.orientation)) return;
        const Motion m =
            motion_of({a.position, a.velocity, a.angular_velocity}, {b.position, b.velocity, b.angular_velocity},
                      b.orientation * a.orientation.conjugate(), way_);
        out_.rigid_bodies[i] = {m.centre, (m.turned * a.orientation).normalized(), m.velocity, m.spin};
    }

    void blend_material() {
        const double t = way_.share;
        for (size_t i = 0; i < out_.plastic_deformation.size(); ++i) {
            const Mat3 &a = a_.plastic_deformation[i], &b = b_.plastic_deformation[i];
            if (a == b) continue;
            const Mat3 mean = a + t * (b - a);
            out_.plastic_deformation[i] = mean / math::cbrt(mean.determinant());
        }
        for (size_t i = 0; i < out_.plastic_curvature.size(); ++i)
            out_.plastic_curvature[i] += t * (b_.plastic_curvature[i] - a_.plastic_curvature[i]);
        for (size_t i = 0; i < out_.strain.size(); ++i) {
            out_.strain[i] = blend(a_.strain[i], b_.strain[i], t);
            out_.yield[i] = blend(a_.yield[i], b_.yield[i], t);
        }
        for (size_t i = 0; i < out_.stiffness_factor.size(); ++i)
            out_.stiffness_factor[i] = blend(a_.stiffness_factor[i], b_.stiffness_factor[i], t);
    }

    const SimulationMesh& rest_;
    const FrameState &a_, &b_;
    const Way way_;
    FrameState out_;
    std::vector<std::optional<Carried>> held_;  // what is carried, or is at the same place in both (n_particles)
    std::vector<uint32_t> piece_, order_;
};

}  // namespace

FrameState state_between(const SimulationMesh& rest, const FrameState& a, const FrameState& b, double share,
                         std::span<const Carried> carried) {
    return Between(rest, a, b, share, carried).run();
}

std::vector<PieceMotion> piece_motions(const SimulationMesh& rest, const FrameState& a, const FrameState& b,
                                       const FrameState& shown, std::span<const Carried> carried) {
    return Between(rest, a, b, 0, carried).motions(shown);
}

}  // namespace sunder
