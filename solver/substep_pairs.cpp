// Second order for what touches nothing.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/momentum.h"
#include "solver/piece_motion.h"
#include "solver/scene/motion.h"
#include "solver/substep.h"

namespace sunder {
namespace {

const double kUndamped = 1 - std::sqrt(0.5);
// Waves that run further than this in a substep, as a multiple of the piece's size (cbrt of its particles), are not
// resolved, and what an implicit step makes of them must not be carried on.
constexpr double kFarthestWave = 1.6;

// Of the family below that whose leading error is what a material with this damping time loses; its member of second
// order, if implicit Euler itself loses less.
double gamma_for(double damping_time, double h) {
    return damping_time > h ? kUndamped : 1 - std::sqrt(0.5 - damping_time / (4 * h));
}

}  // namespace

double phase_error(double damping_time, double h) {
    const double gamma = gamma_for(damping_time, h), rest = 1 - 2 * gamma;
    return 4.0 / 3 * (rest * rest * rest + 2 * gamma * gamma * gamma);
}

bool resolves_waves(const Workspace& work, std::span<const ParticleId> particles, double h) {
    if (particles.size() == 1) return true;
    double stiffest = 0;
    for (const ParticleId j : particles) stiffest = std::max(stiffest, work.live.count(j) * work.stiffness[j].k);
    return waves_in_step(h * h * stiffest) <= kFarthestWave * math::cbrt(static_cast<double>(particles.size()));
}

SubstepPair SubstepPair::renumbered(std::span<const MovableId> former, const WorkerPool& workers) const {
    SubstepPair now;
    const auto take = [&](const auto& from, auto& to) {
        to.resize(former.size());
        if (from.empty()) return;
        workers.for_range(former.size(), kParticleGrain, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i)
                if (former[i] < from.size()) to[i] = from[former[i]];
        });
    };
    take(smooth, now.smooth);
    take(begin_velocity, now.begin_velocity), take(begin_spin, now.begin_spin);
    take(position, now.position), take(rotation, now.rotation);
    take(velocity, now.velocity), take(spin, now.spin);
    return now;
}

// Two substeps of h are a step of H = 2 h by an L-stable diagonally implicit Runge-Kutta method of two stages, for all
// that touches nothing in either:
//   x1, v1 = implicit Euler over gamma H from x, v
//   x2, v2 = implicit Euler over gamma H from x1 + (1 - 2 gamma) H v1, v + (1 - gamma) / gamma (v1 - v).
// It multiplies a mode exp(z t) by (1 + (1 - 2 gamma) z H) / (1 - gamma z H)^2 = exp(z H + c z^2 H^2 + ...),
// c = 1/2 - (1 - gamma)^2: for gamma = 1 - 1/sqrt(2) of second order (SDIRK2; Alexander 1977), for gamma = 1/2 two
// steps of implicit Euler, and between them what Kelvin and Voigt's damping of relaxation time 2 c H does. So a
// material's own damping comes with the step, at no cost, while its time is at most h; beyond, `damp_vibrations` gives
// what is missing. Between the stages lies the middle of the pair, where contacts look for what comes near: there
// things go on as v1 and the first stage's acceleration take them. What touches something takes an implicit Euler step
// over h in each substep, from wherever it is.
void Substep::pair_up() {
    SubstepPair& pair = work.pair;
    const size_t n = n_movables();
    work.span.resize(n), work.base.resize(n), work.base_rotation.resize(n);
    if (stage == Stage::first) pair.begin_velocity.resize(n), pair.begin_spin.resize(n);
    work.gamma.clear();
    for (const Material& m : context.input.materials) work.gamma.push_back(gamma_for(m.damping_time, h));
    const FieldsOfForce fields(context.input);
    for_all(n, [&](size_t i) {
        work.span[i] = h, work.base[i] = work.start_position[i], work.base_rotation[i] = work.start_rotation[i];
        if (!pair.smooth[i]) return;
        work.span[i] = 2 * h * gamma_of(i);
        if (!work.held[i]) begin_stage(fields, i);
    });
    if (!is_paired()) return;
    if (stage == Stage::first) hold_pins(Pinned::in_the_first_stage);
    for_all(n, [&](size_t i) {
        if (!pair.smooth[i] || !work.held[i]) return;
        const MovingParticle& p = work.moving[i];
        work.base[i] = p.x - work.span[i] * work.velocity[i];
        work.base_rotation[i] = rotation_of(-work.span[i] * work.angular_velocity[i]) * p.d;
    });
    take_up_smooth_momentum();
}

