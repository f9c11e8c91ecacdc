#include "nodes/files/state_file.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

struct Example {
    SimulationMesh rest;
    FrameState state;
};

// Three particles of two bodies with numbers that a sloppy format would lose: denormal, -0, infinite yield.
Example example() {
    Example e;
    const size_t n = 3;
    e.rest.rest_position.resize(n);
    e.rest.body = {0, 0, 1};
    e.rest.fragment = {0, 1, 0};
    const ParticleId first(0), second(1), third(2);
    e.rest.edges = {{first, second, 0.5}, {second, third, 0.25}};
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> number(-1e3, 1e3);
    const auto vec = [&] { return Vec3(number(random), number(random), number(random)); };
    const auto quat = [&] { return Quat(number(random), number(random), number(random), number(random)); };
    FrameState& s = e.state;
    s.time = 0.1 + 0.2;
    for (size_t i = 0; i < n; ++i) {
        s.position.push_back(vec()), s.orientation.push_back(quat());
        s.velocity.push_back(vec()), s.angular_velocity.push_back(vec());
        Mat3 m;
        for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = number(random);  // not symmetric: rows must not become columns
        s.plastic_deformation.push_back(m);
        s.yield.push_back(number(random)), s.strain.push_back(number(random));
        s.group_rotation.push_back(quat());
    }
    s.position[0].x() = 4.9e-324, s.velocity[1].y() = -0.0;
    s.yield[1] = std::numeric_limits<double>::infinity();
    s.edge_intact = {1, 0};
    s.rigid_bodies = {{vec(), quat(), vec(), vec()}};
    s.broken = {{EdgeId(1), 0.125, 0.3}};
    s.contacts = {{second, MovableId(0x80000000u), vec(), 12.5, vec(), vec()}};
    s.still_time = {0.25, 0.5, 0.1, 0.0}, s.rest_load = {0, 12.5, 0, 0}, s.asleep = {0, 1, 0, 0};
    s.rest_conditions = {0xfedcba9876543210u, 7};
    return e;
}

std::string bytes_of(const Example& e, int frame = 24) {
    return std::string(encode_state(frame, e.state, e.rest).view());
}

std::string fault_of(const std::string& bytes) {
    const auto file = decode_state(bytes, "sim.0024.ply");
    if (file) return "";
    EXPECT_EQ(file.error().code, ErrorCode::bad_input);
    EXPECT_EQ(file.error().where, "sim.0024.ply");
    return file.error().what;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(StateFile, every_bit_comes_back) {
    const Example e = example();
    const auto file = decode_state(bytes_of(e), "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->frame, 24);
    EXPECT_EQ(file->state, e.state);
    EXPECT_EQ(state_hash(file->state), state_hash(e.state));  // tells -0 from 0, which == does not
    EXPECT_EQ(file->body, e.rest.body);
    EXPECT_EQ(file->fragment, e.rest.fragment);
    EXPECT_TRUE(require_same_scene(*file, e.rest, "a"));
    EXPECT_EQ(bytes_of({e.rest, file->state}), bytes_of(e));
}

TEST(StateFile, what_is_bent_comes_back) {
    Example e = example();
    for (size_t i = 0; i < e.state.n_particles(); ++i) {
        e.state.plastic_curvature.push_back(2 * e.state.plastic_deformation[i]);
        e.state.layer_strain.emplace_back();
        for (size_t k = 0; k < e.state.layer_strain[i].size(); ++k)
            e.state.layer_strain[i][k] = 0.1 * static_cast<double>(k) + static_cast<double>(i);
    }
    e.state.edge_offset.resize(e.state.edge_intact.size());
    e.state.yielding_rate.resize(e.state.n_particles());
    const size_t plain = bytes_of(e).size();
    EXPECT_EQ(decode_state(bytes_of(e), "a")->state, e.state);
    for (const bool is_kept : {false, true}) {  // beside what an `activate` node keeps, too
        if (is_kept) e.state.inactive.resize(e.state.n_particles());
        for (size_t i = 0; i < e.state.edge_offset.size(); ++i)
            for (MemberOffset& end : e.state.edge_offset[i])
                end = {Vec3(0.1, -0.2, static_cast<double>(i)), Vec3(1e-3, 0, -0.5)};
        const auto file = decode_state(bytes_of(e), "a");
        ASSERT_TRUE(file) << file.error().text();
        EXPECT_EQ(file->state, e.state);
        EXPECT_EQ(state_hash(file->state), state_hash(e.state));
        EXPECT_EQ(bytes_of({e.rest, file->state}), bytes_of(e));
        EXPECT_GT(bytes_of(e).size(), plain);
    }
    for (size_t i = 0; i < e.state.n_particles(); ++i) e.state.yielding_rate[i] = 0.5 + static_cast<double>(i);
    const auto yielding = decode_state(bytes_of(e), "a");
    ASSERT_TRUE(yielding) << yielding.error().text();
    EXPECT_EQ(yielding->state, e.state);
    EXPECT_EQ(state_hash(yielding->state), state_hash(e.state));
    e.state.yielding_rate[1] = -1e-9;
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "yielding 1: is less than 0"));
    e.state.yielding_rate[1] = 0;
    e.state.edge_offset[1][0].turn.z() = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "offset 1: brz is not finite"));
    e.state.edge_offset[1][0].turn.z() = 0;
    e.state.layer_strain[1][3] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "bending 1: layer3 is not finite"));
}

