// Contacts of whole scenes: complete, ordered, independent of memory and of ranges, and in time for the fast.
#include "solver/collision/detection.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/collision_cases.h"

namespace sunder {
namespace {

/// Owns what a DetectionInput looks at.
struct Case {
    std::vector<Ellipsoid> particles;
    mutable EllipsoidArrays arrays;  // of them, for input()
    std::vector<uint32_t> body;
    std::vector<Role> role;
    std::vector<PlacedShape> rigid_bodies;
    std::vector<Vec3> velocity, angular_velocity;
    std::vector<MovingShape> colliders;
    double duration = 1.0 / 192, margin = 1e-3;

    DetectionInput input() const {
        DetectionInput in;
        in.particles = arrays.of(particles);
        in.body = body;
        in.role = role;
        in.rigid_bodies = rigid_bodies;
        in.velocity = velocity;
        in.angular_velocity = angular_velocity;
        in.colliders = colliders;
        in.duration = duration;
        in.margin = margin;
        return in;
    }
    void add_particle(const Vec3& center, const Vec3& radii, const Vec3& v = Vec3::Zero()) {
        particles.push_back({center, Mat3::Identity(), radii});
        velocity.insert(velocity.begin() + particles.size() - 1, v);
    }
    void add_rigid(const Shape& shape, const Pose& pose, const Vec3& v = Vec3::Zero()) {
        rigid_bodies.push_back({shape, pose});
        velocity.push_back(v);
    }
};

std::vector<Contact> contacts_of(const Case& c) {
    ContactScratch scratch;
    std::vector<Contact> contacts;
    find_contacts(c.input(), scratch, contacts);
    return contacts;
}

void expect_same_bits(const std::vector<Contact>& x, const std::vector<Contact>& y) {
    ASSERT_EQ(x.size(), y.size());
    for (size_t k = 0; k < x.size(); ++k) {
        EXPECT_TRUE(x[k].a == y[k].a && x[k].b == y[k].b && x[k].gap == y[k].gap && x[k].normal == y[k].normal &&
                    x[k].point_a == y[k].point_a && x[k].point_b == y[k].point_b)
            << "contact " << k;
    }
}

void expect_ordered(const std::vector<Contact>& contacts) {
    EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(),
                               [](const Contact& x, const Contact& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; }));
    for (const Contact& c : contacts) {
        EXPECT_TRUE(c.b & Contact::kStatic || c.a < c.b);
        expect_whole({c.normal, c.point_a, c.point_b, c.gap}, 10);
    }
}

/// Tumbling ellipsoids, boxes, balls and every collider, all in one crowd.
Case crowd(uint64_t seed) {
    auto rng = generator(seed);
    Case c;
    for (int k = 0; k < 300; ++k) {
        Ellipsoid e = random_ellipsoid(rng, 1, 5);
        e.radii *= 0.1;
        c.particles.push_back(e);
        c.body.push_back(k % 3);
        c.role.push_back(k % 10 == 0 ? Role::held : Role::free);
        c.velocity.push_back(uniform3(rng, -10, 10));
    }
    for (int k = 0; k < 6; ++k)
        c.add_rigid(k % 2 ? sphere(0.2) : box(Vec3(0.1, 0.2, 0.5)), random_pose(rng, 1), uniform3(rng, -10, 10));
    for (size_t k = 0; k < c.velocity.size(); ++k) c.angular_velocity.push_back(uniform3(rng, -5, 5));
    for (const Shape& shape : std::vector{plane(), sphere(0.3), box(Vec3(0.2, 0.3, 0.4)), capsule(0.2, 0.5)}) {
        const Pose begin = random_pose(rng, 0.8);
        Pose end = begin;
        end.position += uniform3(rng, -0.05, 0.05);
        end.orientation = Quat(Eigen::AngleAxisd(0.1, random_direction(rng))) * end.orientation;
        c.colliders.push_back({shape, begin, end, true});
    }
    return c;
}

