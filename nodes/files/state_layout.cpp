#include "nodes/files/state_layout.h"

#include <string>

namespace sunder {
namespace {

constexpr const char* kPlacement = "x y z qw qx qy qz vx vy vz wx wy wz";
constexpr const char* kPlastic = "fp00 fp01 fp02 fp10 fp11 fp12 fp20 fp21 fp22";
constexpr size_t kElementsOfVersion1 = 7;  // without what sleeps

std::vector<PlyProperty> operator+(std::vector<PlyProperty> a, const std::vector<PlyProperty>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

std::vector<PlyProperty> doubles(std::string_view names) { return ply_scalars(names, PlyType::float64); }
std::vector<PlyProperty> ints(std::string_view names) { return ply_scalars(names, PlyType::int32); }
std::vector<PlyProperty> bytes(std::string_view names) { return ply_scalars(names, PlyType::uint8); }

}  // namespace

std::vector<PlyElement> state_elements(std::string_view version) {
    const bool is_latest = knows_rest(version);
    const auto contact = doubles(is_latest ? "px py pz force fx fy fz tx ty tz" : "px py pz force fx fy fz");
    std::vector<PlyElement> elements = {
        {"particle", 0, doubles(kPlacement) + doubles(kPlastic) + doubles("yield strain") + ints("body fragment")},
        {"edge", 0, ints("a b") + bytes("intact")},
        {"group", 0, doubles("qw qx qy qz")},
        {"rigid_body", 0, doubles(kPlacement)},
        {"broken_edge", 0, ints("edge") + doubles("time strain")},
        {"contact", 0, ints("a b") + contact},
        {"clock", 0,
         (version == kSubFrameStateFileMagic ? doubles("frame") : ints("frame")) +
             doubles(knows_scale(version) ? "time simulated_frame time_scale" : "time")},
        {"rest", 0, doubles(is_latest ? "still_time load" : "still_time") + bytes("asleep")},
        {"rest_condition", 0, ints("low high")}};
    if (version == kStateFileMagic1) elements.resize(kElementsOfVersion1);
    if (knows_bending(version)) {
        std::string names = "kp00 kp01 kp02 kp10 kp11 kp12 kp20 kp21 kp22";
        for (size_t i = 0; i < std::tuple_size_v<LayerStrain>; ++i) names += " layer" + std::to_string(i);
        elements.push_back({"bending", 0, doubles(names)});
    }
    if (knows_damage(version)) {
        elements.push_back({"damage", 0, doubles("damage hold")});
        elements.push_back({"stiffness", 0, doubles("factor")});
    }
    if (knows_cause(version)) elements.push_back({"cause", 0, doubles("toughness") + bytes("kind") + ints("by")});
    return elements;
}

std::vector<PlyElement> last_state_elements() {
    return {{"inactive", 0, bytes("what") + doubles("due glue_due push former_push")},
            {"followed", 0, doubles("until")},
            {"offset", 0, doubles("bx by bz brx bry brz ax ay az arx ary arz")},
            {"strength", 0, doubles("toughness")},
            {"yielding", 0, doubles("rate")}};
}

}  // namespace sunder