TEST(StateFile, what_is_kept_comes_back_in_the_middle_of_its_wait) {
    Example e = example();
    e.state.inactive = {{Inactivity::kHeld | Inactivity::kTouched, {HUGE_VAL, HUGE_VAL}, 0.1, 4.9e-324},
                        {Inactivity::kAsleep | Inactivity::kGlued, {0.75, HUGE_VAL}, 0, 0},
                        {0, {0.1 + 0.2, -0.0}, -0.0, 3}};
    const std::string bytes = bytes_of(e);
    const auto file = decode_state(bytes, "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, e.state);
    EXPECT_EQ(state_hash(file->state), state_hash(e.state));
    EXPECT_EQ(bytes_of({e.rest, file->state}), bytes);
    EXPECT_NE(state_hash(e.state), state_hash(example().state));
    for (size_t n = 0; n < bytes.size(); n += 7) EXPECT_NE(fault_of(bytes.substr(0, n)), "");
    e.state.broken.clear(), e.state.inactive[1].what = 16;
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "inactive 1: nothing keeps it as 16"));
    e.state.inactive[1] = {Inactivity::kHeld, {std::nan(""), 1}, 0, 0};
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "inactive 1: due is not finite"));
    e.state.inactive[1] = {Inactivity::kHeld, {1, 1}, HUGE_VAL, 0};
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "inactive 1: push is not finite"));
    e.state.inactive.pop_back();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "tells what keeps 2 particles, of 3"));
}

