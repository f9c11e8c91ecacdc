#include "nodes/bake_files/manifest.h"

#include "nodes/bake_files/bake_folder.h"
#include "nodes/graph/json.h"
#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

Manifest example() {
    Manifest m;
    m.graph = Json::parse(R"({"sunder": 1, "frame_rate": 24, "frame_range": [1, 3],
                              "nodes": {"a": {"type": "body", "toughness": 0.1}, "b": {"type": "mesh_file", "path": "x.obj"}}})");
    m.inputs = {{"b", "path", "x.obj", {10, 0xabcdef}}};
    m.keys = {{"a", 0xffffffffffffffffull}, {"b", 2}};
    m.frame_range = {1, 3};
    m.frames = {{1, {{"out", "state/s.0001.ply", {5, 0x12}}}}, {2, {{"out", "state/s.0002.ply", {6, 0x13}}}}};
    m.resume = {{"sim", "state/s.0002.ply", {6, 0x13}}};
    return m;
}

std::string text_of(const Manifest& m) { return to_json(m).dump(1); }

std::string fault_of(const Json& json) {
    const auto m = parse_manifest(json.dump(), "manifest.json");
    if (m) return "";
    EXPECT_EQ(m.error().code, ErrorCode::bad_input);
    return m.error().text();
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Manifest, comes_back_whole) {
    const auto m = parse_manifest(text_of(example()), "manifest.json");
    ASSERT_TRUE(m) << m.error().text();
    EXPECT_EQ(*m, example());
    EXPECT_TRUE(is_own_manifest(text_of(example())));
    EXPECT_TRUE(is_own_manifest(text_of(example()).substr(0, 60)));  // cut off, and still known as ours
    EXPECT_FALSE(is_own_manifest("{\"name\": \"web app\"}"));
}

TEST(Manifest, exports_come_back_and_may_be_absent) {
    Manifest with = example();
    with.exports = {{"out", "mesh/shot.pc2", {7, 0x14}}, {"out", "mesh/shot.obj", {}}};
    const auto m = parse_manifest(text_of(with), "manifest.json");
    ASSERT_TRUE(m) << m.error().text();
    EXPECT_EQ(*m, with);
    EXPECT_TRUE(listed_paths(*m).contains("mesh/shot.obj"));
    EXPECT_FALSE(to_json(example()).contains("exports"));
    Json json = to_json(with);
    json["exports"][0]["path"] = "../shot.pc2";
    EXPECT_TRUE(has(fault_of(json), "leaves the folder"));
}

TEST(Manifest, what_lies_between_frames_comes_back_in_its_order) {
    Manifest with = example();
    with.frames[1].before = {{1 + 1.0 / 3, {{"out", "state/s.0001_333.ply", {5, 0x14}}}},
                             {1 + 2.0 / 3, {{"out", "state/s.0001_667.ply", {5, 0x15}}}}};
    const auto m = parse_manifest(text_of(with), "manifest.json");
    ASSERT_TRUE(m) << m.error().text();
    EXPECT_EQ(*m, with);
    EXPECT_TRUE(listed_paths(*m).contains("state/s.0001_667.ply"));
    EXPECT_EQ(to_json(example()).dump().find("subframes"), std::string::npos);
    std::vector<double> frames;
    m->frames[1].for_each_file([&](double frame, const ManifestFile&) { frames.push_back(frame); });
    EXPECT_EQ(frames, (std::vector<double>{1 + 1.0 / 3, 1 + 2.0 / 3, 2}));
    for (const double wrong : {1.0, 0.5, 2.0, 1.9}) {
        Json json = to_json(with);
        json["frames"][1]["subframes"][0]["frame"] = wrong;
        EXPECT_TRUE(has(fault_of(json), "subframes")) << wrong;
    }
    Json json = to_json(with);
    json["frames"][1]["subframes"] = 3;
    EXPECT_TRUE(has(fault_of(json), "subframes"));
    json = to_json(with);
    json["frames"][1]["subframes"][1]["files"][0]["path"] = "../s.ply";
    EXPECT_TRUE(has(fault_of(json), "leaves the folder"));
}

TEST(Manifest, every_truncation_is_noticed) {
    const std::string whole = text_of(example());
    for (size_t n = 0; n < whole.size(); ++n) {
        const auto m = parse_manifest(whole.substr(0, n), "manifest.json");
        ASSERT_FALSE(m) << n;
        EXPECT_TRUE(has(m.error().text(), "--restart")) << m.error().text();
    }
}

TEST(Manifest, every_missing_field_is_named) {
    const Json whole = to_json(example());
    for (const auto& [name, unused] : whole.items()) {
        Json without = whole;
        without.erase(name);
        if (name == "format")
            EXPECT_TRUE(has(fault_of(without), "not the manifest"));
        else
            EXPECT_TRUE(has(fault_of(without), name)) << name;
    }
}

