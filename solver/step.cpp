#include "solver/step.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "solver/gauss_seidel.h"
#include "solver/motion.h"
#include "solver/piece_motion.h"
#include "solver/plasticity.h"
#include "solver/polar_decomposition.h"
#include "solver/step_limit.h"

namespace sunder {
namespace {

constexpr double kRunawaySpeed = 1e5;       // m/s; nothing that an artist animates is faster: numbers went bad
constexpr double kContactTolerance = 1e-4;  // of the contact margin: a change of gap below it ends the passes
constexpr int kFracturePasses = 8;          // a substep, each after the last one's cuts let go
constexpr double kLeading = 0.8;            // what cuts in a pass is within a fifth of the piece's largest excess load
constexpr size_t kGroupGrain = 128, kParticleGrain = 512;  // fewest a thread is worth waking for

class Stopwatch {
public:
    explicit Stopwatch(double& io_seconds) : total_(io_seconds), start_(std::chrono::steady_clock::now()) {}
    ~Stopwatch() { total_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& total_;
    std::chrono::steady_clock::time_point start_;
};

// Names for the arrays of one substep.
struct Substep {
    const StepContext& context;
    const double h, begin, end;
    const bool measure;
    Workspace& work;
    FrameState& state;
    StepReport& report;

    const SimulationMesh& rest() const { return context.scene.rest; }
    size_t n_particles() const { return rest().n_particles(); }
    size_t n_movables() const { return n_particles() + state.rigid_bodies.size(); }
    ContactBodies bodies() const { return bodies_of(work); }
    // A resting contact closes at h g: it must not bounce, m/s.
    double resting_speed() const { return 2 * h * context.input.gravity.norm(); }
    const Material& material(size_t particle) const { return context.input.materials[rest().body[particle]]; }