TEST(StateFile, toughness_comes_back_behind_all_else) {
    Example e = example();
    e.state.inactive.resize(e.state.n_particles());
    std::vector<double> toughness = {0.05, std::numeric_limits<double>::infinity(), 0};
    const auto encoded = [&] { return std::string(encode_state(24, e.state, e.rest, {24}, toughness).view()); };
    const auto file = decode_state(encoded(), "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->toughness, toughness);
    EXPECT_EQ(file->state, e.state);
    EXPECT_TRUE(decode_state(bytes_of(e), "a")->toughness.empty());
    toughness[2] = std::nan("");
    EXPECT_TRUE(has(fault_of(encoded()), "strength 2: toughness is not finite"));
}

TEST(StateFile, scaled_time_comes_back_and_plain_time_takes_no_room) {
    const Example e = example();
    EXPECT_EQ(encode_state(24, e.state, e.rest, {24, 1}).view(), bytes_of(e));
    for (const SceneTime at : {SceneTime{3.75, 0.1}, SceneTime{24, 0.5}, SceneTime{-2, 1}}) {
        const std::string bytes(encode_state(24, e.state, e.rest, at).view());
        const auto file = decode_state(bytes, "a");
        ASSERT_TRUE(file) << file.error().text();
        EXPECT_EQ(file->frame, 24);
        EXPECT_EQ(file->at, at);
        EXPECT_EQ(file->state, e.state);
    }
    for (const SceneTime at : {SceneTime{std::nan(""), 1}, SceneTime{1e9, 1}, SceneTime{3, -1}})
        EXPECT_NE(fault_of(std::string(encode_state(24, e.state, e.rest, at).view())), "");
    EXPECT_EQ(decode_state(bytes_of(e), "a")->at, SceneTime{24});
}

TEST(StateFile, what_lies_between_two_frames_comes_back) {
    const Example e = example();
    for (const auto& [frame, at] : {std::pair(12.25, SceneTime{12.25}), {-3 + 1.0 / 3, SceneTime{-2.5, 0.5}}}) {
        const std::string bytes(encode_state(frame, e.state, e.rest, at).view());
        const auto file = decode_state(bytes, "a");
        ASSERT_TRUE(file) << file.error().text();
        EXPECT_EQ(file->frame, frame);
        EXPECT_EQ(file->at, at);
        EXPECT_EQ(file->state, e.state);
        EXPECT_EQ(std::string(encode_state(file->frame, file->state, e.rest, file->at).view()), bytes);
        EXPECT_NE(fault_of(bytes.substr(0, bytes.size() - 1)), "");
    }
}

TEST(StateFile, what_is_damaged_comes_back_bent_or_not) {
    for (const bool is_bent : {false, true}) {
        Example e = example();
        if (is_bent) {
            e.state.plastic_curvature.assign(e.state.n_particles(), Mat3::Identity());
            e.state.layer_strain.resize(e.state.n_particles());
            e.state.edge_offset.resize(e.state.edge_intact.size());
            e.state.yielding_rate.resize(e.state.n_particles());
        }
        for (size_t i = 0; i < e.state.edge_intact.size(); ++i) {
            e.state.edge_damage.push_back(0.1 + 0.01 * static_cast<double>(i));
            e.state.edge_hold.push_back(0.7 - 0.01 * static_cast<double>(i));
        }
        e.state.stiffness_factor.assign(e.state.n_particles(), 1.25);
        const auto file = decode_state(bytes_of(e), "a");
        ASSERT_TRUE(file) << file.error().text();
        EXPECT_EQ(file->state, e.state);
        EXPECT_EQ(state_hash(file->state), state_hash(e.state));
        EXPECT_EQ(bytes_of({e.rest, file->state}), bytes_of(e));
        e.state.edge_hold[0] = std::numeric_limits<double>::quiet_NaN();
        EXPECT_TRUE(has(fault_of(bytes_of(e)), "damage 0: hold is not finite"));
    }
}

TEST(StateFile, an_empty_state_comes_back) {
    const auto file = decode_state(bytes_of({}), "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, FrameState());
}

// Bakes of former versions can be gone on with: nothing in them sleeps.
TEST(StateFile, frames_of_former_versions_are_awake) {
    Example e = example();
    const std::string load = "property double load\n",
                      torque = "property double tx\nproperty double ty\nproperty double tz\n";
    const std::string rest = "element rest 0\nproperty double still_time\nproperty uchar asleep\n";
    const std::string condition = "element rest_condition 0\nproperty int low\nproperty int high\n";
    const auto erase = [](std::string& text, const std::string& part) {
        ASSERT_TRUE(has(text, part));
        text.erase(text.find(part), part.size());
    };
    e.state.still_time.clear(), e.state.rest_load.clear(), e.state.asleep.clear(), e.state.rest_conditions.clear();
    for (ContactMemory& c : e.state.contacts) c.rolling_torque.setZero();
    std::string bytes = bytes_of(e);
    erase(bytes, load), erase(bytes, torque);
    // The one contact is followed by the clock only.
    const size_t clock = sizeof(int32_t) + sizeof(double), torques = 3 * sizeof(double);
    bytes.erase(bytes.size() - clock - torques, torques);
    bytes[bytes.find("state frame 3") + 12] = '2';
    auto file = decode_state(bytes, "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, e.state);

    // One particle of version 2 that slept: a time and a byte each.
    std::string slept = bytes;
    slept.replace(slept.find("element rest 0"), 14, "element rest 4");
    for (int i = 0; i < 4; ++i) slept += std::string(8, '\0') + (i == 1 ? '\1' : '\0');
    file = decode_state(slept, "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, e.state);

    erase(bytes, rest), erase(bytes, condition);
    bytes[bytes.find("state frame 2") + 12] = '1';
    file = decode_state(bytes, "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, e.state);
}

TEST(StateFile, tells_why_edges_broke_where_that_is_known) {
    Example e = example();
    e.state.broken = {{EdgeId(0), 0.125, 0.3, 0.25, {Pusher::Kind::rigid_body, 0}},
                      {EdgeId(1), 0.125, -0.4, 0.25, {}},
                      {EdgeId(1), 0.125, 0, 0, {Pusher::Kind::seam, 2}}};
    const std::string bytes = bytes_of(e);
    EXPECT_TRUE(has(bytes, "comment sunder state frame 6\n"));
    const auto file = decode_state(bytes, "a");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->state, e.state);
    EXPECT_EQ(state_hash(file->state), state_hash([&] {
                  FrameState before = e.state;
                  for (BrokenEdge& b : before.broken) b.toughness = 0, b.by = {};
                  return before;
              }()));
    for (const Pusher by :
         {Pusher{Pusher::Kind::rigid_body, 1}, Pusher{Pusher::Kind::particle, 3}, Pusher{Pusher::Kind::nothing, 0}}) {
        e.state.broken[0].by = by;
        EXPECT_TRUE(has(fault_of(bytes_of(e)), "cause 0: there is no thing"));
    }
    for (size_t n = 0; n < bytes.size(); n += 7) EXPECT_NE(fault_of(bytes.substr(0, n)), "");
}

TEST(StateFile, keeps_the_columns_that_scripts_rely_on) {
    const std::string text = bytes_of(example());
    std::string expected = "element particle 3\n";
    for (const char* name :
         {"x",  "y",    "z",    "qw",   "qx",   "qy",   "qz",   "vx",   "vy",   "vz",   "wx",    "wy",
          "wz", "fp00", "fp01", "fp02", "fp10", "fp11", "fp12", "fp20", "fp21", "fp22", "yield", "strain"})
        expected += std::string("property double ") + name + "\n";
    expected +=
        "property int body\nproperty int fragment\nelement edge 2\nproperty int a\nproperty int b\nproperty uchar "
        "intact\n";
    EXPECT_TRUE(has(text, expected));
    EXPECT_TRUE(text.starts_with("ply\nformat binary_little_endian 1.0\ncomment sunder state frame 3\n"));
}

TEST(StateFile, every_truncation_is_noticed) {
    const std::string whole = bytes_of(example());
    for (size_t n = 0; n < whole.size(); ++n)
        ASSERT_NE(fault_of(whole.substr(0, n)), "") << n << " of " << whole.size() << " bytes";
    EXPECT_NE(fault_of(whole + '\0'), "");
}

TEST(StateFile, damaged_bytes_never_crash_and_never_give_edges_without_particles) {
    const std::string whole = bytes_of(example());
    std::mt19937 random(1);
    for (int round = 0; round < 20'000; ++round) {
        std::string bytes = whole;
        for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
        const auto file = decode_state(bytes, "a");
        if (!file) continue;
        ASSERT_EQ(file->edges.size(), file->state.edge_intact.size());
        ASSERT_EQ(file->state.group_rotation.size(), file->state.n_particles());
        for (const auto& [a, b] : file->edges) ASSERT_TRUE(a < b && b < file->state.n_particles());
        for (const BrokenEdge& b : file->state.broken) ASSERT_LT(b.edge, file->edges.size());
    }
}

TEST(StateFile, numbers_gone_bad_are_named) {
    Example e = example();
    e.state.velocity[2].z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "particle 2: vz is not finite"));
    e = example();
    e.state.yield[0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "particle 0: yield is not finite"));
    e = example();
    e.state.strain[0] = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "particle 0: strain is not finite"));
    e = example();
    e.state.rigid_bodies[0].position.x() = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(has(fault_of(bytes_of(e)), "rigid_body 0: x is not finite"));
}

