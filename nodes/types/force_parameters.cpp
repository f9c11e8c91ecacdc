#include "nodes/types/force_parameters.h"

#include "nodes/graph/common_parameters.h"

namespace sunder {
namespace {

KeyHasher& add(KeyHasher& io_hasher, const Falloff& f) { return io_hasher.add(f.radius).add(f.exponent).add(f.reach); }

void add(KeyHasher&, const Nothing&) {}

void add(KeyHasher& io_hasher, const Blast& b) {
    add(io_hasher, b.falloff).add(b.center).add(b.speed).add(b.energy).add(b.direction).add(b.least_cosine);
    io_hasher.add(static_cast<int>(b.shadow));
}

void add(KeyHasher& io_hasher, const PointField& f) { add(io_hasher, f.falloff).add(f.center).add(f.strength); }

void add(KeyHasher& io_hasher, const VortexField& f) {
    add(io_hasher, f.falloff).add(f.center).add(f.axis).add(f.swirl).add(f.inflow).add(f.lift);
}

void add(KeyHasher& io_hasher, const TurbulenceField& f) {
    io_hasher.add(f.strength).add(f.size).add(f.time).add(f.octaves).add(f.seed).add(f.center).add(f.reach);
}

void add(KeyHasher& io_hasher, const Guide& g) {
    io_hasher.add(g.pose.begin).add(g.pose.end).add(g.pose.pivot).add(g.rate);
    if (!g.targets) return;
    for (const Pose& target : *g.targets) io_hasher.add(target);
}

void add(KeyHasher& io_hasher, const GridField& f) { io_hasher.add(f.key); }

void add(KeyHasher& io_hasher, const Pressure& g) { io_hasher.add(g.pressure).add(g.vent).add(g.key); }

}  // namespace

std::vector<ParameterDescription> falloff_parameters() {
    return {
        radius_parameter("Where it is strongest: evenly weaker from there to the centre, and outwards by the falloff"),
        {.name = "falloff",
         .label = "Falloff",
         .min = 0,
         .max = 20,
         .default_value = 2.0,
         .sentence = "n: at distance r beyond the radius it is (radius / r)^n as strong; 0: no weaker"},
        {.name = "reach",
         .label = "Reach",
         .unit = "m",
         .min = 0,
         .max = 1e5,
         .min_excluded = true,
         .default_value = nullptr,
         .sentence = "Beyond this distance there is nothing of it; null: no such bound",
         .nullable = true,
         .group = "Reach"}};
}

Falloff falloff_of(const Parameters& p) {
    return {p.number("radius"), p.number("falloff"), p.number_or("reach", kNever)};
}

std::vector<ParameterDescription> acting_parameters() {
    return {
        {.name = "acts_as",
         .label = "Acts As",
         .type = ParameterType::choice,
         .default_value = "wind",
         .sentence = "wind: its numbers are velocities of the air, which drags things along; acceleration: they are "
                     "accelerations",
         .choices = {"wind", "acceleration"}},
        {.name = "drag",
         .label = "Drag",
         .unit = "1/s",
         .min = 0,
         .max = 1e4,
         .default_value = 1.0,
         .sentence = "How fast the wind takes things along: acceleration = drag x (wind - velocity)",
         .animatable = true,
         .needs = {{is("acts_as", {"wind"})}}}};
}

std::optional<double> drag_of(const Parameters& p) {
    if (p.text("acts_as") == "acceleration") return 0;
    if (!(p.number("drag") > 0)) return {};
    return p.number("drag");
}

SocketDescription force_output() {
    return {.name = "force", .label = "Force", .type = SocketType::force, .sentence = "For a solver"};
}

Value local_force(const CookContext& context, LocalForce::Kind kind, double drag, const std::string& body) {
    KeyHasher hasher;
    hasher.add(kind.index()).add(drag).add(body);
    std::visit([&](const auto& k) { add(hasher, k); }, kind);
    Force force;
    force.local =
        std::make_shared<const LocalForce>(LocalForce{context.node(), hasher.key(), std::move(kind), drag, body});
    return make_value(std::move(force));
}

double noise_time(const CookContext& context, double seconds) {
    return (context.frame() - context.start_frame() + 1) / context.frame_rate() / seconds;
}

}  // namespace sunder