    void load();
    void predict();
    void hold_pins();
    void find_contacts();
    void mark_held_pieces();
    void take_up_pieces();
    void correct(int iterations);
    void push_apart(bool last);
    void match_shapes(bool first_iteration);
    void update_velocities();
    void restore_momentum();
    void settle_contacts();
    void flow_and_measure(double seconds);
    bool break_edges(double leading);
    bool contacts_push() const;
    void run_cracks();
    void store();
    Status check_finite(const char* stage) const;
};

// Positions and rotations since rest, into the workspace; inverse masses and inertia there.
void Substep::load() {
    const Scene& scene = context.scene;
    for (size_t i = 0; i < n_particles(); ++i) {
        MovingParticle& p = work.moving[i];
        p.x = state.position[i];
        p.d = (state.orientation[i] * rest().rest_orientation[i].conjugate()).normalized();
        p.D = p.d.toRotationMatrix();
        const Mat3 M = to_matrix(work.shapes.particle_moment[i]);
        work.inertia[i] = p.D * (M.trace() * Mat3::Identity() - M) * p.D.transpose();
        work.inverse_mass[i] = 1.0 / rest().mass[i];
        work.velocity[i] = state.velocity[i];
        work.angular_velocity[i] = state.angular_velocity[i];
    }
    for (size_t r = 0; r < state.rigid_bodies.size(); ++r) {
        const size_t i = n_particles() + r;
        const RigidBodyState& body = state.rigid_bodies[r];
        MovingParticle& p = work.moving[i];
        p.x = body.position, p.d = body.orientation, p.D = p.d.toRotationMatrix();
        work.inverse_mass[i] = 1.0 / scene.rigid_bodies[r].mass;
        work.velocity[i] = body.velocity;
        work.angular_velocity[i] = body.angular_velocity;
    }
    for (size_t i = 0; i < n_movables(); ++i) {
        work.start_position[i] = work.moving[i].x;
        work.start_rotation[i] = work.moving[i].d;
        work.push[i] = ContactPush();
    }
}

// Forces act on velocities; held particles take the speed of their pin.
void Substep::predict() {
    Vec3 acceleration = context.input.gravity, wind = Vec3::Zero();
    double drag = 0;
    for (const Force& f : context.input.forces) acceleration += f.acceleration, wind += f.drag * f.wind, drag += f.drag;
    for (size_t i = 0; i < n_movables(); ++i)
        work.velocity[i] = (work.velocity[i] + h * (acceleration + wind)) / (1 + h * drag);  // implicit drag

    hold_pins();
    mark_held_pieces();
    for (size_t i = 0; i < n_movables(); ++i) {
        MovingParticle& p = work.moving[i];
        if (i < n_particles() && work.held[i]) continue;
        p.x = p.x_inertial = work.start_position[i] + h * work.velocity[i];
        p.d = p.d_inertial = (rotation_of(h * work.angular_velocity[i]) * work.start_rotation[i]).normalized();
        p.D = p.d.toRotationMatrix();
    }
}

void Substep::hold_pins() {
    std::fill(work.held.begin(), work.held.end(), uint8_t{0});
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        const DrivenPose& drive = context.input.pins[k];
        if (!drive.active) continue;
        const Pose pose = interpolate(drive, end);
        for (uint32_t i : context.scene.pins[k].particles) {
            MovingParticle& p = work.moving[i];
            p.x = p.x_inertial = pose.apply(rest().rest_position[i]);
            p.d = p.d_inertial = pose.orientation;
            p.D = p.d.toRotationMatrix();
            work.velocity[i] = (p.x - work.start_position[i]) / h;
            work.angular_velocity[i] = rotation_vector(p.d * work.start_rotation[i].conjugate()) / h;
            work.inverse_mass[i] = 0;
            work.held[i] = 1;
        }
    }
}

void Substep::mark_held_pieces() {
    work.piece_held.assign(work.live.n_pieces(), 0);
    for (size_t i = 0; i < n_particles(); ++i)
        if (work.held[i]) work.piece_held[work.live.piece(i)] = 1;
}

// Pieces as contacts see them, from the start of the substep; anew when edges broke.
void Substep::take_up_pieces() {
    for (size_t i = 0; i < n_movables(); ++i)
        work.piece[i] =
            static_cast<uint32_t>(i < n_particles() ? work.live.piece(i) : work.live.n_pieces() + (i - n_particles()));
    work.pieces.resize(work.live.n_pieces() + state.rigid_bodies.size());
    work.piece_change.resize(work.pieces.size());
    work.piece_angular.assign(work.live.n_pieces(), Vec3::Zero());
    remember_pieces(context, h, work);
    prepare_contacts(bodies(), work.velocity, work.angular_velocity, h, context.settings.depenetration_speed,
                     work.contacts);
    find_islands(bodies(), work.contacts, work.islands);
}

void Substep::find_contacts() {
    work.detection.find(context.scene, context.input, context.settings.self_collision, work.live, work.held,
                        {work.start_position, work.start_rotation, work.velocity, work.angular_velocity},
                        {h, begin, end}, work.contacts);
    report.contacts = std::max(report.contacts, work.contacts.size());
    take_up_pieces();
    divide_pushes(context, h, false, work);
    warm_start(bodies(), state.contacts, h, resting_speed(), work.contacts);
    move_pieces(context, work);
}

// Towards the implicit Euler step, contacts after each sweep; and before it where it is the only one.
void Substep::correct(int iterations) {
    if (iterations == 1) push_apart(false);
    for (int sweep = 0; sweep < iterations; ++sweep) {
        {
            Stopwatch watch(report.shape_s);
            match_shapes(sweep == 0);
        }
        push_apart(sweep + 1 == iterations);
    }
}

// A round over the contacts; `last`: no shape matching follows.
void Substep::push_apart(bool last) {
    Stopwatch watch(report.contact_s);
    divide_pushes(context, h, last, work);
    const double enough = kContactTolerance * work.detection.margin();
    relax_contacts(bodies(), work.islands, enough, work.contacts);
    move_pieces(context, work);
}

void Substep::match_shapes(bool first_iteration) {
    const SolverSettings& settings = context.settings;
    if (settings.method == Method::gauss_seidel)
        return gauss_seidel_sweep(work.live, work.shapes, work.paper_stiffness, work.held, work.moving, work.goals);

    context.workers.for_range(n_particles(), kGroupGrain, [&](size_t first, size_t last) {
        match_groups(work.live, work.shapes, work.stiffness, h, work.moving, first, last, work.goals);
    });
    if (settings.method == Method::projective) {
        work.before_newton = work.moving;
        work.newton.apply(first_iteration,
                          {rest(), work.live, work.shapes, work.stiffness, work.goals, work.inertia, work.held},
                          context.workers, work.moving);
        limit_step(work.live, work.before_newton, 0, work.live.n_pieces(), work.moving);
    } else {
        // A single over-relaxed sweep overshoots the implicit step.
        const double omega = settings.iterations > 1 ? settings.over_relaxation : 1.0;
        context.workers.for_range(n_particles(), kParticleGrain, [&](size_t first, size_t last) {
            average_goals(work.live, work.shapes, work.goals, omega, work.held, first, last, work.moving);
        });
    }
    restore_linear_momentum(rest(), work.live, work.piece_held, 0, work.live.n_pieces(), work.moving);
}

void Substep::update_velocities() {
    for (size_t i = 0; i < n_movables(); ++i) {
        const MovingParticle& p = work.moving[i];
        work.velocity[i] = (p.x - work.start_position[i]) / h;
        if (!work.pieces[work.piece[i]].rigid)
            work.angular_velocity[i] = rotation_vector(p.d * work.start_rotation[i].conjugate()) / h;
    }
}

// Each free piece gets the angular momentum that it had, plus what contacts gave it.
void Substep::restore_momentum() {
    context.workers.for_range(n_particles(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            const Mat3 M = to_matrix(work.shapes.particle_moment[i]);
            work.inertia[i] = work.moving[i].D * (M.trace() * Mat3::Identity() - M) * work.moving[i].D.transpose();
            state.position[i] = work.moving[i].x;
        }
    });
    for (size_t piece = 0; piece < work.live.n_pieces(); ++piece) {
        if (work.piece_held[piece] || work.pieces[piece].rigid) continue;
        const auto particles = work.live.piece_particles(piece);
        // Levers of the start, as the contacts were solved with: the large pushes on a pinched piece cancel there,
        // while a millimetre more or less of lever would spin it.
        Vec3 gained = Vec3::Zero();
        for (uint32_t j : particles)
            gained += rest().mass[j] * (work.start_position[j] - work.pieces[piece].center).cross(work.push[j].shift) +
                      work.push[j].torque;
        set_angular_momentum(rest(), work.inertia, particles, work.piece_angular[piece] + gained / h, state.position,
                             work.velocity, work.angular_velocity);
    }
}

void Substep::settle_contacts() {
    settle_velocities(bodies(), h, resting_speed(), work.contacts, work.angular_velocity, work.velocity,
                      work.piece_change);
    change_velocities(context, work);
    remember(bodies(), work.contacts, h, state.contacts);
}

// Optimal stretch of every group where things came to lie; flow above the yield strain; the load towards breaking.
void Substep::flow_and_measure(double seconds) {
    context.workers.for_range(n_particles(), kGroupGrain, [&](size_t first, size_t last) {
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            work.strains[g].load = 0;
            if (work.live.count(g) == 1) {
                state.strain[g] = 0;
                continue;
            }
            const Material m = material_of(rest(), g, material(g));
            const bool is_uneven = rest().group_uneven[g] != 0;
            const double toughness = std::min(m.toughness, m.compressive_toughness) *
                                     (is_uneven ? weakest_factor(rest(), work.live, g) : 1.0);
            const double limit = std::min(state.yield[g], toughness);
            if (limit == kNever && !measure) continue;

            const GroupMoments A = group_moments(work.live, work.shapes, work.moving, g);
            Quat& R = work.goals[g].rotation;
            R = optimal_rotation(A.positions * work.shapes.group[g].isotropy + kOrientationWeight * A.ellipsoids, R);
            const Mat3 S = optimal_stretch(work.shapes.group[g].stretch, R.toRotationMatrix(),
                                           A.positions + kStretchMomentWeight * A.ellipsoids);
            // |log lambda| <= limit wherever |S - I| is below this: no need for the eigenvectors.
            if (!measure && (S - Mat3::Identity()).norm() < -std::expm1(-limit)) continue;

            const PrincipalStretch principal = principal_stretch(S);
            PlasticState plastic{state.plastic_deformation[g], state.yield[g]};
            const FlowResult result = flow(principal, m, seconds, plastic);
            state.strain[g] = result.elastic_log_strain.cwiseAbs().maxCoeff();
            if (principal.reliable)
                work.strains[g] = is_uneven ? uneven_group_strain(result.elastic_log_strain, principal.directions, R, m,
                                                                  {rest(), work.live, work.shapes, work.moving}, g)
                                            : group_strain(result.elastic_log_strain, principal.directions, R, m);
            if (!result.flowed) continue;
            state.plastic_deformation[g] = plastic.F_P;
            state.yield[g] = plastic.yield;
            R = (R * result.spin).normalized();
            work.flowed[g] = 1;
        }
    });
}

