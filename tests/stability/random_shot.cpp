#include "tests/stability/random_shot.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "solver/data/rotations.h"
#include "solver/scene/local_force.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/solids.h"

namespace sunder::test {
namespace {

enum Cut { pieces, crumbs, needles, coarse, slabs, kCuts };

const SimulationMesh& rabbit(Cut cut) {
    static std::map<Cut, SimulationMesh> known;
    if (const auto found = known.find(cut); found != known.end()) return found->second;
    PrefractureSettings settings;
    settings.pieces = cut == coarse ? 40 : 100, settings.seed = 5 + static_cast<uint32_t>(cut), settings.threads = 1;
    std::vector<Vec3>& sites = settings.sites.points;
    if (cut == needles)
        for (double x = -0.35; x < 0.4; x += 0.1)
            for (double y = -0.47; y < 0.5; y += 0.1) sites.push_back({x + 0.01 * y, y - 0.01 * x, 0.5});
    if (cut == slabs)
        for (double z = 0.01; z < 1; z += 0.04) sites.push_back({0.1 * z, 0.05 * z, z});
    settings.sites.kind = !sites.empty() ? SiteKind::points : cut == crumbs ? SiteKind::uniform : SiteKind::kmeans;
    settings.least_piece = cut == crumbs ? 0 : 0.05;
    const auto fragments = prefracture(*read_mesh(SUNDER_TEST_DATA "/bunny.obj"), settings, "bunny");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    return known[cut] = build_simulation_mesh(*fragments, {}).take();
}

constexpr uint64_t kPanels = 4;

// 1 m3 of it would be a cube of 1.3 m: cells 1.5 and 8 times as wide as thick, and both cut by Voronoi cells.
const SimulationMesh& panel(uint64_t kind) {
    static std::map<uint64_t, SimulationMesh> known;
    if (const auto found = known.find(kind); found != known.end()) return found->second;
    const double thickness = kind % 2 == 0 ? 0.08 : 0.015;
    if (kind < 2) {
        LatticeSettings lattice;
        lattice.cells = {11, 9, 1}, lattice.size = Vec3(1.3, 1.1, thickness), lattice.center = Vec3::Zero();
        return known[kind] = build_simulation_mesh(*make_lattice(lattice, "panel"), {}).take();
    }
    TriMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.push_back(
            0.5 * Vec3(corner & 1 ? 1.3 : -1.3, corner & 2 ? 1.1 : -1.1, corner & 4 ? thickness : -thickness));
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    PrefractureSettings settings;
    settings.pieces = 100, settings.seed = static_cast<uint32_t>(kind), settings.threads = 1;
    const auto fragments = prefracture(mesh, settings, "panel");
    EXPECT_TRUE(fragments) << (fragments ? "" : fragments.error().text());
    return known[kind] = build_simulation_mesh(*fragments, {}).take();
}

Quat turn(Draw& draw) {
    const Vec3 axis = draw.vector(1).normalized();
    return Quat(Eigen::AngleAxisd(draw.uniform(0, 3), axis));
}

}  // namespace

SimulationMesh scaled(SimulationMesh mesh, double size, double density) {
    const double area = size * size, volume = area * size;
    for (Vec3& x : mesh.rest_position) x *= size;
    for (Vec3& r : mesh.radii) r *= size;
    for (Vec3f& x : mesh.hull_point) x *= static_cast<float>(size);
    for (double& v : mesh.volume) v *= volume;
    for (double& m : mesh.mass) m *= volume * density / 1000;
    for (Edge& e : mesh.edges) e.area *= area;
    return mesh;
}

Shot::Shot(uint64_t seed) {
    Draw draw(seed);
    material.youngs_modulus = draw.logarithmic(1e4, 1e9);
    if (draw.one_in(2)) material.poisson_ratio = draw.uniform(0, 0.45);
    material.damping_time = draw.one_in(3) ? 0 : draw.logarithmic(1e-4, 0.1);
    if (draw.one_in(2)) material.yield = draw.logarithmic(0.003, 0.2);
    material.flow_rate = draw.logarithmic(1, 1000), material.hardening = draw.uniform(0, 5);
    material.toughness = draw.logarithmic(0.001, 0.5);
    if (draw.one_in(5)) material.compressive_toughness = draw.logarithmic(0.01, 0.5);
    material.friction = draw.one_in(5) ? 0 : draw.uniform(0, 1.5);
    if (draw.one_in(4)) material.restitution = draw.uniform(0, 0.8);
    settings.substeps = draw.of({2, 3, 4, 6, 8, 12, 16}), settings.iterations = draw.of({2, 2, 2, 1, 3, 5});
    if (draw.one_in(8)) settings.method = Method::jacobi;
    if (draw.one_in(8)) settings.error_budget = draw.logarithmic(0.005, 0.2);
    if (draw.one_in(4)) gravity = draw.logarithmic(0.5, 50);

    const double size = draw.one_in(3) ? draw.logarithmic(0.1, 10) : 1, density = draw.logarithmic(100, 10000);
    const double speed = std::sqrt(size);  // m/s, that of falling by a twentieth of it
    scene.colliders.resize(1);
    scene.colliders[0].shape.kind = ShapeKind::plane;
    scene.colliders[0].friction = material.friction;
    for (const double height : {1.3, 3.8}) {
        if (height > 2 && draw.one_in(2)) continue;
        const Vec3 place = size * Vec3(draw.uniform(0, 0.3), draw.uniform(0, 0.3), height);
        add_body(scene, scaled(rabbit(static_cast<Cut>(draw.index(kCuts))), size, density), {place, turn(draw)});
        scene.bodies.back().velocity = speed * (draw.vector(1) - draw.logarithmic(0.1, 20) * Vec3::UnitZ());
        scene.bodies.back().angular_velocity = draw.vector(draw.logarithmic(0.1, 5)) / speed;
    }
    if (draw.one_in(2)) {
        const double length = draw.logarithmic(1e-3, 3) * size;
        material.fracture_energy = material.youngs_modulus * material.toughness * material.toughness * length / 2;
    }
    if (draw.one_in(2)) return;
    RigidBody weight;
    weight.name = "weight";
    if (draw.one_in(2)) weight.shape.kind = ShapeKind::box, weight.shape.half_extents = size * Vec3(0.3, 0.2, 0.1);
    weight.shape.radius = 0.2 * size;
    for (const double m : scene.rest.mass) weight.mass += m;  // to 1 kg: small bodies meet heavy ones
    weight.mass *= draw.logarithmic(0.01, 20);
    weight.pose.position = size * Vec3(draw.uniform(0, 0.2), draw.uniform(0, 0.2), 5.6);
    weight.velocity = -speed * draw.logarithmic(1, 30) * Vec3::UnitZ();
    weight.friction = material.friction;
    scene.rigid_bodies.push_back(weight);
}

// Left out is what gives energy there: `depenetration_speed`, a restitution of 1, and spins of half a radian a substep
// (docs/performance-log.md).
std::string Shot::go_far(uint64_t seed) {
    Draw draw(seed);
    const auto number = [&](const char* name, double& parameter, double low, double high) {
        parameter = draw.logarithmic(low, high);
        return std::string(name) + " " + std::to_string(parameter);
    };
    struct Range {
        const char* name;
        double& parameter;
        double low, high;
    };
    const Range numbers[] = {
        {"youngs_modulus", material.youngs_modulus, 1, 1e12},
        {"damping_time", material.damping_time, 1e-6, 1},
        {"yield", material.yield, 1e-6, 10},
        {"flow_rate", material.flow_rate, 1e-3, 1e6},
        {"hardening", material.hardening, 1e-3, 1e3},
        {"toughness", material.toughness, 1e-7, 100},
        {"compressive_toughness", material.compressive_toughness, 1e-7, 100},
        {"fracture_energy", material.fracture_energy, 1e-9, 1e12},
    };
    const auto rubbed = [&](const std::string& told) {
        scene.colliders[0].friction = material.friction;
        for (RigidBody& r : scene.rigid_bodies) r.friction = material.friction;
        return told;
    };
    const auto count = [&](const char* name, int& parameter, std::initializer_list<int> some) {
        parameter = draw.of(some);
        return std::string(name) + " " + std::to_string(parameter);
    };
    const auto fast = [&] {
        double times = 1;
        const std::string told = number("times as fast", times, 1, 100);
        for (Body& b : scene.bodies) b.velocity *= times;
        return told;
    };
    const auto sweeps = [&] {
        settings.method = draw.of({Method::jacobi, Method::gauss_seidel}), settings.error_budget = 0;
        material.stiffness = draw.uniform(0, 1), settings.iterations = draw.of({1, 2, 3, 4, 5, 9});
        return number("sweeps over-relaxed", settings.over_relaxation, 0.1, 1.9);
    };
    const size_t chosen = draw.index(std::size(numbers) + 6);
    if (chosen < std::size(numbers)) {
        const Range& r = numbers[chosen];
        return number(r.name, r.parameter, r.low, r.high);
    }
    switch (chosen - std::size(numbers)) {
        case 0:
            return rubbed(number("friction", material.friction, 0.01, 10));
        case 1:
            return count("substeps", settings.substeps, {5, 7, 20, 32, 64});
        case 2:
            return count("iterations", settings.iterations, {1, 4, 10, 20, 50});
        case 3:
            return number("damping", settings.damping, 1e-3, 1e4);
        case 4:
            return fast();
        default:
            return sweeps();
    }
}

void Shot::beat_flat(uint64_t seed) {
    Draw draw(seed);
    const Scene solid = scene;
    scene.rest = {}, scene.bodies.clear();
    material.curvature = true;
    for (const Body& body : solid.bodies) {
        Vec3 middle = Vec3::Zero();
        double volume = 0, mass = 0;
        for (uint32_t i = body.particle_begin; i < body.particle_end; ++i) {
            middle += solid.rest.mass[i] * solid.rest.rest_position[i];
            volume += solid.rest.volume[i], mass += solid.rest.mass[i];
        }
        middle /= mass;
        const double size = std::cbrt(volume);
        add_body(scene, scaled(panel(draw.index(kPanels)), size, mass / volume), {middle, turn(draw)}, body.velocity);
        scene.bodies.back().angular_velocity = body.angular_velocity;
    }
}

void Shot::hold(uint64_t seed) {
    Draw draw(seed);
    Body& body = scene.bodies[0];
    body.velocity.setZero(), body.angular_velocity.setZero();
    const Vec3 across = draw.vector(1).normalized();
    std::vector<double> along;
    for (uint32_t i = body.particle_begin; i < body.particle_end; ++i)
        along.push_back(across.dot(scene.rest.rest_position[i]));
    std::ranges::sort(along);
    const double from = along[static_cast<size_t>(draw.uniform(0.5, 0.98) * static_cast<double>(along.size()))];
    Pin pin{"pin", {}};
    for (uint32_t i = body.particle_begin; i < body.particle_end; ++i)
        if (across.dot(scene.rest.rest_position[i]) >= from) pin.particles.push_back(ParticleId(i));
    scene.pins.push_back(pin);
}

void Shot::blow(uint64_t seed) {
    Draw draw(seed);
    Vec3 low = Vec3::Constant(kNever), high = -low;
    for (const Vec3& x : scene.rest.rest_position) low = low.cwiseMin(x), high = high.cwiseMax(x);
    const double size = (high - low).maxCoeff();
    const auto add = [&](std::vector<Force>& io_forces, LocalForce::Kind kind, double drag = 0,
                         const std::string& body = {}) {
        io_forces.emplace_back();
        io_forces.back().local =
            std::make_shared<LocalForce>(LocalForce{"drawn", draw.index(1 << 30), std::move(kind), drag, body});
    };
    const auto place = [&] { return Vec3((low + high) / 2 + draw.vector(0.6 * size)); };
    const auto falloff = [&] {
        return Falloff{size * draw.logarithmic(0.01, 1), draw.uniform(0, 4),
                       draw.one_in(2) ? kNever : size * draw.logarithmic(0.1, 2)};
    };
    for (uint64_t n = draw.index(3); n > 0; --n) {
        Blast blast{.center = place(), .falloff = falloff(), .speed = draw.logarithmic(0.1, 100)};
        if (draw.one_in(4)) blast.center = scene.rest.rest_position[draw.index(scene.rest.n_particles())];
        if (draw.one_in(3)) blast.direction = draw.vector(1).normalized(), blast.least_cosine = draw.uniform(-1, 1);
        blast.shadow = draw.of({Shadow::none, Shadow::solids, Shadow::all});
        add(blasts, blast);
    }
    const auto drag = [&] { return draw.one_in(2) ? 0 : draw.logarithmic(0.01, 1e3); };
    if (draw.one_in(2)) add(forces, PointField{place(), falloff(), draw.logarithmic(0.1, 1e3) * draw.of({-1, 1})});
    if (draw.one_in(2)) {
        VortexField vortex{place(), draw.vector(1).normalized(), falloff()};
        vortex.swirl = draw.logarithmic(0.1, 100), vortex.inflow = draw.uniform(-10, 10),
        vortex.lift = draw.uniform(-10, 10);
        add(forces, vortex, drag());
    }
    if (draw.one_in(2))
        add(forces,
            TurbulenceField{.strength = draw.logarithmic(0.1, 100),
                            .size = size * draw.logarithmic(0.01, 10),
                            .octaves = draw.of({1, 2, 5}),
                            .seed = static_cast<uint32_t>(seed)},
            drag());
    if (draw.one_in(3)) {
        Guide guide;
        guide.rate = draw.logarithmic(0.01, 1e3);
        guide.pose.begin = guide.pose.end = {size * draw.vector(0.5), turn(draw)};
        add(forces, guide);
    }
    if (draw.one_in(2)) {  // as if its first body were hollow, and not closed
        Pressure gas{.lining = {}, .pressure = draw.logarithmic(1, 1e5), .vent = draw.logarithmic(1e-3, 1)};
        std::vector<Vec3> lining;
        for (uint32_t i = scene.bodies[0].particle_begin; i < scene.bodies[0].particle_end; ++i) {
            lining.push_back(std::pow(scene.rest.volume[i], 2.0 / 3) * draw.vector(1));
            gas.area += lining.back().norm();
        }
        gas.lining = std::make_shared<const std::vector<Vec3>>(std::move(lining));
        add(forces, gas, 0, scene.bodies[0].name);
    }
}

void Shot::keep(uint64_t seed) {
    hold(seed);  // and held until something comes, in place of the pin
    Draw draw(seed + 1);
    Activation held;
    held.name = "held", held.particles = std::move(scene.pins.back().particles);
    scene.pins.pop_back();
    held.keeps = draw.of({Keeps::held, Keeps::held, Keeps::asleep});
    held.until = draw.of({Until::contact, Until::neighbour, Until::frame, Until::object});
    held.impulse = draw.one_in(2) ? 0 : draw.logarithmic(0.1, 1000);
    const Vec3 middle = scene.rest.rest_position[draw.of({held.particles.front(), held.particles.back()})];
    const Vec3 way = draw.vector(2);
    sweep = {{middle - way, turn(draw)}, {middle + way, turn(draw)}};
    held.object.radius = draw.logarithmic(0.01, 1), held.falloff = draw.one_in(2) ? 0 : draw.logarithmic(0.01, 1);
    held.delay = draw.of({0.0, 0.2}), held.growth = draw.of({0.0, 1.0});
    Activation glued;
    glued.name = "glued", glued.keeps = Keeps::glued;
    glued.until = draw.of({Until::contact, Until::neighbour});
    for (ParticleId i(scene.bodies[0].particle_begin); i < scene.bodies[0].particle_end; ++i)
        if (draw.one_in(3)) glued.particles.push_back(i);
    scene.activations = {held, glued};
    Seam seam{"seam", {}};
    scene.rest.material = scene.rest.body, scene.region_bodies = {0};
    for (EdgeId e(scene.bodies[0].edge_begin); e < scene.bodies[0].edge_end; ++e)
        if (draw.one_in(5)) seam.edges.push_back(e);
    for (uint32_t i = scene.bodies[0].particle_begin; i < scene.bodies[0].particle_end; ++i)
        if (draw.one_in(3)) scene.rest.material[i] = static_cast<uint32_t>(scene.bodies.size());
    scene.seams = {seam};
    add_factors(draw);
    of_region = material;
    of_region.toughness *= draw.logarithmic(0.1, 10), of_region.youngs_modulus *= draw.logarithmic(0.1, 10);
    of_region.yield *= draw.logarithmic(0.1, 10);
}

void Shot::add_factors(Draw& draw) {
    Seam scaled{"scaled", {}}, fixed{"fixed", {}};
    const Vec3 middle = scene.rest.rest_position[draw.index(scene.bodies[0].particle_end)], normal = draw.vector(1);
    for (EdgeId e(scene.bodies[0].edge_begin); e < scene.bodies[0].edge_end; ++e) {
        if (normal.dot(scene.rest.rest_position[scene.rest.edges[e].a] - middle) > 0) scaled.edges.push_back(e);
        if (draw.one_in(20)) fixed.edges.push_back(e);
    }
    scene.seams.push_back(scaled), scene.seams.push_back(fixed);
    factors = {draw.logarithmic(1e-3, 1e3), draw.logarithmic(1e-3, 1e3)};
}

std::vector<Material> Shot::materials() const {
    std::vector<Material> all(scene.bodies.size(), material);
    all.insert(all.end(), scene.region_bodies.size(), of_region);
    return all;
}

// Turns, goes and shears from frame to frame, all of the first body alike.
void Shot::draw_motion(Draw& draw) {
    const SimulationMesh rest = scene.rest;
    const uint32_t n = scene.bodies[0].particle_end;
    Vec3 middle = Vec3::Zero();
    for (uint32_t i = 0; i < n; ++i) middle += rest.rest_position[i] / n;
    const Vec3 axis = draw.vector(1).normalized(), along = draw.vector(1).normalized(), across = draw.vector(1);
    const double turn = draw.uniform(0, 0.3), way = draw.logarithmic(0.001, 0.1), shear = draw.uniform(0, 0.03);
    const bool is_set = draw.one_in(2);
    motion = [=](size_t frame) {
        const double t = static_cast<double>(frame);
        SourcePose pose;
        const Quat q = rotation_about(axis, turn * t);
        pose.whole = {middle - q * middle + Vec3(0, 0, way * t), q};
        const Mat3 F =
            Mat3::Identity() + Mat3((shear * t) * (along * (across - across.dot(along) * along).transpose()));
        for (uint32_t i = 0; i < n; ++i) {
            const Vec3& x = rest.rest_position[i];
            pose.own.push_back({middle + F * (x - middle) - x, Quat::Identity()});
            const Mat3 S = Eigen::SelfAdjointEigenSolver<Mat3>(F.transpose() * F).operatorSqrt();
            if (is_set) pose.set.push_back(S);
        }
        return pose;
    };
}

void Shot::follow(uint64_t seed) {
    Draw draw(seed);
    draw_motion(draw);
    const uint32_t n = scene.bodies[0].particle_end;
    Activation a;
    a.name = "rig", a.until = draw.of({Until::frame, Until::contact}), a.keeps = draw.of({Keeps::held, Keeps::asleep});
    Source source;
    source.name = "rig", source.start = std::make_shared<const SourcePose>(motion(0));
    for (ParticleId i(0); i < n; ++i) a.particles.push_back(i), source.particles.push_back(i);
    scene.activations = {a}, scene.sources = {source};
}

void Shot::deform(uint64_t seed) {
    Draw draw(seed);
    hold(seed + 1);
    draw_motion(draw);
    Aabb box;
    for (const Vec3& x : scene.rest.rest_position) box.extend(x);
    const double size = (box.max - box.min).maxCoeff(), radius = size * draw.uniform(0.05, 0.4);
    const TriMesh mesh = ball(radius, 3);
    const Vec3 from = (box.min + box.max) / 2 + size * draw.vector(1),
               to = (box.min + box.max) / 2 + size * draw.vector(0.5);
    const double swell = draw.uniform(-0.05, 0.2), bend = draw.uniform(0, 0.3) / radius;
    const Vec3 axis = draw.vector(1).normalized();
    skin = [=](size_t frame) {
        const double t = static_cast<double>(frame) / kLetGo;
        std::vector<Vec3> at;
        for (const Vec3& p : mesh.positions)
            at.push_back(from + t * (to - from) + (1 + swell * t) * (rotation_about(axis, bend * t * p.dot(axis)) * p));
        return at;
    };
    Collider c;
    c.name = "skin", c.shape.kind = ShapeKind::mesh, c.tree = tree = make_surface_tree(mesh, 0);
    scene.colliders.push_back(c);
}

FrameInput Shot::input(size_t frame) const {
    FrameInput in = quiet_input(scene, material);
    in.materials = materials(), in.gravity = Vec3(0, 0, -gravity);
    in.forces = forces;
    const auto at = [&](size_t f) { return std::make_shared<const SourcePose>(motion(std::min(f, kLetGo))); };
    if (skin) {
        in.colliders[1] = drive_of(std::make_shared<const MovingSurface>(
            move_surface(tree, skin(std::min(frame, kLetGo)), skin(std::min(frame + 1, kLetGo)))));
        in.pin_sources = {{at(frame), at(frame + 1), scene.rest.rest_position[0]}};
    } else if (motion) {
        in.sources = {{at(frame), at(frame + 1), scene.rest.rest_position[0], frame < kLetGo}};
        in.activations[0].comes = frame >= kLetGo;
    }
    if (!motion && !scene.activations.empty()) in.activations[0] = {frame >= 18, sweep};
    if (!scene.seams.empty()) {
        const double f = static_cast<double>(frame), share = std::min(1.0, f / 10);
        in.seams = {frame < 6 ? kNever : std::max(0.0, 1.6 - 0.1 * f), factors[0] + share * (factors[1] - factors[0]),
                    kNever};
    }
    if (frame > 0 && frame % 2 == 0 && frame / 2 <= blasts.size()) in.forces.push_back(blasts[frame / 2 - 1]);
    return in;
}

}  // namespace sunder::test
