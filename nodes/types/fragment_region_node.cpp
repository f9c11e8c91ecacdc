// fragment_region: makes a part of the fragments tougher, weaker, softer, heavier, or glues it.
#include <algorithm>

#include "fracture_tools/fragments/fragment_factors.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

Status check_fragment_region(const std::string& node, const Parameters& p) {
    const std::string region = p.text("region");
    if (region == "box" && (p.vector3("box_min").array() > p.vector3("box_max").array()).any())
        return node_error(node, "box_min", "lies beyond box_max", "each of its coordinates is at most that of box_max");
    if (region == "group" && p.text("group").empty()) return node_error(node, "group", "no vertex group is named");
    return {};
}

Result<std::vector<uint8_t>> select(CookContext& context, const FragmentSet& set, const Parameters& p) {
    const std::string region = p.text("region");
    std::vector<uint8_t> inside(set.fragments.size(), 0);
    if (region == "group") {
        const auto group = set.vertex_groups.find(p.text("group"));
        if (group == set.vertex_groups.end()) {
            std::string known;
            for (const auto& [name, unused] : set.vertex_groups) known += (known.empty() ? "" : ", ") + name;
            return context.error("group", "the fragments have no vertex group '" + p.text("group") + "'",
                                 known.empty() ? "they have none" : "permitted: " + known);
        }
        for (const FragmentId f : group->second) inside[f.index()] = 1;
        return inside;
    }
    const Vec3 low = p.vector3("box_min"), high = p.vector3("box_max"), center = p.vector3("center");
    const double radius = p.number("radius");
    for (size_t i = 0; i < inside.size(); ++i) {
        const Vec3& x = set.fragments[i].centroid;
        if (region == "box")
            inside[i] = (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
        else if (region == "sphere")
            inside[i] = (x - center).norm() <= radius;
        else if (region == "cluster")
            inside[i] = set.fragments[i].cluster == p.integer("cluster");
        else
            inside[i] = 1;
    }
    return inside;
}

Result<Value> cook_fragment_region(CookContext& context) {
    Result<std::shared_ptr<const FragmentSet>> fragments = context.input<FragmentSet>("fragments");
    if (!fragments) return fragments.error();
    const Parameters& p = context.parameters();
    FragmentSet set = **fragments;
    const Result<std::vector<uint8_t>> inside = select(context, set, p);
    if (!inside) return inside.error();
    if (std::ranges::count(*inside, uint8_t{1}) == 0)
        return context.error("region", "no fragment lies in it", "regions are tested against the fragments' centres");
    constexpr double kGlue = std::numeric_limits<double>::infinity();
    apply_region(*inside,
                 {.toughness = p.number("toughness"),
                  .yield = p.number("yield"),
                  .density = p.number("density"),
                  .interface_toughness = p.number_or("interface_toughness", kGlue)},
                 set);
    return make_value(std::move(set));
}

ParameterDescription factor(const char* name, const char* label, const char* sentence) {
    return {.name = name,
            .label = label,
            .min = kLeastFactor,
            .max = kMostFactor,
            .default_value = 1.0,
            .sentence = sentence};
}

}  // namespace

NodeType fragment_region_node() {
    NodeDescription d{.type = "fragment_region",
                      .label = "Fragment Region",
                      .category = "fracture",
                      .sentence =
                          "Makes a part of the fragments tougher, weaker, softer or heavier than their body, or "
                          "glues it. Several can follow one another: their factors multiply."};
    d.inputs = {{.name = "fragments",
                 .label = "Fragments",
                 .type = SocketType::fragments,
                 .sentence = "Of a cut or a lattice"}};
    d.outputs = {{.name = "fragments",
                  .label = "Fragments",
                  .type = SocketType::fragments,
                  .sentence = "The same, with factors"}};
    d.parameters = region_parameters(
        "Fragments whose centre lies in it, in the fragments' own coordinates. all: every one; box takes "
        "`box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`; cluster takes "
        "`cluster`",
        {"all", "box", "sphere", "group", "cluster"},
        "Vertex group of the mesh: fragments that own one of its vertices");
    d.parameters.insert(
        d.parameters.end(),
        {{.name = "cluster",
          .label = "Cluster",
          .type = ParameterType::integer,
          .min = 0,
          .default_value = 0,
          .sentence = "Number of a cluster, as pre-fracture gathered them",
          .needs = {{is("region", {"cluster"})}}},
         factor("toughness", "Toughness", "Factor on the body's toughness around the region's fragments"),
         factor("yield", "Yield", "Factor on the body's yield around the region's fragments"),
         factor("density", "Density", "Factor on the body's density in the region's fragments"),
         {.name = "interface_toughness",
          .label = "Interface Toughness",
          .min = kLeastFactor,
          .max = kMostFactor,
          .default_value = 1.0,
          .sentence =
              "Factor on the toughness of interfaces between two of the region's fragments, below 1 weak; null: "
              "glued, they never break",
          .nullable = true}});
    return {.description = d, .cook = cook_fragment_region, .check = check_fragment_region};
}

}  // namespace sunder