bool Substep::break_edges(double leading) {
    const auto cuts =
        edges_to_cut({rest(), work.live, work.shapes, work.moving}, work.strains, leading, state.time + h);
    std::vector<uint32_t> broken;
    for (const BrokenEdge& cut : cuts) {
        state.edge_intact[cut.edge] = work.synced_edges[cut.edge] = 0;
        state.broken.push_back(cut);
        broken.push_back(cut.edge);
    }
    report.edges_broken += cuts.size();
    for (uint32_t g : work.live.remove_edges(rest(), broken)) work.flowed[g] = 1;
    if (!cuts.empty()) {
        mark_held_pieces();
        work.detection.topology_changed();
    }
    // Rest shapes changed where material flowed or edges broke.
    context.workers.for_range(n_particles(), kGroupGrain, [&](size_t first, size_t last) {
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            if (!work.flowed[g]) continue;
            work.flowed[g] = 0;
            work.synced_plastic[g] = state.plastic_deformation[g];
            work.shapes.rebuild(rest(), work.live, state.plastic_deformation[g], g);
            work.stiffness[g] =
                group_stiffness(work.shapes.group[g], work.shapes.rest_trace[g], rest().volume[g], material(g));
        }
    });
    return !cuts.empty();
}

bool Substep::contacts_push() const {
    return std::any_of(work.contacts.begin(), work.contacts.end(),
                       [](const ActiveContact& c) { return c.normal_impulse > 0; });
}

