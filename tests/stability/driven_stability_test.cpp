// Shots drawn at random in which colliders are driven: a vise, a hammer, a blade that goes round, a roller, and a
// piston between four walls. Nothing that they meet may leave like a bullet.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>

#include "solver/scene/scales.h"
#include "tests/stability/random_shot.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

enum Drive { vise, hammer, blade, roller, piston };
constexpr int kDrives = 5;

constexpr double kRate = 24;  // frames a second
// What slips out of a wedge goes faster than what drives it, by one over its slope.
constexpr double kOfDrive = 8;

Quat about(const Vec3& axis, double angle) { return Quat(Eigen::AngleAxisd(angle, axis)); }

// From 0 to 1, slowly at both ends.
double ramp(double t) { return 0.5 - 0.5 * std::cos(M_PI * std::clamp(t, 0.0, 1.0)); }

Shape box(const Vec3& half_extents) {
    Shape s;
    s.kind = ShapeKind::box, s.half_extents = half_extents;
    return s;
}

struct Driven : test::Shot {
    using Path = std::function<Pose(double frame)>;

    int frames;
    double size = 0;            // of a body, m
    double fastest_driven = 0;  // m/s
    std::vector<Path> paths;    // of the colliders after the floor

    Driven(uint64_t seed, int n_frames) : Shot(seed), frames(n_frames) {
        for (const Vec3& x : scene.rest.rest_position) size = std::max(size, x.norm());
        for (Body& b : scene.bodies) b.velocity *= 0.1, b.angular_velocity *= 0.1;
    }
    void add(const Shape& shape, const Path& path) {
        Collider c;
        c.name = "driven " + std::to_string(scene.colliders.size()), c.shape = shape, c.friction = material.friction;
        scene.colliders.push_back(c), paths.push_back(path);
        const double arm = shape.kind == ShapeKind::box ? shape.half_extents.norm() : shape.radius + shape.half_height;
        for (double frame = 0; frame < frames; frame += 0.25) {
            const Pose a = path(frame), b = path(frame + 1e-3);
            const double way = (b.position - a.position).norm(), turn = a.orientation.angularDistance(b.orientation);
            fastest_driven = std::max(fastest_driven, 1e3 * kRate * (way + arm * turn));
        }
    }
    // The fastest that anything ever was, over the fastest that may be: so many times what drives, where it is fastest,
    // and a fall by twice the body's size; or c times the largest strain that there was, as what was strained so
    // springs back.
    double fastest() const {
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state(materials());
        FrameInput in = input();
        const SimulationMesh& rest = solver->scene().rest;
        const double c = wave_speed(material.youngs_modulus, rest.volume[0], rest.mass[0]);
        double fastest = 0, strain = 0;
        for (int frame = 0; frame < frames; ++frame) {
            for (size_t k = 0; k < paths.size(); ++k)
                in.colliders[k + 1] = {paths[k](frame), paths[k](frame + 1), true};
            const auto report = solver->advance(in, settings, state);
            EXPECT_TRUE(report) << (report ? "" : report.error().text());
            if (!report) break;
            for (const Vec3& v : state.velocity) fastest = std::max(fastest, v.norm());
            strain = std::max(strain, std::ranges::max(state.strain));
        }
        return fastest / std::max(kOfDrive * (fastest_driven + std::sqrt(4 * gravity * size)), c * strain);
    }
};

// Down to a tenth to six tenths of the body.
struct Press : Driven {
    explicit Press(uint64_t seed) : Driven(seed, 36) {
        scene.rigid_bodies.clear();
        test::Draw draw(seed + 777);
        Shape head = box(size * Vec3(1.5, 1.5, 0.1));
        if (draw.one_in(3)) head.kind = ShapeKind::sphere, head.radius = 0.3 * size;
        const double top = 1.35 * size, low = size * (0.1 + draw.uniform(0, 0.5)), stroke = draw.of({12., 24., 36.});
        add(head, [=](double frame) {
            return Pose{Vec3(0, 0, top + (low - top) * ramp(frame / stroke)), Quat::Identity()};
        });
    }
};

struct Machine : Driven {
    Vec3 middle;

