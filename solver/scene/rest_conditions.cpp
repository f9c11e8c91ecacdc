#include "solver/scene/rest_conditions.h"

#include "solver/data/frame_state.h"
#include "solver/data/invariant.h"
#include "solver/scene/local_force.h"
#include "solver/scene/scene_fields.h"

namespace sunder {
namespace {

uint64_t hash_of_drive(const DrivenPose& d, FrameEnd end) {
    if (const SurfaceDrive& s = d.surface; s.surface) {
        const uint64_t key =
            (end == FrameEnd::begin ? s.begin : s.end) == 0 ? s.surface->begin_key : s.surface->end_key;
        const double numbers[] = {double(d.active), double(key >> 32), double(key & 0xffffffffu)};
        return hash_of(numbers);
    }
    const Pose& at = end == FrameEnd::begin ? d.begin : d.end;
    const double numbers[] = {double(d.active),   at.position.x(),    at.position.y(),    at.position.z(),
                              at.orientation.w(), at.orientation.x(), at.orientation.y(), at.orientation.z(),
                              d.pivot.x(),        d.pivot.y(),        d.pivot.z()};
    return hash_of(numbers);
}

uint64_t hash_of_sleepers(const FrameState& s) {
    uint64_t hash = 0;
    const auto add = [&](const Vec3& x, const Quat& q, const Vec3& v, const Vec3& w) {
        const double numbers[] = {x.x(),
                                  x.y(),
                                  x.z(),
                                  q.w(),
                                  q.x(),
                                  q.y(),
                                  q.z(),
                                  v.x(),
                                  v.y(),
                                  v.z(),
                                  w.x(),
                                  w.y(),
                                  w.z(),
                                  double(hash >> 32),
                                  double(hash & 0xffffffffu)};
        hash = hash_of(numbers);
    };
    SUNDER_ASSERT(s.asleep.size() == s.n_particles() + s.rigid_bodies.size());
    const size_t n = s.n_particles();
    for (size_t i = 0; i < n; ++i)
        if (s.asleep[i]) add(s.position[i], s.orientation[i], s.velocity[i], s.angular_velocity[i]);
    for (size_t r = 0; r < s.rigid_bodies.size(); ++r) {
        const RigidBodyState& b = s.rigid_bodies[r];
        if (s.asleep[n + r]) add(b.position, b.orientation, b.velocity, b.angular_velocity);
    }
    return hash;
}

}  // namespace

std::vector<uint64_t> rest_conditions(const FrameInput& input, bool self_collision, FrameEnd at,
                                      const FrameState& state) {
    std::vector<uint64_t> hashes = {hash_of_sleepers(state)};
    std::vector<double> field = {double(self_collision), input.gravity.x(), input.gravity.y(), input.gravity.z()};
    for (const Force& f : input.forces) {
        for (int i = 0; i < 3; ++i) field.insert(field.end(), {f.acceleration[i], f.wind[i], f.drag});
        if (f.local) field.insert(field.end(), {double(f.local->key >> 32), double(f.local->key & 0xffffffffu)});
    }
    hashes.push_back(hash_of(field));
    for (const Material& m : input.materials) hashes.push_back(hash_of(numbers_of(material_fields(), m)));
    for (const std::vector<DrivenPose>* driven : {&input.pins, &input.colliders})
        for (const DrivenPose& d : *driven) hashes.push_back(hash_of_drive(d, at));
    return hashes;
}

}  // namespace sunder
