#include "solver/frame/scene_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "solver/collision/contact.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/scene_fields.h"
#include "solver/threads/first_of.h"

namespace sunder {
namespace {

constexpr double kLongestFrame = 1000;  // s

std::string number(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", v);
    return text;
}

// Of the first of n particles that is not sound.
template <class IsSound>
Status all_sound(size_t n, const char* array, const char* fault, const WorkerPool& workers, const IsSound& is_sound) {
    FirstOf unsound;
    workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (!is_sound(i)) return unsound.add(i);
    });
    if (unsound.get() >= n) return {};
    return bad_input("state", std::string(array) + " of particle " + std::to_string(unsound.get()) + fault);
}

Status all_finite(const char* array, const std::vector<Vec3>& values, const WorkerPool& workers) {
    return all_sound(values.size(), array, " is not finite", workers,
                     [&](size_t i) { return std::isfinite(values[i].sum()) || values[i].allFinite(); });
}

Status all_unit(const char* array, const std::vector<Quat>& values, const WorkerPool& workers) {
    return all_sound(values.size(), array, " is not a unit quaternion", workers,
                     [&](size_t i) { return std::abs(values[i].norm() - 1) < 1e-3; });
}

// Whether a source tells where all of its fragments are, in numbers.
Status check_drive(const Scene& scene, const std::string& where, std::span<const ParticleId> particles,
                   const FrameInput::SourceDrive& drive) {
    if (!drive.begin || !drive.end) return bad_input(where, "does not tell where it is");
    size_t n = 0;  // fragments of which it has to tell
    for (const ParticleId i : particles) n = std::max(n, size_t{scene.rest.fragment[i]} + 1);
    const auto is_finite = [](const Pose& p) {
        return p.position.allFinite() && p.orientation.coeffs().allFinite() && p.orientation.norm() > 0;
    };
    for (const SourcePose* at : {drive.begin.get(), drive.end.get()}) {
        if (at->own.size() != drive.begin->own.size() || (!at->own.empty() && at->own.size() < n) ||
            at->set.size() != drive.begin->set.size() || (!at->set.empty() && at->set.size() < n))
            return bad_input(where, "does not tell of all of its fragments");
        if (!is_finite(at->whole) || !std::ranges::all_of(at->own, is_finite) ||
            !std::ranges::all_of(at->set, [](const Mat3& F) { return F.allFinite(); }))
            return bad_input(where, "is not finite");
    }
    return {};
}

Status check_source(const Scene& scene, const Source& source, const FrameInput::SourceDrive& drive) {
    const std::string where = "source '" + source.name + "'";
    if (Status ok = check_drive(scene, where, source.particles, drive); !ok) return ok;
    return check_drive(scene, where, source.particles, {source.start, source.start, Vec3::Zero(), false});
}

// Whether a collider that deforms, and no other, is told where its surface is.
Status check_surface(const Collider& collider, const SurfaceDrive& drive) {
    const SurfaceTree* told = drive.surface ? drive.surface->tree.get() : nullptr;
    if (collider.tree.get() != told)
        return bad_input("collider '" + collider.name + "'",
                         told ? "does not deform as the surface that moves it" : "does not tell where its surface is");
    if (!told) return {};
    const auto are_finite = [](const std::vector<Vec3>& points) {
        return std::ranges::all_of(points, [](const Vec3& p) { return p.allFinite(); });
    };
    if (!are_finite(drive.surface->begin) || !are_finite(drive.surface->way))
        return bad_input("collider '" + collider.name + "'", "has a vertex that is not finite");
    return {};
}

}  // namespace

