// The parts of a substep, as step.cpp puts them in order.
#pragma once

#include <chrono>

#include "solver/step.h"

namespace sunder {

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

/// What gravity, wind and drag make of a velocity.
struct FieldsOfForce {
    explicit FieldsOfForce(const FrameInput& input);
    Vec3 after(double seconds, const Vec3& velocity) const {
        return (velocity + seconds * acceleration) / (1 + seconds * drag);  // implicit drag
    }
    Vec3 acceleration;
    double drag = 0;  // 1/s
};

/// When in a substep pinned particles are taken to their pins: all, or those that are in a pair.
enum class Pinned { at_the_end, in_the_first_stage, in_the_middle };

/// Names for the arrays of one substep, and its parts in the order of `substep`.
struct Substep {
    const StepContext& context;
    const Stage stage;
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

    // substep_motion.cpp
    void load();
    void predict();
    void hold_pins(Pinned when);
    void fix_sleepers();
    void update_velocities();
    void take_up_inertia();
    void restore_momentum();
    void store();

    // substep_pairs.cpp
    void pair_up();
    void leave_out_what_touches();
    void begin_stage(size_t movable);
    void take_up_smooth_momentum();
    void go_on_to_the_middle();
    void damp_vibrations();

    // substep_contacts.cpp
    void mark_held_pieces();
    void take_up_pieces();
    void find_contacts();
    void wake_touched();
    void push_apart(ContactRound::Which which);
    bool contacts_push() const;
    void settle_contacts();

    // substep_fracture.cpp
    void flow_and_measure(double seconds);
    bool break_edges(double leading);
    void run_cracks();

    // step.cpp
    void correct(int iterations);
    void match_shapes(bool first_iteration);
    Status check_finite(const char* stage) const;
};

}  // namespace sunder
