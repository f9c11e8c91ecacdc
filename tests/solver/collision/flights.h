// Pieces on their way: what tests of remembered pairs look for contacts in.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "solver/collision/detection.h"
#include "solver/scene/motion.h"
#include "tests/solver/collision/collision_cases.h"

namespace sunder {

// Pieces of 40 ellipsoids each, in no order, that fall, spin, wobble and meet; and some single ones.
struct Flight {
    static constexpr uint32_t kPieces = 6, kEach = 40, kSingle = 30;
    std::vector<Ellipsoid> particles;
    mutable EllipsoidArrays arrays;  // of them, for input()
    std::vector<PieceId> piece;
    std::vector<ParticleId> slot;  // members of rings
    std::vector<uint32_t> slot_begin, slot_end;
    std::vector<Vec3> velocity, angular_velocity, own;
    std::mt19937_64 rng{8};
    double h = 1.0 / 48;

    double number() { return std::uniform_real_distribution<double>(-1, 1)(rng); }
    Vec3 vector() { return Vec3(number(), number(), number()); }

    Flight() {
        for (uint32_t i = 0; i < kPieces * kEach + kSingle; ++i) {
            const bool single = i >= kPieces * kEach;
            piece.push_back(PieceId(single ? kPieces + i - kPieces * kEach : i % kPieces));
            const Vec3 center = single ? Vec3(3 * vector()) : Vec3(2.5 * (piece[i] % 3), 2.5 * (piece[i] / 3), 0);
            particles.push_back({center + (single ? 0 : 1) * vector(), rotation_of(vector()).toRotationMatrix(),
                                 Vec3::Constant(0.2) + 0.1 * vector().cwiseAbs()});
            own.push_back(vector());
            slot.push_back(ParticleId(i)), slot_begin.push_back(i), slot_end.push_back(i + 1);
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
        in.particles = arrays.of(particles);
        in.rings = {slot_begin, slot_end, slot, {}, {}};
        in.velocity = velocity, in.angular_velocity = angular_velocity;
        in.duration = h, in.margin = 0.01;
        return in;
    }
};

inline void expect_same(const std::vector<Contact>& x, const std::vector<Contact>& y) {
    ASSERT_EQ(x.size(), y.size());
    for (size_t k = 0; k < x.size(); ++k)
        EXPECT_TRUE(x[k].a == y[k].a && x[k].b == y[k].b && x[k].gap == y[k].gap && x[k].normal == y[k].normal) << k;
}

// A block whose edges break some at a time until it is crumbs.
struct Crumbling : Flight {
    std::vector<std::pair<uint32_t, uint32_t>> edges;

    explicit Crumbling(uint32_t side = 6) {  // particles along each
        particles.clear(), own.clear();
        for (uint32_t i = 0; i < side * side * side; ++i) {
            const Vec3 place(i % side, i / side % side, i / (side * side));
            particles.push_back({0.35 * place + 0.05 * vector(), rotation_of(vector()).toRotationMatrix(),
                                 Vec3::Constant(0.15) + 0.1 * vector().cwiseAbs()});
            own.push_back(vector());
            for (const uint32_t step : {1u, side, side * side})
                if (i / step % side + 1 < side) edges.push_back({i, i + step});
        }
        std::ranges::shuffle(edges, rng);
        velocity.assign(particles.size(), Vec3(0, 0, -3));
        angular_velocity.assign(particles.size(), Vec3::Zero());
        join();
    }
    void join() {  // as `edges` say
        const uint32_t n = static_cast<uint32_t>(particles.size());
        std::vector<std::vector<ParticleId>> ring(n);
        for (ParticleId i(0); i < n; ++i) ring[i].push_back(i);
        for (const auto& [a, b] : edges) ring[a].push_back(ParticleId(b)), ring[b].push_back(ParticleId(a));
        slot.clear(), slot_begin.clear(), slot_end.clear();
        for (auto& r : ring) {
            std::ranges::sort(r);
            slot_begin.push_back(static_cast<uint32_t>(slot.size()));
            slot.insert(slot.end(), r.begin(), r.end());
            slot_end.push_back(static_cast<uint32_t>(slot.size()));
        }
        piece.assign(n, PieceId::none());
        PieceId n_pieces(0);
        for (ParticleId seed(0); seed < n; ++seed) {
            if (!piece[seed].is_none()) continue;
            std::vector<ParticleId> front = {seed};
            piece[seed] = n_pieces;
            while (!front.empty()) {
                const ParticleId i = front.back();
                front.pop_back();
                for (const ParticleId j : ring[i])
                    if (piece[j].is_none()) piece[j] = n_pieces, front.push_back(j);
            }
            ++n_pieces;
        }
    }
    void break_some(size_t count) {
        edges.resize(edges.size() - std::min(edges.size(), count));
        join();
    }
    DetectionInput input() const {
        DetectionInput in = Flight::input();
        in.rings = {slot_begin, slot_end, slot, {}, {}};
        return in;
    }
    void expect_as_a_fresh_search(ContactScratch& kept, size_t& io_total) const {
        const WorkerPool workers(3);
        std::vector<Contact> with, without;
        DetectionInput in = input();
        ContactScratch fresh;
        find_contacts(in, fresh, without);
        in.piece = piece, in.workers = &workers;
        find_contacts(in, kept, with);
        expect_same(with, without);
        io_total += with.size();
    }
};

}  // namespace sunder
