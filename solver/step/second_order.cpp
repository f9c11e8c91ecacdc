#include "solver/step/second_order.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/matching/unit_schedule.h"
#include "solver/pieces/momentum.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/loops.h"
#include "solver/step/pins.h"

namespace sunder {
namespace {

const double kUndamped = 1 - std::sqrt(0.5);

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

StepPair StepPair::renumbered(std::span<const MovableId> former, const WorkerPool& workers) const {
    StepPair now;
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

double StepPair::gamma_of(const SimulationMesh& rest, MovableIndex i) const {
    return i < rest.n_particles() ? gamma[rest.body[i]] : kUndamped;
}

bool is_paired(const StepContext& context, Stage stage) {
    return stage != Stage::alone && context.settings.method != Method::gauss_seidel;
}

std::vector<uint8_t> pieces_left_out(const StepContext& context, const StepTime& time, const LiveModel& model,
                                     std::span<const ActiveContact> contacts, const Movables& movables) {
    const LiveTopology& live = model.live;
    std::vector<uint8_t> rough(live.n_pieces() + context.scene.rigid_bodies.size(), 0);
    if (!is_paired(context, time.stage)) return rough;
    for (const ActiveContact& c : contacts) {
        rough[piece_of(live, c.contact.a)] = 1;
        if (has_movable_b(c.contact)) rough[piece_of(live, c.contact.b)] = 1;
    }
    for (size_t i = 0; i < context.fixed.size(); ++i)
        if (context.fixed[i]) rough[piece_of(live, i)] = 1;
    for (size_t i = 0; i < movables.pull.size(); ++i)
        if (movables.pull[i].acts()) rough[piece_of(live, i)] = 1;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = live.piece_particles(piece);
        const auto is_loose = [&](ParticleId j) {
            return movables.role[j] == Role::hinged || movables.tethers.hold(j);
        };
        if (!resolves_waves(model, particles, time.h) || std::ranges::any_of(particles, is_loose)) rough[piece] = 1;
    });
    return rough;
}

namespace {

// Where a stage's implicit step of a free thing starts from, and its inertial path.
class StageStart {
public:
    StageStart(const StepContext& context, const StepTime& time, const FrameState& state, const Pieces& pieces)
        : context_(context), time_(time), state_(state), pieces_(pieces), fields_(context.input) {}

    void begin(size_t i, bool is_kept, StepPair& pair, Movables& movables) const {
        const size_t n = context_.n_particles();
        const double H = 2 * time_.h, gamma = pair.gamma_of(context_.scene.rest, i), span = movables.span[i];
        const bool turns = !pieces_.whole[pieces_.of[i]].rigid;
        if (time_.stage == Stage::first) {
            const RigidBodyState* body = i < n ? nullptr : &state_.rigid_bodies[i - n];
            pair.begin_velocity[i] = body ? body->velocity : state_.velocity[i];
            pair.begin_spin[i] = body ? body->angular_velocity : state_.angular_velocity[i];
        }
        Vec3 v = pair.begin_velocity[i], w = pair.begin_spin[i];
        if (time_.stage == Stage::second) {
            const double carried = (1 - gamma) / gamma;
            movables.base[i] = pair.position[i] + (1 - 2 * gamma) * H * pair.velocity[i];
            // Damping is between particles: what all of a free piece gains by falling has none.
            if (i >= n || !pieces_.held[pieces_.of[i]])
                movables.base[i] -= (0.5 - (1 - gamma) * (1 - gamma)) * H * (fields_.after(H, v) - v);
            v += carried * (pair.velocity[i] - v);
            if (turns) {
                movables.base_rotation[i] =
                    (rotation_of((1 - 2 * gamma) * H * pair.spin[i]) * pair.rotation[i]).normalized();
                w += carried * (pair.spin[i] - w);
            }
        }
        movables.velocity[i] = fields_.after(span, v);
        if (turns) movables.angular_velocity[i] = w;
        if (is_kept) return;
        MovingParticle& p = movables.moving[i];
        p.x = p.x_inertial = movables.base[i] + span * movables.velocity[i];
        if (!turns) return;  // it turns freely, a step at a time
        p.d = p.d_inertial = (rotation_of(span * w) * movables.base_rotation[i]).normalized();
    }

private:
    const StepContext& context_;
    const StepTime& time_;
    const FrameState& state_;
    const Pieces& pieces_;
    const FieldsOfForce fields_;
};

}  // namespace

void pair_up(const StepContext& context, const StepTime& time, const LiveModel& model, std::span<const uint8_t> kept,
             const FrameState& state, Pieces& pieces, StepPair& pair, Movables& movables) {
    const size_t n = movables.size();
    const double h = time.h;
    movables.span.resize(n), movables.base.resize(n), movables.base_rotation.resize(n);
    if (time.stage == Stage::first) pair.begin_velocity.resize(n), pair.begin_spin.resize(n);
    pair.gamma.clear();
    for (const Material& m : context.input.materials) pair.gamma.push_back(gamma_for(m.damping_time, h));
    const StageStart start(context, time, state, pieces);
    for_all(context, n, [&](size_t i) {
        movables.span[i] = h, movables.base[i] = movables.start_position[i];
        movables.base_rotation[i] = movables.start_rotation[i];
        if (!pair.smooth[i]) return;
        movables.span[i] = 2 * h * pair.gamma_of(context.scene.rest, i);
        if (movables.role[i] == Role::free) start.begin(i, kept[i] != 0, pair, movables);
    });
    if (!is_paired(context, time.stage)) return;
    if (time.stage == Stage::first) {
        hold_pins(context, time, Pinned::in_the_first_stage, pair, movables);
        hold_followers(context, time, Pinned::in_the_first_stage, pair, movables);
    }
    for_all(context, n, [&](size_t i) {
        if (!pair.smooth[i] || movables.role[i] == Role::free) return;
        const MovingParticle& p = movables.moving[i];
        movables.base[i] = p.x - movables.span[i] * movables.velocity[i];
        movables.base_rotation[i] = rotation_of(-movables.span[i] * movables.angular_velocity[i]) * p.d;
    });
    take_up_smooth_momentum(context, time, model, movables, pair, pieces);
}

void take_up_smooth_momentum(const StepContext& context, const StepTime& time, const LiveModel& model,
                             const Movables& movables, const StepPair& pair, Pieces& pieces) {
    const SimulationMesh& rest = context.scene.rest;
    const double drag = FieldsOfForce(context.input).drag;
    const auto inertia_of = [&](ParticleId j) {  // after the first stage
        return turned_inertia(pair.rotation[j], model.shapes.particle_moment[j]);
    };
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        if (pieces.held[piece] || particles.size() == 1 || !pair.smooth[particles.front()]) return;
        if (time.stage == Stage::first)
            pieces.angular[piece] = piece_momentum(rest, movables.inertia, particles, movables.start_position,
                                                   movables.velocity, movables.angular_velocity)
                                        .angular;
        else {
            const double gamma = pair.gamma_of(rest, particles.front()), left = 1 / (1 + 2 * gamma * time.h * drag);
            pieces.angular[piece] =
                (1 + (1 - gamma) / gamma * (left - 1)) *
                piece_momentum(rest, inertia_of, particles, pair.position, pair.velocity, pair.spin).angular;
        }
    });
}