TEST(detection, resting_crowds_lose_no_contact) {
    Case c = crowd(41);
    for (Vec3& v : c.velocity) v.setZero();
    c.angular_velocity.clear();
    for (MovingShape& m : c.colliders) m.end = m.begin;
    const auto found = contacts_of(c);
    expect_ordered(found);
    const ParticleEllipsoids particles = c.input().particles;
    size_t expected = 0, on_movables = 0;
    for (uint32_t i = 0; i < 300; ++i) {
        for (uint32_t j = i + 1; j < 300; ++j) {
            const Separation s = ellipsoid_distance(particles[i], particles[j]);
            if (s.gap > c.margin || (c.role[i] != Role::free && c.role[j] != Role::free)) continue;
            ++expected;
            const auto at =
                std::find_if(found.begin(), found.end(), [&](const Contact& f) { return f.a == i && f.b == j; });
            ASSERT_NE(at, found.end()) << i << " " << j;
            EXPECT_EQ(at->gap, s.gap);
        }
        for (uint32_t r = 0; r < 6; ++r)
            expected += ellipsoid_shape_distance(particles[i], c.rigid_bodies[r]).gap <= c.margin;
        for (const MovingShape& m : c.colliders)
            expected +=
                c.role[i] == Role::free && ellipsoid_shape_distance(particles[i], {m.shape, m.begin}).gap <= c.margin;
    }
    for (const Contact& f : found) on_movables += f.a < 300;
    EXPECT_GT(expected, 300u);
    EXPECT_EQ(on_movables, expected);
}

TEST(detection, memory_of_earlier_steps_changes_no_bit) {
    Case c = crowd(42);
    ContactScratch kept;
    std::vector<Contact> contacts;
    size_t total = 0;
    for (int step = 0; step < 25; ++step) {
        for (size_t k = 0; k < c.particles.size(); ++k) c.particles[k].center += 0.02 * c.duration * c.velocity[k];
        for (size_t k = 0; k < c.rigid_bodies.size(); ++k)
            c.rigid_bodies[k].pose.position += 0.02 * c.duration * c.velocity[300 + k];
        find_contacts(c.input(), kept, contacts);
        expect_ordered(contacts);
        expect_same_bits(contacts, contacts_of(c));
        total += contacts.size();
    }
    EXPECT_GT(total, 25 * 300u);
}

TEST(detection, ranges_put_together_give_the_same_bits) {
    const Case c = crowd(43);
    const DetectionInput in = c.input();
    const size_t n = c.velocity.size();
    std::vector<Aabb> whole(n), parts(n);
    sweep_boxes(in, Vec3::Zero(), 0, n, whole);
    OverlapScratch scratch;
    std::vector<Pair> pairs;
    find_overlaps(whole, {}, WorkerPool(1), scratch, pairs);
    for (auto& [i, j] : pairs)
        if (i > j) std::swap(i, j);  // particles before rigid bodies
    std::vector<Contact> all, all_static;
    contacts_of_pairs(in, whole, pairs, all);
    contacts_with_colliders(in, 0, n, all_static);
    for (const size_t workers : {2, 3, 7, 16}) {
        std::vector<Contact> joined, joined_static;
        for (size_t w = 0; w < workers; ++w) {
            sweep_boxes(in, Vec3::Zero(), n * w / workers, n * (w + 1) / workers, parts);
            const size_t begin = pairs.size() * w / workers, end = pairs.size() * (w + 1) / workers;
            contacts_of_pairs(in, whole, std::span(pairs).subspan(begin, end - begin), joined);
            contacts_with_colliders(in, n * w / workers, n * (w + 1) / workers, joined_static);
        }
        for (size_t i = 0; i < n; ++i) EXPECT_TRUE(parts[i].min == whole[i].min && parts[i].max == whole[i].max);
        expect_same_bits(joined, all);
        expect_same_bits(joined_static, all_static);
    }
}

// What does not move is asked for less; what moves by less than any rounding is not.
TEST(detection, a_plane_that_stays_is_met_as_one_that_hardly_moves) {
    Case c = crowd(44);
    MovingShape plane;
    plane.shape.kind = ShapeKind::plane;
    plane.begin = {Vec3(0.1, -0.2, 0.4), Quat(Eigen::AngleAxisd(0.3, Vec3(1, 2, 0).normalized()))};
    plane.end = plane.begin;
    c.colliders = {plane};
    const std::vector<Contact> stays = contacts_of(c);
    c.colliders[0].end.position.x() = std::nextafter(0.1, 1);
    const std::vector<Contact> moves = contacts_of(c);
    ASSERT_EQ(moves.size(), stays.size());
    for (size_t k = 0; k < moves.size(); ++k) {
        EXPECT_TRUE(moves[k].a == stays[k].a && moves[k].b == stays[k].b) << k;
        EXPECT_NEAR(moves[k].gap, stays[k].gap, 1e-14);  // a few roundings of places of size 1
    }
    size_t n_static = 0;
    for (const Contact& contact : stays) n_static += (contact.b & Contact::kStatic) != 0;
    EXPECT_GT(n_static, 50u);
    EXPECT_LT(n_static, 300u);
}