// Cuts and starts the correction over until nothing breaks: a crack runs as far as the load that it releases lets it,
// and not one ring a substep. Only while nothing pushes: what contacts did was divided by the pieces as they were, so
// that a hit breaks one pass a substep, after the momentum books are closed.
void Substep::run_cracks() {
    for (int pass = 0; pass < kFracturePasses; ++pass) {
        {
            Stopwatch watch(report.fracture_s);
            flow_and_measure(pass == 0 ? h : 0);
            if (!break_edges(kLeading)) return;
        }
        take_up_pieces();
        for (size_t i = 0; i < n_particles(); ++i) {
            MovingParticle& p = work.moving[i];
            p.x = p.x_inertial, p.d = p.d_inertial, p.D = p.d.toRotationMatrix();
        }
        correct(context.settings.iterations);
    }
}

void Substep::store() {
    const double keep = std::exp(-context.settings.damping * h);
    for (size_t i = 0; i < n_particles(); ++i) {
        const MovingParticle& p = work.moving[i];
        state.position[i] = p.x;
        state.orientation[i] = (p.d * rest().rest_orientation[i]).normalized();
        state.velocity[i] = keep * work.velocity[i];
        state.angular_velocity[i] = keep * work.angular_velocity[i];
        state.group_rotation[i] = work.goals[i].rotation;
    }
    for (size_t r = 0; r < state.rigid_bodies.size(); ++r) {
        const size_t i = n_particles() + r;
        state.rigid_bodies[r] = {work.moving[i].x, work.moving[i].d, keep * work.velocity[i],
                                 keep * work.angular_velocity[i]};
    }
    state.time += h;
}