TEST(Manifest, wrong_types_are_refused) {
    const auto with = [](const char* pointer, const Json& value) {
        Json json = to_json(example());
        json[Json::json_pointer(pointer)] = value;
        return fault_of(json);
    };
    EXPECT_TRUE(has(with("/frames/0/files/0/size", -5), "size"));
    EXPECT_TRUE(has(with("/frames/0/files/0/size", 1.5), "size"));
    EXPECT_TRUE(has(with("/frames/0/files/0/size", "5"), "size"));
    EXPECT_TRUE(has(with("/frames/0/files/0/hash", "xyz"), "hash"));
    EXPECT_TRUE(has(with("/frames/0/files/0/hash", 7), "hash"));
    EXPECT_TRUE(has(with("/frames/0", 3), "frame"));
    EXPECT_TRUE(has(with("/frames/1/frame", 3), "lists frame 3"));  // a gap
    EXPECT_TRUE(has(with("/frames/1/frame", 1), "lists frame 1"));  // twice
    EXPECT_TRUE(has(with("/frames/0/frame", 99999999999), "frame"));
    EXPECT_TRUE(has(with("/frame_range", {1, 1}), "lists frame 2"));  // beyond the range
    EXPECT_TRUE(has(with("/frame_range", {1}), "frame_range"));
    EXPECT_TRUE(has(with("/graph", 3), "graph"));
    EXPECT_TRUE(has(with("/graph/nodes", 3), "graph"));
    EXPECT_TRUE(has(with("/graph/nodes/list", {0.0, 0.4}), "graph"));  // it differed from itself
    EXPECT_TRUE(has(with("/graph/frame_range", "1:4"), "graph"));
    EXPECT_TRUE(has(with("/format", "sunder manifest 2"), "does not know"));
}

TEST(Manifest, paths_that_leave_the_folder_are_refused) {
    for (const char* path : {"../x.ply", "/etc/passwd", "a/../../x", "a//b", "./a", "a/", "", "a\\b", ".."}) {
        Json json = to_json(example());
        json["frames"][0]["files"][0]["path"] = path;
        EXPECT_TRUE(has(fault_of(json), "leaves the folder")) << path;
        EXPECT_FALSE(is_path_inside(path)) << path;
    }
    EXPECT_TRUE(is_path_inside("..a/b..c"));
}

TEST(Manifest, differences_are_named) {
    const auto one = [](void (*change)(Manifest&)) {
        Manifest wanted = example();
        change(wanted);
        const auto all = differences(example(), wanted);
        return all.size() == 1 ? all[0] : std::to_string(all.size()) + " differences";
    };
    EXPECT_TRUE(differences(example(), example()).empty());
    EXPECT_EQ(one([](Manifest& m) { m.graph["nodes"]["a"]["toughness"] = 0.2; }),
              "node 'a', 'toughness': 0.1 was baked, now 0.2");
    EXPECT_EQ(one([](Manifest& m) { m.graph["nodes"]["a"]["x"] = 1; }), "node 'a', 'x': nothing was baked, now 1");
    EXPECT_EQ(one([](Manifest& m) { m.graph["nodes"].erase("a"); }), "node 'a' is no longer there");
    EXPECT_EQ(one([](Manifest& m) { m.graph["nodes"]["c"] = {{"type", "pin"}}; }), "node 'c' is new");
    EXPECT_EQ(one([](Manifest& m) { m.inputs[0].stamp.hash ^= 1; }), "node 'b': the file 'x.obj' has changed");
    EXPECT_EQ(one([](Manifest& m) { m.keys["a"] = 1; }), "node 'a' gives something else now");
    EXPECT_TRUE(has(one([](Manifest& m) { m.version = "9"; }), "this is 9"));
    EXPECT_TRUE(has(one([](Manifest& m) { m.graph["frame_rate"] = 25; }), "frame_rate"));
    EXPECT_TRUE(has(one([](Manifest& m) { m.graph["frame_range"][0] = 0; }), "began"));
    // A later last frame only extends the bake.
    Manifest longer = example();
    longer.frame_range[1] = 9, longer.graph["frame_range"][1] = 9;
    EXPECT_TRUE(differences(example(), longer).empty());
}

TEST(Manifest, verify_finds_what_is_missing_changed_or_cut) {
    TemporaryFolder folder;
    Manifest m = example();
    for (auto& frame : m.frames)
        for (auto& f : frame.files) spill(folder / f.path, "frame " + f.path), f.stamp = stamp_of("frame " + f.path);
    m.resume = {{"sim", m.frames[1].files[0].path, m.frames[1].files[0].stamp}};
    m.frame_range = {1, 2};
    const auto faults = [&] {
        const auto check = verify_files(m, folder.path());
        EXPECT_TRUE(check);
        std::string all;
        for (const std::string& f : check->faults) all += f + "\n";
        return all;
    };
    EXPECT_EQ(faults(), "");
    spill(folder / "state/s.0001.ply", "frame state/s.0001.plX");
    EXPECT_TRUE(has(faults(), "state/s.0001.ply: its contents have changed"));
    spill(folder / "state/s.0001.ply", "fra");
    EXPECT_TRUE(has(faults(), "state/s.0001.ply: has 3 bytes"));
    std::filesystem::remove(folder / "state/s.0001.ply");
    EXPECT_TRUE(has(faults(), "state/s.0001.ply: no such file"));
    m.frame_range = {1, 5};
    EXPECT_TRUE(has(faults(), "frames 3 to 5"));
}

}  // namespace
}  // namespace sunder