// Sleepers that are woken make all other contacts of the search useless.
TEST(detection, a_search_that_may_end_sees_all_contacts_of_the_fixed_and_changes_no_other) {
    Case c = crowd(8);
    const std::vector<Contact> all = contacts_of(c);
    std::vector<uint8_t> fixed(c.velocity.size());
    for (size_t i = 0; i < fixed.size(); ++i) fixed[i] = i % 5 == 0;
    std::vector<Contact> expected;
    for (const Contact& contact : all)
        if (!(contact.b & Contact::kStatic) && fixed[contact.a] != fixed[contact.b]) expected.push_back(contact);
    ASSERT_GT(expected.size(), 5u);
    ASSERT_LT(expected.size(), all.size());
    for (bool ends : {false, true}) {
        DetectionInput in = c.input();
        std::vector<Contact> seen, contacts;
        in.fixed = fixed;
        in.ends = [&](std::span<const Contact> first) {
            seen.assign(first.begin(), first.end());
            return ends;
        };
        ContactScratch scratch;
        find_contacts(in, scratch, contacts);
        std::ranges::stable_sort(seen, {}, [](const Contact& x) { return std::pair(x.a, x.b); });
        expect_same_bits(seen, expected);
        std::ranges::stable_sort(contacts, {}, [](const Contact& x) { return std::pair(x.a, x.b); });
        expect_same_bits(contacts, ends ? expected : all);
    }
}

TEST(detection, nothing_in_the_scene_gives_no_contacts) {
    Case c;
    EXPECT_TRUE(contacts_of(c).empty());
    c.add_particle(Vec3::Zero(), Vec3::Ones());
    EXPECT_TRUE(contacts_of(c).empty());
    c.colliders.push_back({plane(), Pose(), Pose(), false});
    EXPECT_TRUE(contacts_of(c).empty()) << "an inactive collider is not there";
    c.colliders[0].active = true;
    ASSERT_EQ(contacts_of(c).size(), 1u);
    EXPECT_EQ(contacts_of(c)[0].b, Contact::kStatic | 0);
    c.role = {Role::held};
    EXPECT_TRUE(contacts_of(c).empty()) << "neither side can be pushed";
}

/// A plate of 9 x 9 x 1 balls, 0.05 m apart, at x = 0.3; a ball of radius 0.05 m at the origin flies along +x.
Case shot_at_plate(double speed, double h, bool as_rigid_body) {
    Case c;
    c.duration = h;
    for (int y = -4; y <= 4; ++y)
        for (int z = -4; z <= 4; ++z)
            c.add_particle(Vec3(0.3, 0.05 * y + 0.011, 0.05 * z + 0.007), Vec3::Constant(0.025));
    c.body.assign(81, 0);
    if (as_rigid_body) {
        c.add_rigid(sphere(0.05), Pose(), Vec3(speed, 0, 0));
    } else {
        c.add_particle(Vec3::Zero(), Vec3::Constant(0.05), Vec3(speed, 0, 0));
        c.body.push_back(1);
    }
    return c;
}

TEST(detection, a_projectile_that_crosses_a_plate_within_one_step_meets_its_front) {
    for (const bool as_rigid_body : {false, true})
        for (const double h : {1.0 / 192, 1.0 / 24}) {  // 1.04 m and 8.3 m a step: 10 and 83 diameters
            const Case c = shot_at_plate(200, h, as_rigid_body);
            size_t hits = 0;
            for (const Contact& k : contacts_of(c)) {
                if (k.b != 81) continue;
                ++hits;
                EXPECT_GT(k.normal.x(), 0);  // the plate is pushed on, the ball back
                EXPECT_GT(k.gap, 0);
                EXPECT_LT(k.gap - 200 * h * k.normal.x(), c.margin) << "would not be stopped";
                EXPECT_LT(k.point_a.x(), 0.3);  // touched on its front side
            }
            // Those within 0.075 m of the line of flight, and no other.
            size_t expected = 0;
            for (int i = 0; i < 81; ++i) expected += c.particles[i].center.tail<2>().norm() < 0.075 + c.margin;
            EXPECT_EQ(hits, expected);
            EXPECT_GE(hits, 4u);
        }
}

TEST(detection, what_passes_by_is_not_touched) {
    for (const double miss : {0.11, 0.09}) {
        Case c;
        c.duration = 1.0 / 24;
        c.add_particle(Vec3::Zero(), Vec3::Constant(0.05), Vec3(100, 0, 0));
        c.add_particle(Vec3(2, miss, 0), Vec3::Constant(0.05));
        EXPECT_EQ(contacts_of(c).size(), miss < 0.1 ? 1u : 0u);
    }
    Case c;  // short of it by more than the margin; then not
    c.duration = 0.01;
    c.add_particle(Vec3::Zero(), Vec3::Constant(0.05), Vec3(100, 0, 0));
    c.add_particle(Vec3(1.102, 0, 0), Vec3::Constant(0.05));
    EXPECT_TRUE(contacts_of(c).empty());
    c.particles[1].center.x() = 1.0999;
    EXPECT_EQ(contacts_of(c).size(), 1u);
    c.velocity[1] = Vec3(100, 0, 0);  // both fly alike
    EXPECT_TRUE(contacts_of(c).empty());
}