    Machine(Drive drive, uint64_t seed) : Driven(seed, 48) {
        test::Draw draw(seed + 31337);
        if (!draw.one_in(4)) scene.rigid_bodies.clear();
        size /= 1.7;
        middle = size * Vec3(0.15, 0.15, 0.5);
        switch (drive) {
            case vise:
                add_vise(draw);
                break;
            case hammer:
                add_hammer(draw);
                break;
            case blade:
                add_blade(draw);
                break;
            case roller:
                add_roller(draw);
                break;
            case piston:
                add_piston(draw);
                break;
        }
    }

private:
    void add_vise(test::Draw& draw) {
        const double gap = size * draw.uniform(0.05, 0.4), period = draw.of({12., 24., 36.});
        const Vec3 axis = about(Vec3::UnitZ(), draw.uniform(0, 3)) * Vec3::UnitX();
        const Quat turned = Quat::FromTwoVectors(Vec3::UnitX(), axis);
        for (const double side : {-1., 1.})
            add(box(size * Vec3(0.1, 1.2, 1.2)), [=, this](double frame) {
                const double x = 1.5 * size + (gap - 1.5 * size) * ramp((frame - 8) / period);
                return Pose{middle + side * (x + 0.1 * size) * axis, turned};
            });
    }
    void add_hammer(test::Draw& draw) {
        const double way = std::sqrt(size) * draw.logarithmic(3, 40) / kRate;  // a frame, m
        Shape head = box(size * Vec3(0.3, 0.3, 0.15));
        if (draw.one_in(2)) head.kind = ShapeKind::sphere, head.radius = 0.25 * size;
        const double y = draw.uniform(-0.2, 0.3), x = draw.uniform(-0.2, 0.3);
        const Vec3 low(middle.x() + size * x, middle.y() + size * y, size * draw.uniform(0.15, 0.5));
        add(head, [=](double frame) {
            return Pose{low + way * std::abs(frame - 16) * Vec3::UnitZ(), Quat::Identity()};
        });
    }
    void add_blade(test::Draw& draw) {
        const double turn = 2 * M_PI * draw.logarithmic(0.3, 8) / kRate;  // a frame, rad
        const Vec3 from(middle.x() + 2.5 * size, middle.y(), size * draw.uniform(0.2, 0.8));
        add(box(size * Vec3(1.2, 0.05, 0.2)), [=, this](double frame) {
            return Pose{from - 1.5 * size * ramp(frame / 24) * Vec3::UnitX(), about(Vec3::UnitZ(), turn * frame)};
        });
    }
    void add_roller(test::Draw& draw) {
        const double radius = 0.3 * size, height = radius + size * draw.uniform(0.05, 0.5);
        const double way = std::sqrt(size) * draw.logarithmic(1, 10) / kRate;  // a frame, m
        Shape drum;
        drum.kind = ShapeKind::capsule, drum.radius = radius, drum.half_height = 2 * size;
        const Quat lying = about(Vec3::UnitX(), M_PI / 2);
        add(drum, [=, this](double frame) {
            return Pose{Vec3(way * frame - 2 * size, 0, height), about(Vec3::UnitY(), way * frame / radius) * lying};
        });
    }
    void add_piston(test::Draw& draw) {
        const double half = size * draw.uniform(0.7, 1);
        for (int k = 0; k < 4; ++k) {
            const Quat turned = about(Vec3::UnitZ(), k * M_PI / 2);
            const Pose stays{middle + (half + 0.2 * size) * (turned * Vec3::UnitX()), turned};
            add(box(size * Vec3(0.2, 1.5, 3)), [=](double) { return stays; });
        }
        const double low = size * draw.uniform(0.1, 0.5), period = draw.of({12., 24., 36.});
        add(box(Vec3(half, half, 0.1 * size)), [=, this](double frame) {
            const double z = 6 * size + (low - 5.9 * size) * ramp(frame / period);
            return Pose{Vec3(middle.x(), middle.y(), z), Quat::Identity()};
        });
    }
};

/// How fast a shot gets hangs on rounding: shot 1137 is 2.6 to 9.5 times as fast as its press with a stiffness that
/// differs by billionths, and was 2.7 to 8.0 with libm's functions. What a mechanism throws it throws however it is
/// rounded: beyond the bound the median of five roundings counts.
template <class Make>
double fastest(const Make& make) {
    std::array<double, 5> speed;
    for (int k = 0; k < 5; ++k) {
        auto shot = make();
        shot.material.youngs_modulus *= 1 + 1e-9 * k;
        speed[k] = shot.fastest();
        if (k == 0 && speed[0] <= 1) return speed[0];
    }
    std::ranges::sort(speed);
    return speed[2];
}

TEST(driven, a_press_throws_nothing_like_a_bullet) {
    double most = 0;
    const auto check = [&](uint64_t seed, bool fades) {
        SCOPED_TRACE("shot " + std::to_string(seed));
        const double speed = fastest([&] {
            Press shot(seed);
            if (!fades) shot.material.fracture_energy = kNever;
            return shot;
        });
        EXPECT_LE(speed, 1);
        most = std::max(most, speed);
    };
    for (uint64_t seed = 0; seed < 60; ++seed) check(seed, true);
    for (uint64_t seed : {144, 165, 277, 298, 313, 370,  391,  428,  619,  635,  689,  742, 766,
                          795, 882, 924, 946, 988, 1034, 1055, 1137, 1170, 1338, 1387, 1393})
        check(seed, false);  // once 8 to 570 times press and fall, before edges faded
    std::printf("fastest, over what may be: %.2f\n", most);
}

TEST(driven, machines_throw_nothing_like_a_bullet) {
    std::array<double, kDrives> most{};
    const auto check = [&](Drive drive, uint64_t seed) {
        SCOPED_TRACE("drive " + std::to_string(drive) + ", shot " + std::to_string(seed));
        const double speed = fastest([&] { return Machine(drive, seed); });
        EXPECT_LE(speed, 1);
        most[drive] = std::max(most[drive], speed);
    };
    for (uint64_t seed = 0; seed < 50; ++seed) check(static_cast<Drive>(seed % kDrives), seed);
    check(blade, 656), check(hammer, 1999), check(hammer, 2065);  // once 26, 34 and 61 times
    std::printf("fastest, over what may be: vise %.2f, hammer %.2f, blade %.2f, roller %.2f, piston %.2f\n", most[vise],
                most[hammer], most[blade], most[roller], most[piston]);
}

}  // namespace
}  // namespace sunder