double Substep::gamma_of(size_t movable) const {
    return movable < n_particles() ? work.gamma[rest().body[movable]] : kUndamped;
}

bool Substep::is_paired() const { return stage != Stage::alone && context.settings.method != Method::gauss_seidel; }

// Of pairs: those that touch something, those whose waves are not resolved, those that turn about what holds them or
// are let go, and what is fixed, for it may be woken between the two.
std::vector<uint8_t> Substep::pieces_left_out() const {
    std::vector<uint8_t> rough(work.live.n_pieces() + state.rigid_bodies.size(), 0);
    if (!is_paired()) return rough;
    for (const ActiveContact& c : work.contacts) {
        rough[piece_of(c.contact.a)] = 1;
        if (has_movable_b(c.contact)) rough[piece_of(c.contact.b)] = 1;
    }
    for (size_t i = 0; i < context.fixed.size(); ++i)
        if (context.fixed[i]) rough[piece_of(i)] = 1;
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        const auto is_loose = [&](ParticleId j) { return work.held[j] == kHeldPlace || is_tied(j); };
        if (!resolves_waves(work, particles, h) || std::ranges::any_of(particles, is_loose)) rough[piece] = 1;
    });
    return rough;
}

// Where a stage's implicit step of a free thing starts from, and its inertial path.
void Substep::begin_stage(const FieldsOfForce& fields, size_t i) {
    SubstepPair& pair = work.pair;
    const double H = 2 * h, gamma = gamma_of(i), span = work.span[i];
    const bool turns = !work.pieces[work.piece[i]].rigid;
    if (stage == Stage::first) {
        const RigidBodyState* body = i < n_particles() ? nullptr : &state.rigid_bodies[i - n_particles()];
        pair.begin_velocity[i] = body ? body->velocity : state.velocity[i];
        pair.begin_spin[i] = body ? body->angular_velocity : state.angular_velocity[i];
    }
    Vec3 v = pair.begin_velocity[i], w = pair.begin_spin[i];
    if (stage == Stage::second) {
        const double carried = (1 - gamma) / gamma;
        work.base[i] = pair.position[i] + (1 - 2 * gamma) * H * pair.velocity[i];
        // Damping is between particles: what all of a free piece gains by falling has none.
        if (i >= n_particles() || !work.piece_held[work.piece[i]])
            work.base[i] -= (0.5 - (1 - gamma) * (1 - gamma)) * H * (fields.after(H, v) - v);
        v += carried * (pair.velocity[i] - v);
        if (turns) {
            work.base_rotation[i] = (rotation_of((1 - 2 * gamma) * H * pair.spin[i]) * pair.rotation[i]).normalized();
            w += carried * (pair.spin[i] - w);
        }
    }
    work.velocity[i] = fields.after(span, v);
    if (turns) work.angular_velocity[i] = w;
    if (work.kept[i]) return;
    MovingParticle& p = work.moving[i];
    p.x = p.x_inertial = work.base[i] + span * work.velocity[i];
    if (!turns) return;  // it turns freely, a substep at a time
    p.d = p.d_inertial = (rotation_of(span * w) * work.base_rotation[i]).normalized();
}

// Free pieces keep the angular momentum of the pair's start.
void Substep::take_up_smooth_momentum() {
    const SubstepPair& pair = work.pair;
    const double drag = FieldsOfForce(context.input).drag;
    const auto inertia_of = [&](ParticleId j) {  // after the first stage
        return turned_inertia(pair.rotation[j], work.shapes.particle_moment[j]);
    };
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        if (work.piece_held[piece] || particles.size() == 1 || !pair.smooth[particles.front()]) return;
        if (stage == Stage::first)
            work.piece_angular[piece] = piece_momentum(rest(), work.inertia, particles, work.start_position,
                                                       work.velocity, work.angular_velocity)
                                            .angular;
        else {
            const double gamma = gamma_of(particles.front()), left = 1 / (1 + 2 * gamma * h * drag);
            work.piece_angular[piece] =
                (1 + (1 - gamma) / gamma * (left - 1)) *
                piece_momentum(rest(), inertia_of, particles, pair.position, pair.velocity, pair.spin).angular;
        }
    });
}

