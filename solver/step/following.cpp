#include "solver/step/following.h"

#include <Eigen/Eigenvalues>

#include "solver/data/invariant.h"
#include "solver/scene/motion.h"
#include "solver/step/letting_go.h"

namespace sunder {
namespace {

// Of a frame, over which the speed of the way on is taken: as long as a step, over which that of the way there was.
constexpr double kAhead = 0.125;
// Of a ring's largest moment: along what its neighbours reach less far they tell no curvature.
constexpr double kSpannedShare = 0.02;

SourceWay way_of(const FrameInput::SourceDrive& drive, double share) {
    return {*drive.begin, *drive.end, drive.pivot, share};
}

// What is held, where its source has it, by the seconds that it took from the start of the step.
void place(const Pose& pose, const Vec3& rest_position, double seconds, ParticleId i, Movables& movables) {
    MovingParticle& p = movables.moving[i];
    p.x = p.x_inertial = pose.apply(rest_position);
    p.d = p.d_inertial = pose.orientation;
    movables.velocity[i] = (p.x - movables.start_position[i]) / seconds;
    movables.angular_velocity[i] = rotation_vector(p.d * movables.start_rotation[i].conjugate()) / seconds;
    movables.inverse_mass[i] = 0;
    movables.role[i] = Role::held;
}

}  // namespace

bool follows(const FrameState& state, ParticleIndex particle) {
    return !state.inactive.empty() && state.inactive[particle].follows();
}

void take_up_followers(const StepContext& context, const StepTime& time, const FrameState& state, Movables& movables) {
    movables.follows.clear();
    if (context.scene.sources.empty()) return;
    movables.follows.resize(movables.size(), 0);
    for (const Source& source : context.scene.sources)
        for (const ParticleId i : source.particles) {
            movables.follows[i] = follows(state, i) && movables.role[i] == Role::free;
            if (movables.follows[i] && movables.tethers.hold(i)) movables.tethers.stiffness[i] = 0;
        }
    hold_followers(context, time, Pinned::at_the_end, {}, movables);
}

void hold_followers(const StepContext& context, const StepTime& time, Pinned when, const StepPair& pair,
                    Movables& movables) {
    if (movables.follows.empty()) return;
    const SimulationMesh& rest = context.scene.rest;
    for (size_t k = 0; k < context.scene.sources.size(); ++k)
        for (const ParticleId i : context.scene.sources[k].particles) {
            if (!movables.follows[i] || (when != Pinned::at_the_end && !pair.smooth[i])) continue;
            const double reached = when == Pinned::in_the_first_stage ? 2 * pair.gamma_of(rest, i) : 1;  // of the step
            const double share = reached == 1 ? time.end : time.begin + reached * (time.end - time.begin);
            const Pose pose = way_of(context.input.sources[k], share).pose(rest.fragment[i], rest.rest_position[i]);
            place(pose, rest.rest_position[i], reached * time.h, i, movables);
        }
}

bool hand_over(const Scene& scene, const FrameInput& input, LetGo when, FrameState& state) {
    bool any = false;
    for (size_t k = 0; k < scene.sources.size(); ++k) {
        const FrameInput::SourceDrive& drive = input.sources[k];
        const SourceWay way = way_of(drive, kAhead);
        for (const ParticleId i : scene.sources[k].particles) {
            Inactivity& own = state.inactive[i];
            if (is_kept(state, i) || own.followed != HUGE_VAL) continue;
            own.followed = state.time;
            any = true;
            if (when == LetGo::in_step || !drive.goes_on) continue;
            const Pose next = way.pose(scene.rest.fragment[i], scene.rest.rest_position[i]);
            const Quat turn = (state.orientation[i] * scene.rest.rest_orientation[i].conjugate()).normalized();
            const Vec3 velocity =
                (next.apply(scene.rest.rest_position[i]) - state.position[i]) / (kAhead * input.duration);
            const Vec3 spin = rotation_vector(next.orientation * turn.conjugate()) / (kAhead * input.duration);
            const double half = state.time > 0 ? 0.5 : 1;
            state.velocity[i] += half * (velocity - state.velocity[i]);
            state.angular_velocity[i] += half * (spin - state.angular_velocity[i]);
        }
    }
    return any;
}

void set_followers(const Scene& scene, const FrameInput& input, FrameState& state) {
    for (size_t k = 0; k < scene.sources.size(); ++k) {
        const std::vector<Mat3>& set = input.sources[k].end->set;
        if (set.empty()) continue;
        std::vector<ParticleId> followers;
        for (const ParticleId i : scene.sources[k].particles) {
            if (!follows(state, i)) continue;
            state.plastic_deformation[i] = set[scene.rest.fragment[i]];
            followers.push_back(i);
        }
        bend_for_good(scene.rest, followers, state);
    }
}

void bend_for_good(const SimulationMesh& rest, std::span<const ParticleId> particles, FrameState& io_state) {
    if (io_state.plastic_curvature.empty()) return;
    const auto turned = [&](ParticleId i) -> Quat {
        return io_state.orientation[i] * rest.rest_orientation[i].conjugate();
    };
    for (const ParticleId g : particles) {
        const Mat3 to_axes = rest.rest_orientation[g].conjugate().toRotationMatrix();
        Mat3 A = Mat3::Zero(), bent = Mat3::Zero();
        for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s) {
            const ParticleId j = rest.group_member[s];
            if (j == g || !io_state.edge_intact[rest.member_edge[s]]) continue;
            const Vec3 arm =
                to_axes * (io_state.plastic_deformation[g] * (rest.rest_position[j] - rest.rest_position[g]));
            A += rest.mass[j] * arm * arm.transpose();
            bent += rest.mass[j] * (to_axes * rotation_vector(turned(g).conjugate() * turned(j))) * arm.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Mat3> of(A);
        Mat3 K = Mat3::Zero();
        for (int i = 0; i < 3; ++i)
            if (of.eigenvalues()[i] > kSpannedShare * of.eigenvalues()[2])
                K += bent * of.eigenvectors().col(i) * of.eigenvectors().col(i).transpose() / of.eigenvalues()[i];
        io_state.plastic_curvature[g] = K;
        io_state.layer_strain[g] = {};
    }
}

}  // namespace sunder