Status check_scene(const Scene& scene) {
    const SimulationMesh& rest = scene.rest;
    const size_t n = rest.n_particles();
    if (n == 0 && scene.rigid_bodies.empty())
        return bad_input("scene", "nothing to simulate", "add a body or a rigid body");
    for (size_t i = 0; i < n; ++i) {
        const bool sound = rest.rest_position[i].allFinite() && rest.mass[i] > 0 && std::isfinite(rest.mass[i]) &&
                           rest.volume[i] > 0 && rest.radii[i].minCoeff() > 0 && rest.radii[i].allFinite() &&
                           std::abs(rest.rest_orientation[i].norm() - 1) < 1e-6;
        if (!sound)
            return bad_input(
                "scene",
                "particle " + std::to_string(i) +
                    " has a rest position, mass, volume, radius or orientation that is not finite and positive");
        if (rest.body[i] >= scene.bodies.size())
            return bad_input("scene", "particle " + std::to_string(i) + " belongs to body " +
                                          std::to_string(rest.body[i]) + " of " + std::to_string(scene.bodies.size()));
        if (rest.material_of(i) >= scene.bodies.size() + scene.region_bodies.size())
            return bad_input("scene", "particle " + std::to_string(i) + " is of a material that is not there");
    }
    for (const std::vector<double>* factors : {&rest.yield_factor, &rest.toughness_factor}) {
        const bool sound = std::all_of(factors->begin(), factors->end(), [](double f) { return f > 0; });
        if (!sound || (!factors->empty() && factors->size() != n))
            return bad_input("scene", "yield or toughness factors are not one above 0 for each particle");
    }
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (!(rest.edges[e].toughness_factor > 0))
            return bad_input("scene", "edge " + std::to_string(e) + " has a toughness factor that is not above 0");
    for (const Pin& pin : scene.pins)
        for (const ParticleId i : pin.particles)
            if (i >= n)
                return bad_input("pin '" + pin.name + "'",
                                 "holds particle " + std::to_string(i) + " of " + std::to_string(n));
    for (const Activation& a : scene.activations)
        if (!a.particles.empty() && a.particles.back() >= n)
            return bad_input("activation '" + a.name + "'", "names a particle that is not there");
    for (const Source& s : scene.sources)
        if (!s.particles.empty() && (s.particles.back() >= n || !s.start))
            return bad_input("source '" + s.name + "'", "moves a particle that is not there, or has no start");
    for (const Seam& s : scene.seams)
        if (!s.edges.empty() && s.edges.back() >= rest.n_edges())
            return bad_input("seam '" + s.name + "'", "names an edge that is not there");
    for (const Collider& collider : scene.colliders) {
        const std::string where = "collider '" + collider.name + "'";
        const SignedDistanceGrid* grid = collider.shape.grid;
        if (collider.shape.kind != ShapeKind::mesh || collider.tree) continue;
        if (!grid || grid != collider.grid.get())
            return bad_input(where, "is a mesh without a distance grid of its own");
        const size_t n_nodes = size_t(grid->nodes[0]) * grid->nodes[1] * grid->nodes[2];
        if (std::ranges::min(grid->nodes) < 2 || grid->distance.size() != n_nodes || !(grid->voxel_size > 0))
            return bad_input(where, "has a distance grid of fewer values than nodes, or none");
    }
    for (const RigidBody& body : scene.rigid_bodies) {
        const std::string where = "rigid body '" + body.name + "'";
        if (body.shape.kind != ShapeKind::sphere && body.shape.kind != ShapeKind::box)
            return bad_input(where, "is neither a sphere nor a box");
        if (!(body.mass > 0 && std::isfinite(body.mass)))
            return bad_input(where, "mass is " + number(body.mass), "give a mass above 0 kg");
        if (!(body.shape.radius > 0 && body.shape.half_extents.minCoeff() > 0))
            return bad_input(where, "size is not positive");
    }
    return {};
}

Status check_input(const Scene& scene, const FrameInput& input) {
    if (!(input.duration > 0 && input.duration <= kLongestFrame))
        return bad_input("frame", "duration is " + number(input.duration) + " s",
                         "permitted: above 0, at most " + number(kLongestFrame));
    if (!input.gravity.allFinite()) return bad_input("frame", "gravity is not finite");
    const size_t n_bodies = scene.bodies.size(), n_materials = n_bodies + scene.region_bodies.size();
    if (input.materials.size() != n_materials || input.pins.size() != scene.pins.size() ||
        input.colliders.size() != scene.colliders.size() || input.activations.size() != scene.activations.size() ||
        input.seams.size() != scene.seams.size() || input.sources.size() != scene.sources.size() ||
        (!input.pin_sources.empty() && input.pin_sources.size() != scene.pins.size()) ||
        (!input.yield_changes.empty() && input.yield_changes.size() != n_materials))
        return Error{
            ErrorCode::internal,
            "frame input does not match the scene's bodies, regions, pins, colliders, activations, seams and sources",
            {},
            {},
            {},
            {}};
    if (!std::ranges::all_of(input.seams, [](double factor) { return factor >= 0; }))
        return bad_input("frame", "a seam's factor is not one", "permitted: 0 and more");
    for (size_t k = 0; k < scene.sources.size(); ++k)
        if (Status ok = check_source(scene, scene.sources[k], input.sources[k]); !ok) return ok;
    if (!std::ranges::all_of(input.yield_changes, [](double change) { return change > 0 && std::isfinite(change); }))
        return bad_input("frame", "a change of yields is not one", "permitted: above 0");
    for (size_t m = 0; m < n_materials; ++m) {
        const std::string& name = scene.bodies[m < n_bodies ? m : scene.region_bodies[m - n_bodies]].name;
        if (Status ok = input.materials[m].check((m < n_bodies ? "body '" : "a region of body '") + name + "'"); !ok)
            return ok;
    }
    for (const std::vector<DrivenPose>* driven : {&input.pins, &input.colliders})
        for (const DrivenPose& d : *driven)
            if (!(d.begin.position.allFinite() && d.end.position.allFinite() &&
                  d.begin.orientation.coeffs().allFinite() && d.end.orientation.coeffs().allFinite()))
                return bad_input("frame", "a pin's or collider's pose is not finite");
    for (size_t k = 0; k < scene.pins.size(); ++k)
        if (const FrameInput::SourceDrive* source = input.pin_source(k))
            if (Status ok = check_drive(scene, "pin '" + scene.pins[k].name + "'", scene.pins[k].particles, *source);
                !ok)
                return ok;
    for (size_t c = 0; c < scene.colliders.size(); ++c)
        if (Status ok = check_surface(scene.colliders[c], input.colliders[c].surface); !ok) return ok;
    for (const DrivenPose& d : input.pins)
        if (!(std::min(d.grip.begin, d.grip.end) >= 0 && std::max(d.grip.begin, d.grip.end) <= 1 && d.grip.time >= 0))
            return bad_input("frame", "a pin's grip is not one", "permitted: 0 to 1, over 0 s or more");
    return {};
}