void Substep::begin_middle() {
    SubstepPair& pair = work.pair;
    pair.position.resize(n_movables()), pair.velocity.resize(n_movables()), pair.spin.resize(n_movables());
    pair.rotation.resize(n_movables());
    hold_pins(Pinned::in_the_middle);
}

// Of a first stage: keeps it for the second, and leaves what is smooth in the middle of the pair.
void Substep::go_on_to_the_middle(size_t i) {
    SubstepPair& pair = work.pair;
    if (!pair.smooth[i]) return;
    MovingParticle& p = work.moving[i];
    pair.position[i] = p.x, pair.velocity[i] = work.velocity[i];
    pair.rotation[i] = p.d, pair.spin[i] = work.angular_velocity[i];
    if (work.held[i]) return;
    const double gamma = gamma_of(i), onwards = (1 - 2 * gamma) * h, more = onwards / (2 * gamma * h);
    p.x += onwards * work.velocity[i];
    work.velocity[i] += more * (work.velocity[i] - pair.begin_velocity[i]);
    if (work.pieces[work.piece[i]].rigid) return;
    p.d = (rotation_of(onwards * work.angular_velocity[i]) * p.d).normalized();
    work.angular_velocity[i] += more * (work.angular_velocity[i] - pair.begin_spin[i]);
}

// What a material's damping takes of its vibrations, as far as the step itself takes less: velocities of an implicit
// step of that damping alone. Rigid motions of a piece, held or not, are none.
void Substep::damp_vibrations() {
    const auto lacks = [&](const Material& m) { return m.damping_time > h; };
    if (context.settings.method == Method::gauss_seidel || std::ranges::none_of(context.input.materials, lacks)) return;
    std::vector<double>& span = work.span;  // the velocities are known: it is free
    std::atomic<bool> any{false};
    for_all(n_particles(), [&](size_t i) {
        const double wanted = material(i).damping_time;
        double product = std::max(0.0, wanted - h) * h;  // missing time, times how long, s2
        if (work.pair.smooth[i]) product = stage == Stage::second && wanted > h ? 2 * h * wanted : 0;
        span[i] = std::sqrt(product);
        if (product > 0 && work.live.count(i) > 1) any = true;
    });
    if (!any) return;
    // The rigid motion of a piece, large beside its vibrations, is taken out first.
    std::vector<Vec3> shift(n_particles(), Vec3::Zero()), turn = shift;
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        if (particles.size() == 1) return;
        const PieceMomentum p =
            piece_momentum(rest(), work.inertia, particles, state.position, work.velocity, work.angular_velocity);
        const Vec3 spin = rigid_spin(p, p.angular);
        for (const ParticleId j : particles) {
            shift[j] = work.velocity[j] - p.velocity - spin.cross(state.position[j] - p.center);
            turn[j] = work.angular_velocity[j] - spin;
        }
    });
    take_up_bending(context, state, work);
    work.newton.damp({rest(), work.live, work.shapes, work.stiffness, work.held, span, {}, {}, bending()},
                     context.workers, work.goals, work.moving, shift, turn);
    // The solve ends early, and what it leaves undone may be momentum.
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        Vec3 momentum = Vec3::Zero();
        double mass = 0;
        for (const ParticleId j : particles) momentum += rest().mass[j] * shift[j], mass += rest().mass[j];
        const Vec3 lost = work.piece_held[piece] ? Vec3(Vec3::Zero()) : Vec3(momentum / mass);
        for (const ParticleId j : particles) work.velocity[j] += shift[j] - lost, work.angular_velocity[j] += turn[j];
    });
}

}  // namespace sunder