TEST(StateFile, foreign_frames_are_refused) {
    EXPECT_TRUE(has(fault_of("solid"), "not a PLY file"));
    EXPECT_TRUE(has(fault_of("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nend_header\n"),
                    "no state frame"));
    std::string later = bytes_of(example());
    later.replace(later.find("state frame 3"), 13, "state frame 9");
    EXPECT_TRUE(has(fault_of(later), "does not know"));
    std::string other = bytes_of(example());
    other.replace(other.find("double vx"), 9, "double ux");
    EXPECT_TRUE(has(fault_of(other), "'particle'"));
}

TEST(StateFile, a_frame_of_another_scene_is_told_from_ours) {
    const Example e = example();
    const auto file = decode_state(bytes_of(e), "a");
    ASSERT_TRUE(file);
    SimulationMesh other = e.rest;
    other.fragment[1] = 5;
    EXPECT_TRUE(has(require_same_scene(*file, other, "a").error().what, "particle 1"));
    other = e.rest;
    other.edges[0].b = ParticleId(2);
    EXPECT_TRUE(has(require_same_scene(*file, other, "a").error().what, "edge 0"));
    other = e.rest;
    other.edges.pop_back();
    EXPECT_TRUE(has(require_same_scene(*file, other, "a").error().what, "2 edges instead of 1"));
}

}  // namespace
}  // namespace sunder