void begin_middle(const StepContext& context, const StepTime& time, StepPair& pair, Movables& movables) {
    const size_t n = movables.size();
    pair.position.resize(n), pair.velocity.resize(n), pair.spin.resize(n), pair.rotation.resize(n);
    hold_pins(context, time, Pinned::in_the_middle, pair, movables);
    hold_followers(context, time, Pinned::in_the_middle, pair, movables);
}

void go_on_to_the_middle(const StepContext& context, double h, const Pieces& pieces, size_t i, StepPair& pair,
                         Movables& movables) {
    if (!pair.smooth[i]) return;
    MovingParticle& p = movables.moving[i];
    pair.position[i] = p.x, pair.velocity[i] = movables.velocity[i];
    pair.rotation[i] = p.d, pair.spin[i] = movables.angular_velocity[i];
    if (movables.role[i] != Role::free) return;
    const double gamma = pair.gamma_of(context.scene.rest, i), onwards = (1 - 2 * gamma) * h,
                 more = onwards / (2 * gamma * h);
    p.x += onwards * movables.velocity[i];
    movables.velocity[i] += more * (movables.velocity[i] - pair.begin_velocity[i]);
    if (pieces.whole[pieces.of[i]].rigid) return;
    p.d = (rotation_of(onwards * movables.angular_velocity[i]) * p.d).normalized();
    movables.angular_velocity[i] += more * (movables.angular_velocity[i] - pair.begin_spin[i]);
}

void damp_vibrations(const StepContext& context, const StepTime& time, const FrameState& state, const Pieces& pieces,
                     const StepPair& pair, LiveModel& model, Matching& matching, Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = context.n_particles();
    const double h = time.h;
    const auto lacks = [&](const Material& m) { return m.damping_time > h; };
    if (context.settings.method == Method::gauss_seidel || std::ranges::none_of(context.input.materials, lacks)) return;
    std::vector<double>& span = movables.span;  // the velocities are known: it is free
    std::atomic<bool> any{false};
    for_all(context, n, [&](size_t i) {
        const double wanted = context.material(i).damping_time;
        double product = std::max(0.0, wanted - h) * h;  // missing time, times how long, s2
        if (pair.smooth[i]) product = time.stage == Stage::second && wanted > h ? 2 * h * wanted : 0;
        span[i] = std::sqrt(product);
        if (product > 0 && model.live.count(i) > 1) any = true;
    });
    if (!any) return;
    // The rigid motion of a piece, large beside its vibrations, is taken out first.
    std::vector<Vec3> shift(n, Vec3::Zero()), turn = shift;
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        if (particles.size() == 1) return;
        const PieceMomentum p = piece_momentum(rest, movables.inertia, particles, state.position, movables.velocity,
                                               movables.angular_velocity);
        const Vec3 spin = rigid_spin(p, p.angular);
        for (const ParticleId j : particles) {
            shift[j] = movables.velocity[j] - p.velocity - spin.cross(state.position[j] - p.center);
            turn[j] = movables.angular_velocity[j] - spin;
        }
    });
    model.take_up_bending(rest, state, context.workers);
    const std::span role = std::span(movables.role).first(n);
    matching.newton.damp({rest, model.live, model.shapes, model.stiffness, role, span, {}, {}, model.bending_shapes()},
                         context.workers, matching.goals, movables.moving, shift, turn);
    // The solve ends early, and what it leaves undone may be momentum.
    for_pieces(model.live, kParticleGrain, context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        Vec3 momentum = Vec3::Zero();
        double mass = 0;
        for (const ParticleId j : particles) momentum += rest.mass[j] * shift[j], mass += rest.mass[j];
        const Vec3 lost = pieces.held[piece] ? Vec3(Vec3::Zero()) : Vec3(momentum / mass);
        for (const ParticleId j : particles)
            movables.velocity[j] += shift[j] - lost, movables.angular_velocity[j] += turn[j];
    });
}

}  // namespace sunder