TEST(detection, falling_onto_every_collider_is_foreseen_from_above) {
    for (const Shape& shape : std::vector{plane(), sphere(0.1), box(Vec3(0.3, 0.3, 0.01)), capsule(0.05, 0.2)})
        for (const bool rigid_box : {false, true}) {
            Case c;
            c.duration = 1.0 / 24;
            if (rigid_box)
                c.add_rigid(box(Vec3(0.02, 0.05, 0.03)), {Vec3(0.01, 0.0, 1), Quat::Identity()}, Vec3(0, 0, -100));
            else
                c.add_particle(Vec3(0.01, 0.005, 1), Vec3(0.02, 0.05, 0.03), Vec3(0, 0, -100));
            c.colliders.push_back({shape, Pose(), Pose(), true});
            const auto contacts = contacts_of(c);
            ASSERT_GE(contacts.size(), 1u);
            for (const Contact& k : contacts) {
                EXPECT_EQ(k.a, 0u);
                EXPECT_EQ(k.b, Contact::kStatic | 0);
                EXPECT_GT(k.normal.z(), 0.5);
                EXPECT_GT(k.gap, 0.5);
            }
        }
}

TEST(detection, a_collider_that_sweeps_through_hits_what_stands_still) {
    for (const Shape& shape : std::vector{plane(), sphere(0.1), box(Vec3(0.3, 0.3, 0.01)), capsule(0.05, 0.2)}) {
        Case c;
        c.duration = 1.0 / 24;
        c.add_particle(Vec3::Zero(), Vec3::Constant(0.02));
        c.add_rigid(box(Vec3::Constant(0.02)), {Vec3(0.1, 0, 0), Quat::Identity()});
        c.colliders.push_back({shape, {Vec3(0, 0, -1), Quat::Identity()}, {Vec3(0, 0, 1), Quat::Identity()}, true});
        const auto contacts = contacts_of(c);
        ASSERT_GE(contacts.size(), 1u);
        EXPECT_EQ(contacts[0].a, 0u);
        EXPECT_GT(contacts[0].normal.z(), 0.9);
    }
    // A paddle turned by 90 degrees about the origin strikes what its tip passes.
    Case c;
    c.duration = 1.0 / 24;
    c.add_particle(Vec3(0.9, 0.3, 0), Vec3::Constant(0.05));
    c.add_particle(Vec3(0.9, -0.3, 0), Vec3::Constant(0.05));
    const Pose turned{Vec3::Zero(), Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()))};
    c.colliders.push_back({box(Vec3(1, 0.02, 0.2)), Pose(), turned, true});
    const auto contacts = contacts_of(c);
    ASSERT_EQ(contacts.size(), 1u);
    EXPECT_EQ(contacts[0].a, 0u);
    EXPECT_GT(contacts[0].normal.y(), 0.5);
}

TEST(detection, rigid_bodies_meet_with_all_corners) {
    Case c;
    c.add_rigid(box(Vec3::Ones()), {Vec3(0, 0, 1.0005), Quat::Identity()});
    c.add_rigid(box(Vec3::Ones()), {Vec3(0, 0, 3.001), Quat::Identity()});
    c.colliders.push_back({plane(), Pose(), Pose(), true});
    const auto contacts = contacts_of(c);
    ASSERT_EQ(contacts.size(), 8u);
    expect_ordered(contacts);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR((contacts[k].normal + Vec3::UnitZ()).norm(), 0, 1e-12);  // pushes a down
    for (int k = 4; k < 8; ++k) EXPECT_EQ(contacts[k].normal, Vec3::UnitZ());
}

TEST(detection, a_spinning_body_reaches_beyond_its_box) {
    Case c;
    c.duration = 1.0 / 24;
    c.add_particle(Vec3(0.5, 0.2, 0), Vec3::Constant(0.05));
    c.add_rigid(box(Vec3(1, 0.05, 0.05)), Pose());
    EXPECT_TRUE(contacts_of(c).empty());
    c.angular_velocity = {Vec3::Zero(), Vec3(0, 0, 10)};  // its arm travels 0.2 m there
    const auto contacts = contacts_of(c);
    ASSERT_EQ(contacts.size(), 1u);
    EXPECT_GT(contacts[0].normal.y(), 0.9);
}

}  // namespace
}  // namespace sunder
