// The parts of a substep, as step.cpp puts them in order.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>

#include "solver/matching/unit_schedule.h"
#include "solver/material/plasticity.h"
#include "solver/scene/scales.h"
#include "solver/step.h"
#include "solver/threads/first_of.h"

namespace sunder {

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
    double resting_speed() const { return sunder::resting_speed(h, acceleration_of(context.input)); }
    const Material& material(ParticleIndex particle) const { return context.input.materials[rest().body[particle]]; }
    PieceId piece_of(MovableIndex movable) const {
        return movable < n_particles() ? work.live.piece(size_t{movable})
                                       : PieceId(work.live.n_pieces() + (movable - n_particles()));
    }
    /// Calls body(i) for i in [0, n), in parts on all threads.
    template <class Body>
    void for_all(size_t n, const Body& body) const {
        context.workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i) body(i);
        });
    }
    /// Calls body(first, last) for groups [0, n_particles()) in parts. What a group costs differs by far where some
    /// flow: who is done takes over parts that others have not begun.
    template <class Body>
    void for_groups(const Body& body) const {
        constexpr size_t kPart = 64;
        const size_t n = n_particles();
        if (context.workers.threads() == 1 || n < 2 * kGroupGrain) {
            if (n > 0) body(0, n);
            return;
        }
        context.workers.for_each((n + kPart - 1) / kPart,
                                 [&](size_t part) { body(part * kPart, std::min(n, (part + 1) * kPart)); });
    }
    /// Calls body(i) for the particles of a piece of `work.pieces`, or for its rigid body.
    template <class Body>
    void for_movables(PieceId piece, const Body& body) const {
        if (piece < work.live.n_pieces())
            std::ranges::for_each(work.live.piece_particles(piece), body);
        else
            body(MovableId(n_particles() + piece - work.live.n_pieces()));
    }
    /// Calls body(some of the contacts), in parts on all threads.
    template <class Body>
    void for_contacts(const Body& body) const {
        constexpr size_t kGrain = 256;  // fewest a thread is worth waking for
        context.workers.for_range(work.contacts.size(), kGrain, [&](size_t first, size_t last) {
            body(std::span(work.contacts).subspan(first, last - first));
        });
    }
    template <class Body>
    void for_pieces(const Body& body) const {
        sunder::for_pieces(work.live, kParticleGrain, context.workers, body);
    }

    // substep_motion.cpp
    void load();
    void hold();
    void hold_pins(Pinned when);
    void tie(size_t pin);
    bool is_tied(size_t particle) const { return !work.tether.empty() && work.tether[particle] > 0; }
    void fix_sleepers();
    void predict();
    Status take_up_motion();
    void restore_momentum();
    bool has_momentum(size_t piece, const Vec3& angular) const;
    Status store();

    // substep_pairs.cpp
    void pair_up();
    double gamma_of(size_t movable) const;  // of what is in a pair
    bool is_paired() const;
    std::vector<uint8_t> pieces_left_out() const;
    void begin_stage(const FieldsOfForce& fields, size_t movable);
    void take_up_smooth_momentum();
    void begin_middle();
    void go_on_to_the_middle(size_t movable);
    void damp_vibrations();

    // substep_contacts.cpp
    void mark_held_pieces();
    void take_up_pieces();
    void find_contacts();
    void push_apart(ContactRound::Which which, int sweep = 0);  // that follows one between two
    bool contacts_push() const;
    void settle_contacts();

    // substep_fracture.cpp
    struct Found {
        bool changed = false, overloaded = false;  // a rest shape flowed; a group is to break
    };
    Found flow_and_measure(double seconds);
    double breaking_strain(ParticleIndex group) const;
    double strain_limit(ParticleIndex group) const;
    struct GivingWay {  // of four groups those that flow or break
        size_t n = 0;
        std::array<ParticleId, 4> index;
        std::array<FlowingGroup, 4> group;
    };
    Found flow_bent(ParticleIndex group, double seconds);
    bool add_if_it_gives_way(ParticleIndex group, const PrincipalStretch& principal, GivingWay& io_groups) const;
    Found give_way(GivingWay& io_groups, double seconds, const StretchKernels& kernels);
    bool break_edges(Found found, double leading);
    bool run_cracks(bool has_flowed);  // whether material flowed, as it does once a substep

    // substep_hits.cpp
    bool break_in_hit(double seconds);  // whether the substep is to be taken again
    void keep_what_is_whole(size_t first_broken);
    void take_over_pieces();
    void take_over_contacts();
    bool let_go_of_mixed_islands();
    bool find_hits();  // whether the substep is to be taken in parts
    void take_in_parts(std::vector<int>& io_parts);
    void join_what_is_near_a_hit(std::vector<int>& io_parts);

    // step.cpp
    void correct();
    const BendingShapes* bending() const { return work.thin.empty() ? nullptr : &work.bending; }
    void match_shapes(int sweep);  // of those of `correct`
    void leave_out_what_is_matched(int steps);
    int newton_steps(IslandId island) const {
        return std::max(context.settings.iterations, work.loads.newton_steps[island]);
    }
    void find_what_starts_unloaded();
    bool starts_unloaded(size_t particle) const;
    Vec3 fall_of(size_t particle) const;  // what gravity, wind and drag add to its way
    bool is_sound(size_t movable) const;
    Status check(const FirstOf& unsound, const char* stage) const;
};

}  // namespace sunder
