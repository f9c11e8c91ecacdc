#include "solver/step/pins.h"

#include <algorithm>

#include "solver/data/math_functions.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

// Of a pin that begins to let go: its spring's frequency times the step.
constexpr double kTightest = 1e3;

// A pin that lets go draws its particles to where it would hold them, by a spring for each: of (w h)^2 times its mass
// beside what inertia has in an implicit step, w falling evenly in its logarithm from far beyond all that the step
// resolves to one over the time that it takes.
void tie(const StepContext& context, const StepTime& time, size_t pin, Movables& movables) {
    const double h = time.h;
    const DrivenPose& drive = context.input.pins[pin];
    const Grip& grip = drive.grip;
    const double share = grip.begin + time.end * (grip.end - grip.begin);
    const double w = math::exp(share * math::log(kTightest * std::max(1.0, grip.time / h))) / std::max(grip.time, h);
    Tethers& tethers = movables.tethers;
    tethers.stiffness.resize(context.n_particles(), 0.0), tethers.pose.resize(context.n_particles());
    for (const ParticleId i : context.scene.pins[pin].particles) {
        tethers.stiffness[i] = w * h * (w * h);
        tethers.pose[i] = pin_pose(context.scene, context.input, pin, i, time.end);
    }
}

}  // namespace

void hold_pins(const StepContext& context, const StepTime& time, Pinned when, const StepPair& pair,
               Movables& movables) {
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        const DrivenPose& drive = context.input.pins[k];
        const bool turns = context.scene.pins[k].turns_freely && context.settings.method == Method::projective;
        const bool moves_each = context.input.pin_source(k) != nullptr;
        if (!drive.active) continue;
        if (!drive.grip.is_rigid()) {
            if (when == Pinned::at_the_end) tie(context, time, k, movables);
            continue;
        }
        Pose pose;
        double reached = -1;  // of the step
        for (const ParticleId i : context.scene.pins[k].particles) {
            if (when != Pinned::at_the_end && !pair.smooth[i]) continue;
            const double wanted = when == Pinned::in_the_first_stage ? 2 * pair.gamma_of(context.scene.rest, i) : 1;
            if (reached != wanted || moves_each) {
                reached = wanted;
                pose = pin_pose(context.scene, context.input, k, i,
                                reached == 1 ? time.end : time.begin + reached * (time.end - time.begin));
            }
            MovingParticle& p = movables.moving[i];
            p.x = p.x_inertial = pose.apply(context.scene.rest.rest_position[i]);
            const double seconds = reached * time.h;
            movables.velocity[i] = (p.x - movables.start_position[i]) / seconds;
            movables.inverse_mass[i] = 0;
            if (turns) {
                if (movables.role[i] == Role::free) movables.role[i] = Role::hinged;
                continue;
            }
            movables.role[i] = Role::held;
            p.d = p.d_inertial = pose.orientation;
            movables.angular_velocity[i] = rotation_vector(p.d * movables.start_rotation[i].conjugate()) / seconds;
        }
    }
}

}  // namespace sunder
