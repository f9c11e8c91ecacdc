// Steps in pairs: second order for what touches nothing.
//
// Two steps of h are a step of H = 2 h by an L-stable diagonally implicit Runge-Kutta method of two stages, for all
// that touches nothing in either:
//   x1, v1 = implicit Euler over gamma H from x, v
//   x2, v2 = implicit Euler over gamma H from x1 + (1 - 2 gamma) H v1, v + (1 - gamma) / gamma (v1 - v).
// It multiplies a mode exp(z t) by (1 + (1 - 2 gamma) z H) / (1 - gamma z H)^2 = exp(z H + c z^2 H^2 + ...),
// c = 1/2 - (1 - gamma)^2: for gamma = 1 - 1/sqrt(2) of second order (SDIRK2; Alexander 1977), for gamma = 1/2 two
// steps of implicit Euler, and between them what Kelvin and Voigt's damping of relaxation time 2 c H does. So a
// material's own damping comes with the step, at no cost, while its time is at most h; beyond, `damp_vibrations` gives
// what is missing. Between the stages lies the middle of the pair, where contacts look for what comes near: there
// things go on as v1 and the first stage's acceleration take them. What touches something takes an implicit Euler step
// over h in each step of the pair, from wherever it is.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/live_model.h"
#include "solver/pieces/pieces.h"
#include "solver/scene/step_context.h"
#include "solver/step/matching.h"

namespace sunder {

/// How far a mode exp(i w t) of a piece that touches nothing gets out of phase in pairs of steps of h seconds, over
/// (w h)^2, -.
double phase_error(double damping_time, double h);

/// What the second step of a pair needs of the first, of those that are `smooth`: that touched nothing (n_movables).
struct StepPair {
    std::vector<uint8_t> smooth;
    std::vector<Vec3> begin_velocity, begin_spin;  // at the start of the pair
    std::vector<Vec3> position, velocity, spin;    // after the first implicit step
    std::vector<Quat> rotation;
    std::vector<double> gamma;  // of this step's pairs, by the material of a body (n_bodies)

    double gamma_of(const SimulationMesh& rest, MovableIndex movable) const;
    /// The same in a scene that was numbered anew; `former` (n_movables): the number in the scene before, or kNone.
    StepPair renumbered(std::span<const MovableId> former, const WorkerPool& workers) const;
};

bool is_paired(const StepContext& context, Stage stage);

/// Of a pair: those that touch something, those whose waves are not resolved, those that turn about what holds them or
/// are let go, and what is fixed, for it may be woken between the two (n_pieces + n_rigid_bodies).
std::vector<uint8_t> pieces_left_out(const StepContext& context, const StepTime& time, const LiveModel& model,
                                     std::span<const ActiveContact> contacts, const Movables& movables);

/// Where implicit steps start from, and how long they take; and the inertial path of what is in a pair.
void pair_up(const StepContext& context, const StepTime& time, const LiveModel& model, std::span<const uint8_t> kept,
             const FrameState& state, Pieces& io_pieces, StepPair& io_pair, Movables& io_movables);

/// Free pieces in a pair keep the angular momentum of its start.
void take_up_smooth_momentum(const StepContext& context, const StepTime& time, const LiveModel& model,
                             const Movables& movables, const StepPair& pair, Pieces& io_pieces);

/// Of a first stage, before `go_on_to_the_middle`: pinned things to the middle of the pair.
void begin_middle(const StepContext& context, const StepTime& time, StepPair& io_pair, Movables& io_movables);
/// Of a first stage: keeps what one thing came to for the second, and leaves it, if smooth, in the middle of the pair.
void go_on_to_the_middle(const StepContext& context, double h, const Pieces& pieces, size_t movable, StepPair& io_pair,
                         Movables& io_movables);

/// What a material's damping takes of its vibrations, as far as the step itself takes less: velocities of an implicit
/// step of that damping alone. Rigid motions of a piece, held or not, are none. `io_goals`: rotations to start from.
void damp_vibrations(const StepContext& context, const StepTime& time, const FrameState& state, const Pieces& pieces,
                     const StepPair& pair, LiveModel& io_model, Matching& io_matching, Movables& io_movables);

}  // namespace sunder
