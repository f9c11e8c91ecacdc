#include "nodes/types/solver_scene.h"

#include <algorithm>
#include <iterator>

#include "nodes/graph/field_parameters.h"
#include "solver/presets.h"
#include "solver/scene/local_force.h"
#include "solver/scene/rest_conditions.h"
#include "solver/scene/scene_fields.h"

namespace sunder {
namespace {

void add(KeyHasher& io_hasher, const Shape& s) {
    io_hasher.add(static_cast<int>(s.kind)).add(s.radius).add(s.half_extents).add(s.half_height);
    if (s.grid) io_hasher.add(s.grid->key);
}

// Where it begins and ends.
void add_way(KeyHasher& io_hasher, const DrivenPose& p) {
    io_hasher.add(p.begin).add(p.end);
    if (const MovingSurface* s = p.surface.surface.get()) io_hasher.add(s->begin_key).add(s->end_key);
}

void add(KeyHasher& io_hasher, const std::vector<DrivenPose>& poses) {
    io_hasher.add(poses.size());
    for (const DrivenPose& p : poses) {
        add_way(io_hasher, p);
        io_hasher.add(p.active).add(p.pivot);
        if (!p.grip.is_rigid()) io_hasher.add(p.grip.begin).add(p.grip.end).add(p.grip.time);
    }
}

// Of a motion that a node gives, as an error of that node.
Error in_source(const std::string& node, Error error) {
    error.node = node;
    error.where = "node '" + node + "'";
    return error;
}

// What an artist has to know of it comes to `io_input.warnings`.
void add_activations(const BodyValue& value, const Body& body, SceneInput& io_input, KeyHasher& io_hasher) {
    for (const ActivationValue& a : value.activations) {
        Activation activation = a.activation;
        for (ParticleId& i : activation.particles) i = ParticleId(i.value + body.particle_begin);
        io_input.scene.activations.push_back(std::move(activation));
        io_hasher.add(a.key).add(a.activation.particles.size());
    }
    for (const SeamValue& s : value.seams) {
        Seam seam = s.seam;
        for (EdgeId& e : seam.edges) e = EdgeId(e.value + body.edge_begin);
        io_input.scene.seams.push_back(std::move(seam));
        io_hasher.add(s.key);
    }
    std::ranges::copy(value.warnings, std::back_inserter(io_input.warnings));
}

void add(KeyHasher& io_hasher, const SourcePose& pose) {
    io_hasher.add(pose.whole).add(pose.own.size()).add(pose.set.size());
    for (const Pose& own : pose.own) io_hasher.add(own);
    for (const Mat3& F : pose.set)
        for (int c = 0; c < 3; ++c) io_hasher.add(Vec3(F.col(c)));
}

Status add_source(CookContext& context, const BodyValue& value, const Body& body, SceneInput& io_input,
                  KeyHasher& io_hasher) {
    io_input.motions.push_back(value.follows ? value.follows->vertices : nullptr);
    if (!value.follows) return {};
    Source source;
    source.name = value.follows->name;
    for (uint32_t i = body.particle_begin; i < body.particle_end; ++i) source.particles.push_back(ParticleId(i));
    const auto start = value.follows->at_frame(context.start_frame());
    if (!start) return in_source(source.name, start.error());
    source.start = *start;
    io_hasher.add(source.name);
    add(io_hasher, *source.start);
    io_input.scene.sources.push_back(std::move(source));
    return {};
}

// Which of the scene's materials each particle has.
void add_regions(std::span<const std::shared_ptr<const BodyValue>> bodies, Scene& io_scene, KeyHasher& io_hasher) {
    if (std::ranges::all_of(bodies, [](const auto& body) { return body->regions.empty(); })) return;
    io_scene.rest.material = io_scene.rest.body;
    for (size_t b = 0; b < bodies.size(); ++b) {
        const BodyValue& value = *bodies[b];
        const size_t before = bodies.size() + io_scene.region_bodies.size();
        for (size_t i = 0; i < value.region.size(); ++i) {
            io_hasher.add(value.region[i]);
            if (value.region[i] > 0)
                io_scene.rest.material[io_scene.bodies[b].particle_begin + i] =
                    static_cast<uint32_t>(before + value.region[i] - 1);
        }
        io_scene.region_bodies.insert(io_scene.region_bodies.end(), value.regions.size(), static_cast<uint32_t>(b));
    }
}

// Where pins let go of what activations hold on.
void tell_of_releases(SceneInput& io_input) {
    for (const Activation& a : io_input.scene.activations) {
        if (a.keeps == Keeps::glued) continue;
        for (const Pin& pin : io_input.scene.pins) {
            if (!pin.releases) continue;
            const auto n = std::ranges::count_if(
                a.particles, [&](ParticleId i) { return std::ranges::binary_search(pin.particles, i); });
            if (n > 0)
                io_input.warnings.push_back("activate '" + a.name + "' holds " + std::to_string(n) +
                                            " fragments that pin '" + pin.name +
                                            "' lets go at a frame: they stand until both have let go");
        }
    }
}

Status add_bodies(CookContext& context, SceneInput& io_input, KeyHasher& io_hasher) {
    Result<std::vector<std::shared_ptr<const BodyValue>>> bodies =
        context.inputs_as<BodyValue>("bodies", context.start_frame());
    if (!bodies) return bodies.error();
    Scene& scene = io_input.scene;
    for (const auto& value : *bodies) {
        if (std::ranges::find(scene.bodies, value->name, &Body::name) != scene.bodies.end())
            return context.error("bodies", "body '" + value->name + "' comes by two wires",
                                 "leave the one from the last of the nodes behind it");
        Body body;
        body.name = value->name;
        body.particle_begin = static_cast<uint32_t>(scene.rest.n_particles());
        body.edge_begin = static_cast<uint32_t>(scene.rest.n_edges());
        append_body(scene.rest, *value->rest, Pose{});
        body.particle_end = static_cast<uint32_t>(scene.rest.n_particles());
        body.edge_end = static_cast<uint32_t>(scene.rest.n_edges());
        body.velocity = value->velocity;
        body.angular_velocity = value->angular_velocity;
        body.settles = value->settles;
        io_input.body_keys.push_back(value->key);
        io_hasher.add(value->key);
        add_activations(*value, body, io_input, io_hasher);
        if (Status ok = add_source(context, *value, body, io_input, io_hasher); !ok) return ok;
        scene.bodies.push_back(std::move(body));
    }
    add_regions(*bodies, scene, io_hasher);
    return {};
}

Status add_pins(CookContext& context, Scene& io_scene, KeyHasher& io_hasher) {
    Result<std::vector<std::shared_ptr<const PinValue>>> pins =
        context.inputs_as<PinValue>("pins", context.start_frame());
    if (!pins) return pins.error();
    for (const auto& value : *pins) {
        const auto body = std::ranges::find(io_scene.bodies, value->body, &Body::name);
        if (body == io_scene.bodies.end())
            return context.error(
                "pins", "pin '" + value->name + "' holds body '" + value->body + "', which this solver does not move",
                "wire '@" + value->body + ".body' to bodies, or remove the pin");
        Pin pin;
        pin.name = value->name;
        for (const uint32_t particle : *value->particles)
            pin.particles.push_back(ParticleId(body->particle_begin + particle));
        io_hasher.add(pin.name).add(pin.particles.size());
        for (const ParticleId particle : pin.particles) io_hasher.add(particle.value);
        pin.turns_freely = value->turns_freely, pin.releases = value->releases;
        if (pin.turns_freely) io_hasher.add(std::string("turns freely"));
        io_scene.pins.push_back(std::move(pin));
    }
    return {};
}

Status add_solids(CookContext& context, Scene& io_scene, KeyHasher& io_hasher) {
    Result<std::vector<std::shared_ptr<const ColliderValue>>> colliders =
        context.inputs_as<ColliderValue>("colliders", context.start_frame());
    if (!colliders) return colliders.error();
    for (const auto& value : *colliders) {
        const Collider& c = value->collider;
        io_scene.colliders.push_back(c);
        io_hasher.add(c.name).add(c.friction).add(c.restitution);
        add(io_hasher, c.shape);
        if (c.tree) io_hasher.add(c.tree->key);
    }
    Result<std::vector<std::shared_ptr<const RigidBody>>> rigid_bodies =
        context.inputs_as<RigidBody>("rigid_bodies", context.start_frame());
    if (!rigid_bodies) return rigid_bodies.error();
    for (const auto& value : *rigid_bodies) {
        const RigidBody& b = *value;
        io_scene.rigid_bodies.push_back(b);
        io_hasher.add(b.name)
            .add(b.mass)
            .add(b.pose)
            .add(b.velocity)
            .add(b.angular_velocity)
            .add(b.friction)
            .add(b.restitution);
        add(io_hasher, b.shape);
        if (b.settles) io_hasher.add(std::string("settles"));
    }
    return {};
}

Status check_forces(CookContext& context, const Scene& scene) {
    const Result<std::vector<std::shared_ptr<const Force>>> forces =
        context.inputs_as<Force>("forces", context.start_frame());
    if (!forces) return forces.error();
    for (const auto& force : *forces) {
        if (!force->local || force->local->body.empty()) continue;
        const std::string& body = force->local->body;
        if (std::ranges::find(scene.bodies, body, &Body::name) == scene.bodies.end())
            return context.error(
                "forces", "'" + force->local->name + "' acts on body '" + body + "', which this solver does not move",
                "wire '@" + body + ".body' to bodies, or remove '" + force->local->name + "'");
    }
    return {};
}

}  // namespace

Result<SceneInput> scene_input(CookContext& context) {
    SceneInput input;
    KeyHasher hasher;
    if (Status ok = add_bodies(context, input, hasher); !ok) return ok.error();
    if (Status ok = add_pins(context, input.scene, hasher); !ok) return ok.error();
    if (Status ok = add_solids(context, input.scene, hasher); !ok) return ok.error();
    if (Status ok = check_forces(context, input.scene); !ok) return ok.error();
    tell_of_releases(input);
    input.key = hasher.add(context.start_frame())
                    .add(input.scene.bodies.size())
                    .add(input.scene.pins.size())
                    .add(input.scene.colliders.size())
                    .key();
    return input;
}

SolverSettings settings_of(const Parameters& p) {
    SolverSettings s;
    const std::string method = p.text("method");
    s.method = method == "gauss_seidel" ? Method::gauss_seidel
               : method == "jacobi"     ? Method::jacobi
                                        : Method::projective;
    const Preset& preset = *find_preset(p.text("preset"));
    s.substeps = preset.substeps, s.iterations = preset.iterations, s.hit_substeps = preset.hit_substeps;
    read_fields(p, settings_fields(), s);
    return s;
}

namespace {

// FrameInput::yield_changes, from frame to frame.
std::vector<double> yield_changes(std::span<const std::shared_ptr<const BodyValue>> from,
                                  std::span<const std::shared_ptr<const BodyValue>> to) {
    std::vector<double> changes(to.size(), 1.0);
    for (size_t b = 0; b < to.size(); ++b)
        for (size_t k = 0; k < to[b]->regions.size(); ++k)
            changes.push_back(to[b]->regions[k].yield_factor / from[b]->regions[k].yield_factor);
    if (std::ranges::all_of(changes, [](double change) { return change == 1; })) changes.clear();
    return changes;
}

// Of a collider from the frame before to `frame`, by its poses or its surface.
DrivenPose drive_of(const Pose& begin, const Pose& end, const SurfaceMotion* surface, int frame) {
    return surface ? drive_of(surface->from(frame - 1)) : DrivenPose{begin, end, true};
}

}  // namespace

Result<FrameInput> frame_input(CookContext& context, int frame) {
    FrameInput input;
    input.duration = context.seconds(1);
    input.gravity = context.parameters(frame).vector3("gravity");

    Result<std::vector<std::shared_ptr<const Force>>> forces = context.inputs_as<Force>("forces", frame);
    if (!forces) return forces.error();
    for (const auto& force : *forces)
        if (acts(*force)) input.forces.push_back(*force);
    Result<std::vector<std::shared_ptr<const BodyValue>>> bodies = context.inputs_as<BodyValue>("bodies", frame);
    if (!bodies) return bodies.error();
    const bool has_change = std::ranges::any_of(*bodies, [](const auto& body) {
        return body->follows || !body->regions.empty() ||
               std::ranges::any_of(body->activations,
                                   [](const ActivationValue& a) { return a.activation.until == Until::object; });
    });
    const auto bodies_begin = has_change ? context.inputs_as<BodyValue>("bodies", frame - 1) : bodies;
    if (!bodies_begin) return bodies_begin.error();
    input.materials = materials_of(*bodies);
    input.yield_changes = yield_changes(*bodies_begin, *bodies);
    input.seams = seams_of(*bodies);
    for (size_t b = 0; b < bodies->size(); ++b) {
        const BodyValue &from = *(*bodies_begin)[b], &to = *(*bodies)[b];
        for (size_t k = 0; k < to.activations.size(); ++k)
            input.activations.push_back(
                {to.activations[k].comes, drive_of(from.activations[k].object, to.activations[k].object,
                                                   to.activations[k].object_surface.get(), frame)});
        if (!to.follows) continue;
        const auto begin = from.follows->at_frame(frame - 1), end = to.follows->at_frame(frame);
        if (!begin) return in_source(to.follows->name, begin.error());
        if (!end) return in_source(to.follows->name, end.error());
        FrameInput::SourceDrive drive{*begin, *end, to.follows->pivot()};
        drive.goes_on = moves(drive);  // one that stands has ended, be it by its keys or with its file
        input.sources.push_back(std::move(drive));
    }

    const auto pins_begin = context.inputs_as<PinValue>("pins", frame - 1);
    if (!pins_begin) return pins_begin.error();
    const auto pins_end = context.inputs_as<PinValue>("pins", frame);
    if (!pins_end) return pins_end.error();
    for (size_t i = 0; i < pins_end->size(); ++i) {
        const PinValue &from = *(*pins_begin)[i], &to = *(*pins_end)[i];
        input.pins.push_back({from.pose, to.pose, to.active, to.pivot, {from.grip, to.grip, to.release_time}});
        if (!to.motion || !to.active) continue;
        const auto begin = to.motion->at_frame(frame - 1), end = to.motion->at_frame(frame);
        if (!begin) return in_source(to.name, begin.error());
        if (!end) return in_source(to.name, end.error());
        input.pin_sources.resize(pins_end->size());
        input.pin_sources[i] = {*begin, *end, to.motion->center()};
    }

    const auto colliders_begin = context.inputs_as<ColliderValue>("colliders", frame - 1);
    if (!colliders_begin) return colliders_begin.error();
    const auto colliders_end = context.inputs_as<ColliderValue>("colliders", frame);
    if (!colliders_end) return colliders_end.error();
    for (size_t i = 0; i < colliders_end->size(); ++i)
        input.colliders.push_back(drive_of((*colliders_begin)[i]->pose, (*colliders_end)[i]->pose,
                                           (*colliders_end)[i]->surface.get(), frame));
    return input;
}

Result<std::vector<std::string>> missed_blasts(CookContext& context) {
    const int start = context.start_frame();
    const auto forces = context.inputs_as<Force>("forces", start);
    if (!forces) return forces.error();
    std::vector<std::string> told;
    for (const auto& force : *forces) {
        if (!force->local) continue;
        const auto* waits = std::get_if<Nothing>(&force->local->kind);
        const bool is_at_start = std::holds_alternative<Blast>(force->local->kind);
        const int frame = waits ? waits->blast_frame.value_or(start) : is_at_start ? start - 1 : start;
        if (frame < start)
            told.push_back("node '" + force->local->name + "': never goes off: its frame " + std::to_string(frame) +
                           " lies before the first, " + std::to_string(start));
    }
    return told;
}

ContentKey key_of(const FrameInput& input, const SolverSettings& s) {
    KeyHasher hasher;
    hasher.add(static_cast<int>(s.method));
    add_fields(hasher, settings_fields(), s);
    hasher.add(input.duration).add(input.gravity).add(input.forces.size());
    for (const Force& f : input.forces) {
        hasher.add(f.acceleration).add(f.wind).add(f.drag);
        if (f.local) hasher.add(f.local->key);
    }
    hasher.add(key_of(input.materials));
    add(hasher, input.pins);
    add(hasher, input.colliders);
    for (const FrameInput::ActivationDrive& a : input.activations) hasher.add(a.comes), add_way(hasher, a.object);
    for (const double factor : input.seams) hasher.add(factor);
    for (const std::vector<FrameInput::SourceDrive>* sources : {&input.sources, &input.pin_sources})
        for (const FrameInput::SourceDrive& s : *sources) {
            if (!s.begin) continue;
            add(hasher, *s.begin), add(hasher, *s.end);
            hasher.add(s.pivot).add(s.goes_on);
        }
    for (const double change : input.yield_changes) hasher.add(change);
    return hasher.key();
}

ContentKey key_of(const std::vector<Material>& materials) {
    KeyHasher hasher;
    hasher.add(materials.size());
    for (const Material& m : materials) add_fields(hasher, material_fields(), m);
    return hasher.key();
}

}  // namespace sunder