Status check_state(const Scene& scene, const FrameState& s, const WorkerPool& workers) {
    const size_t n = scene.rest.n_particles();
    if (s.position.size() != n || s.orientation.size() != n || s.velocity.size() != n ||
        s.angular_velocity.size() != n || s.plastic_deformation.size() != n || s.yield.size() != n ||
        s.strain.size() != n || s.group_rotation.size() != n)
        return bad_input("state",
                         "holds " + std::to_string(s.position.size()) + " particles, the scene " + std::to_string(n));
    if (s.edge_intact.size() != scene.rest.n_edges())
        return bad_input("state", "holds " + std::to_string(s.edge_intact.size()) + " edges, the scene " +
                                      std::to_string(scene.rest.n_edges()));
    if (s.rigid_bodies.size() != scene.rigid_bodies.size())
        return bad_input("state", "holds " + std::to_string(s.rigid_bodies.size()) + " rigid bodies, the scene " +
                                      std::to_string(scene.rigid_bodies.size()));
    const size_t n_movables = n + s.rigid_bodies.size();
    if (s.asleep.size() != s.still_time.size() || s.asleep.size() != s.rest_load.size() ||
        (!s.asleep.empty() && s.asleep.size() != n_movables))
        return bad_input("state", "says of " + std::to_string(s.asleep.size()) +
                                      " particles and rigid bodies whether "
                                      "they sleep, the scene has " +
                                      std::to_string(n_movables));
    for (const ContactMemory& c : s.contacts)
        if (c.a >= n_movables ||
            (c.b & Contact::kStatic ? (c.b & ~Contact::kStatic) >= scene.colliders.size() : c.b >= n_movables))
            return bad_input("state", "has a contact of what is not in the scene");
    if (s.plastic_curvature.size() != s.layer_strain.size() ||
        (!s.plastic_curvature.empty() && s.plastic_curvature.size() != n))
        return bad_input("state", "has plastic curvatures of " + std::to_string(s.plastic_curvature.size()) +
                                      " particles, the scene has " + std::to_string(n));
    if (!s.yielding_rate.empty() && s.yielding_rate.size() != n)
        return bad_input("state", "tells how fast " + std::to_string(s.yielding_rate.size()) +
                                      " particles yield, the scene has " + std::to_string(n));
    if (!s.edge_offset.empty() && s.edge_offset.size() != s.edge_intact.size())
        return bad_input("state", "has offsets of the ends of " + std::to_string(s.edge_offset.size()) +
                                      " edges, the scene has " + std::to_string(s.edge_intact.size()));
    if (s.edge_damage.size() != s.edge_hold.size() ||
        (!s.edge_damage.empty() && s.edge_damage.size() != s.edge_intact.size()) ||
        s.stiffness_factor.size() != (s.edge_damage.empty() ? 0 : n))
        return bad_input("state", "has damage of " + std::to_string(s.edge_damage.size()) + " edges and stiffness of " +
                                      std::to_string(s.stiffness_factor.size()) + " groups, the scene has " +
                                      std::to_string(s.edge_intact.size()) + " and " + std::to_string(n));
    if (!s.inactive.empty() && s.inactive.size() != n)
        return bad_input("state", "says of " + std::to_string(s.inactive.size()) +
                                      " particles what keeps them, the scene has " + std::to_string(n));
    const auto is_share = [](double d) { return d >= 0 && d <= 1; };
    if (!std::ranges::all_of(s.edge_damage, is_share) || !std::ranges::all_of(s.edge_hold, is_share) ||
        !std::ranges::all_of(s.stiffness_factor, [](double k) { return k > 0 && std::isfinite(k); }))
        return bad_input("state", "has damage of an edge or stiffness of a group that is not possible");
    if (Status ok = all_finite("position", s.position, workers); !ok) return ok;
    if (Status ok = all_finite("velocity", s.velocity, workers); !ok) return ok;
    if (Status ok = all_finite("angular velocity", s.angular_velocity, workers); !ok) return ok;
    if (Status ok = all_unit("orientation", s.orientation, workers); !ok) return ok;
    if (Status ok = all_unit("group rotation", s.group_rotation, workers); !ok) return ok;
    return all_sound(n, "plastic deformation or yield", " is not possible", workers, [&](size_t i) {
        return s.plastic_deformation[i].allFinite() && s.plastic_deformation[i].determinant() > 0.5 && s.yield[i] > 0;
    });
}

Status Material::check(const std::string& where) const { return check_fields(material_fields(), *this, where); }

Status SolverSettings::check(const std::string& where) const { return check_fields(settings_fields(), *this, where); }

}  // namespace sunder