Status Substep::check_finite(const char* stage) const {
    for (size_t i = 0; i < n_movables(); ++i) {
        const MovingParticle& p = work.moving[i];
        const bool finite = p.x.allFinite() && p.d.coeffs().allFinite() && work.velocity[i].allFinite() &&
                            work.angular_velocity[i].allFinite();
        if (finite && work.velocity[i].squaredNorm() < kRunawaySpeed * kRunawaySpeed) continue;
        const std::string who = i < n_particles()
                                    ? "particle " + std::to_string(i) + " (body '" +
                                          context.scene.bodies[rest().body[i]].name + "', fragment " +
                                          std::to_string(rest().fragment[i]) + ")"
                                    : "rigid body '" + context.scene.rigid_bodies[i - n_particles()].name + "'";
        return Error{ErrorCode::numerical,
                     who + (finite ? " runs away (above 1e5 m/s)" : " is not finite") + " after " + stage,
                     "time " + std::to_string(state.time) + " s",
                     "use more substeps, or a smaller stiffness or force",
                     {},
                     {}};
    }
    return {};
}

}  // namespace

void synchronise(const StepContext& context, const FrameState& state, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = rest.n_particles(), n_movables = n + context.scene.rigid_bodies.size();
    if (w.synced_edges != state.edge_intact || w.synced_plastic != state.plastic_deformation ||
        w.moving.size() != n_movables) {
        w.live.reset(rest, state.edge_intact);
        w.detection.topology_changed();
        w.shapes.reset(rest, w.live, state.plastic_deformation);
        w.synced_edges = state.edge_intact;
        w.synced_plastic = state.plastic_deformation;
        w.moving.resize(n_movables), w.start_position.resize(n_movables), w.start_rotation.resize(n_movables);
        w.velocity.resize(n_movables), w.angular_velocity.resize(n_movables);
        w.inverse_mass.resize(n_movables), w.own_share.resize(n_movables), w.piece.resize(n_movables);
        w.push.resize(n_movables);
        w.inertia.resize(n), w.stiffness.resize(n), w.paper_stiffness.resize(n), w.goals.resize(n);
        w.strains.assign(n, GroupStrain()), w.flowed.assign(n, 0), w.held.assign(n, 0);
    }
    for (size_t g = 0; g < n; ++g) {  // materials may be animated
        const Material& material = context.input.materials[rest.body[g]];
        w.stiffness[g] = group_stiffness(w.shapes.group[g], w.shapes.rest_trace[g], rest.volume[g], material);
        w.paper_stiffness[g] = material.stiffness;
        w.goals[g].rotation = state.group_rotation[g];
    }
}

Status substep(const StepContext& context, double h, double begin, double end, bool measure, Workspace& io_work,
               FrameState& io_state, StepReport& io_report) {
    Substep s{context, h, begin, end, measure, io_work, io_state, io_report};
    {
        Stopwatch watch(io_report.predict_s);
        s.load();
        s.predict();
    }
    {
        Stopwatch watch(io_report.contact_s);
        s.find_contacts();
    }
    s.correct(context.settings.iterations);
    const bool pushed = s.contacts_push();
    if (!pushed) s.run_cracks();
    {
        Stopwatch watch(io_report.momentum_s);
        turn_rigid_things(context, h, io_work);
        s.update_velocities();
        if (Status ok = s.check_finite("shape matching and fracture"); !ok) return ok;
        s.restore_momentum();
    }
    {
        Stopwatch watch(io_report.contact_s);
        s.settle_contacts();
    }
    if (pushed) {
        Stopwatch watch(io_report.fracture_s);
        s.flow_and_measure(h);
        s.break_edges(0);
    }
    if (Status ok = s.check_finite("contacts"); !ok) return ok;
    s.store();
    io_report.n_components = io_work.live.n_pieces();
    return {};
}

}  // namespace sunder
