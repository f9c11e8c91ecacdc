#include "solver/collision/piece_pairs.h"

#include <gtest/gtest.h>

#include <random>

#include "solver/collision/detection.h"
#include "solver/motion.h"

namespace sunder {
namespace {

// Pieces of 40 ellipsoids each, in no order, that fall, spin, wobble and meet; and some single ones.
struct Flight {
    static constexpr uint32_t kPieces = 6, kEach = 40, kSingle = 30;
    std::vector<Ellipsoid> particles;
    std::vector<uint32_t> piece, slot, slot_end;
    std::vector<Vec3> velocity, angular_velocity, own;
    std::mt19937_64 rng{8};
    double h = 1.0 / 48;

    double number() { return std::uniform_real_distribution<double>(-1, 1)(rng); }
    Vec3 vector() { return Vec3(number(), number(), number()); }

    Flight() {
        for (uint32_t i = 0; i < kPieces * kEach + kSingle; ++i) {
            const bool single = i >= kPieces * kEach;
            piece.push_back(single ? kPieces + i - kPieces * kEach : i % kPieces);
            const Vec3 center = single ? Vec3(3 * vector()) : Vec3(2.5 * (piece[i] % 3), 2.5 * (piece[i] / 3), 0);
            particles.push_back({center + (single ? 0 : 1) * vector(), rotation_of(vector()).toRotationMatrix(),
                                 Vec3::Constant(0.2) + 0.1 * vector().cwiseAbs()});
            own.push_back(vector());
            slot.push_back(i), slot_end.push_back(i + 1);
        }
        velocity.resize(particles.size()), angular_velocity.resize(particles.size());
    }
    // Velocities of a rigid motion and, as a share of it, of each particle's own.
    void set_velocities(double spin, double wobble) {
        for (uint32_t i = 0; i < particles.size(); ++i) {
            const uint32_t p = piece[i];
            const Vec3 center(2.5 * (p % 3), 2.5 * (p / 3), 0), w = p < kPieces ? Vec3(spin * own[p]) : Vec3::Zero();
            angular_velocity[i] = w;
            velocity[i] = Vec3(0, 0, -12) + 4 * own[p] + w.cross(particles[i].center - center) + wobble * own[i];
        }
    }
    void move() {
        for (size_t i = 0; i < particles.size(); ++i) {
            particles[i].center += h * velocity[i];
            particles[i].axes = rotation_of(h * angular_velocity[i]) * particles[i].axes;
        }
    }
    DetectionInput input() const {
        DetectionInput in;
        in.particles = particles;
        in.rings = {slot, slot_end, slot, {}, {}};
        in.velocity = velocity, in.angular_velocity = angular_velocity;
        in.duration = h, in.margin = 0.01;
        return in;
    }
};

void expect_same(const std::vector<Contact>& x, const std::vector<Contact>& y) {
    ASSERT_EQ(x.size(), y.size());
    for (size_t k = 0; k < x.size(); ++k)
        EXPECT_TRUE(x[k].a == y[k].a && x[k].b == y[k].b && x[k].gap == y[k].gap && x[k].normal == y[k].normal) << k;
}

TEST(piece_pairs, knowing_the_pieces_changes_no_contact) {
    const WorkerPool workers(3);
    for (const double spin : {0.0, 10.0, 60.0}) {
        Flight f;
        ContactScratch kept;
        std::vector<Contact> with, without;
        size_t total = 0;
        for (int step = 0; step < 12; ++step) {
            f.set_velocities(spin, 2);
            DetectionInput in = f.input();
            ContactScratch fresh;
            find_contacts(in, fresh, without);
            in.piece = f.piece, in.workers = &workers;
            find_contacts(in, kept, with);
            expect_same(with, without);
            total += with.size();
            f.move();
        }
        EXPECT_GT(total, 12 * 100u);
    }
}

TEST(piece_pairs, a_body_that_falls_and_spins_as_a_whole_finds_its_pairs_once) {
    Flight f;
    ContactScratch kept;
    std::vector<Contact> contacts;
    const uint32_t p = 0;
    for (int step = 0; step < 40; ++step) {
        const Quat turn = rotation_of(Vec3(0.02, 0.1, 0.05));
        const Vec3 center(0, 0, -0.25 * step);
        for (uint32_t i = 0; i < f.particles.size(); ++i) {
            if (f.piece[i] != p) continue;
            const Vec3 to = center + turn * (f.particles[i].center - center) + Vec3(0, 0, -0.25);
            f.velocity[i] = (to - f.particles[i].center) / f.h;
            f.angular_velocity[i] = Vec3::Zero();
        }
        DetectionInput in = f.input();
        in.piece = f.piece;
        find_contacts(in, kept, contacts);
        for (uint32_t i = 0; i < f.particles.size(); ++i)
            if (f.piece[i] == p) f.particles[i].center += f.h * f.velocity[i];
    }
    EXPECT_EQ(kept.within.n_rebuilds(), 1u * Flight::kPieces);
}

}  // namespace
}  // namespace sunder
