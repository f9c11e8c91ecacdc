// Every number that an artist can set, at the ends of its range, two at a time: nothing may fail, blow up or become
// non-finite. Ranges come from the nodes' own descriptions, so a new parameter is swept as soon as it exists.
#include <gtest/gtest.h>

#include "nodes/graph/registry.h"
#include "solver/scene/scene_fields.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Values {
    Material material;
    SolverSettings settings;
    double density = 1000;  // kg/m3
    bool settles = false;
};

struct Ends {
    std::string name;
    std::function<void(Values&, double)> set;
    std::vector<double> values;
};

// How a parameter of the nodes `body` and `solver` reaches the solver.
std::function<void(Values&, double)> setter(const std::string& name) {
    const auto set = [](const auto* field, auto Values::*owner) {
        return [=](Values& s, double v) {
            field->visit(s.*owner, [v]<class N>(N& io_value) { io_value = static_cast<N>(v); });
        };
    };
    if (name == "density") return [](Values& s, double v) { s.density = v; };
    if (name == "settle") return [](Values& s, double v) { s.settles = v != 0; };
    if (const auto* field = find_field(material_fields(), name)) return set(field, &Values::material);
    if (const auto* field = find_field(settings_fields(), name)) return set(field, &Values::settings);
    return nullptr;
}

// Both ends of the range; where an end is open or excluded, a value that is as good as it. Counts stay at 16: they only
// cost time.
std::vector<Ends> all_ends() {
    std::vector<Ends> all;
    for (const char* type : {"body", "solver"})
        for (const ParameterDescription& p : standard_registry().find(type)->description.parameters) {
            const bool number = p.type == ParameterType::number || p.type == ParameterType::integer;
            if (!number && p.type != ParameterType::boolean) continue;
            if (p.name == "time_scale" || p.name == "accelerations") continue;  // of what is shown of a simulation
            Ends ends{p.name, setter(p.name), {0, 1}};
            EXPECT_TRUE(ends.set) << "no way to sweep '" << p.name << "'";
            if (!ends.set) continue;
            if (number) {
                const bool counted = p.type == ParameterType::integer;
                const double high = p.nullable ? kNever : p.max.value_or(1e6);
                const double low = p.min_excluded ? (p.nullable ? 1e-4 : 1e-3) : p.min.value_or(0);
                ends.values = {low, counted ? std::min(high, 16.0) : high};
            }
            all.push_back(ends);
        }
    return all;
}

// A bar held at its foot: its head is pulled and twisted for four frames and let go over a floor, for four more.
double run(const Values& chosen, std::string& o_error) {
    static const SimulationMesh mesh = test::lattice_mesh({{2, 2, 4}, 0.1, 6, 1, {}});
    Scene scene;
    scene.colliders.resize(1);
    scene.colliders[0].shape.kind = ShapeKind::plane;
    scene.colliders[0].friction = chosen.material.friction;
    SimulationMesh dense = mesh;
    for (double& m : dense.mass) m *= chosen.density;
    test::add_body(scene, dense, {Vec3(0, 0, 0.02), Quat::Identity()});
    scene.bodies[0].settles = chosen.settles;
    test::add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
    test::add_pin(scene, [](const Vec3& x) { return x.z() > 0.35; });
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({chosen.material});
    const auto pose = [](double share) {
        return Pose{Vec3(0, 0, 0.1 * share), Quat(Eigen::AngleAxisd(0.8 * share, Vec3::UnitZ()))};
    };
    const auto input = [&] {
        FrameInput in = test::quiet_input(scene, chosen.material);
        in.gravity = Vec3(0, 0, -9.81);
        return in;
    };
    if (anything_settles(scene)) {
        const auto settled = solver->settle(input(), chosen.settings, state);
        if (!settled) return o_error = settled.error().text(), 0;
    }
    double fastest = 0;
    for (int f = 0; f < 8; ++f) {
        FrameInput in = input();
        in.pins[0].active = in.pins[1].active = f < 4;
        if (f < 4) in.pins[1] = {pose(f / 4.0), pose((f + 1) / 4.0), true};
        const auto report = solver->advance(in, chosen.settings, state);
        if (!report) {
            o_error = report.error().text();
            return fastest;
        }
        for (const Vec3& v : state.velocity) fastest = std::max(fastest, v.norm());
    }
    return fastest;
}

TEST(parameter_sweep, no_pair_of_extreme_parameters_fails_or_explodes) {
    const std::vector<Ends> ends = all_ends();
    size_t runs = 0, errors = 0, fast = 0;
    double fastest = 0;
    std::string worst;
    for (size_t i = 0; i < ends.size(); ++i)
        for (size_t j = 0; j < i; ++j)
            for (double a : ends[i].values)
                for (double b : ends[j].values) {
                    Values chosen;
                    chosen.material.yield = 0.05, chosen.material.toughness = 0.3;  // so that all that can happen does
                    chosen.settings.substeps = 4;
                    ends[i].set(chosen, a), ends[j].set(chosen, b);
                    const auto name =
                        ends[i].name + " " + std::to_string(a) + ", " + ends[j].name + " " + std::to_string(b);
                    std::string error;
                    const double speed = run(chosen, error);
                    ++runs;
                    EXPECT_TRUE(error.empty()) << name << ": " << error;
                    errors += !error.empty();
                    // Stretched by half, a bar of the defaults springs back at sqrt(E / rho) * 0.5 = 7 m/s. A lighter
                    // or stiffer one is faster, but never in four substeps a frame faster than its own length of 0.4 m
                    // and the pull of 0.1 m a substep: 48 m/s.
                    const double bound = 0.5 * 24 * chosen.settings.substeps;
                    fast += speed > bound;
                    EXPECT_LE(speed, bound) << name;
                    if (speed / bound > fastest) fastest = speed / bound, worst = name;
                }
    std::printf("%zu runs, %zu errors, %zu too fast; fastest %.2f of its bound (%s)\n", runs, errors, fast, fastest,
                worst.c_str());
    EXPECT_GE(runs, 500u);
}

}  // namespace
}  // namespace sunder
