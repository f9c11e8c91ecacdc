// fragment_region: makes a part of the fragments tougher, weaker, softer, heavier, or glues it.
#include <algorithm>

#include "fracture_tools/fragments/fragment_factors.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/region.h"

namespace sunder {
namespace {

Result<Value> cook_fragment_region(CookContext& context) {
    Result<std::shared_ptr<const FragmentSet>> fragments = context.input<FragmentSet>("fragments");
    if (!fragments) return fragments.error();
    const Parameters& p = context.parameters();
    FragmentSet set = **fragments;
    std::vector<Vec3> centers;
    for (const Fragment& f : set.fragments) centers.push_back(f.centroid);
    const Result<std::vector<uint8_t>> inside = in_region(context, set, centers, p);
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
        {cluster_parameter(),
         factor_parameter("toughness", "Toughness", "Factor on the body's toughness around the region's fragments"),
         factor_parameter("yield", "Yield", "Factor on the body's yield around the region's fragments"),
         factor_parameter("density", "Density", "Factor on the body's density in the region's fragments"),
         {.name = "interface_toughness",
          .label = "Interface Toughness",
          .min = kLeastFactor,
          .max = kMostFactor,
          .default_value = 1.0,
          .sentence =
              "Factor on the toughness of interfaces between two of the region's fragments, below 1 weak; null: "
              "glued, they never break",
          .nullable = true}});
    return {.description = d, .cook = cook_fragment_region, .check = check_region};
}

}  // namespace sunder
