// body_region: factors on a body's material in a part of it, which may change with time.
#include <algorithm>
#include <map>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/region.h"

namespace sunder {
namespace {

// An automatic fracture energy keeps its length L = 2 G_c / (E toughness^2); a given one is what it is told to be.
RegionValue scaled(const RegionValue& before, bool energy_is_automatic, const Parameters& p) {
    RegionValue region = before;
    Material& m = region.material;
    const double toughness = p.number("toughness"), stiffness = p.number("stiffness");
    m.toughness *= toughness, m.compressive_toughness *= toughness;
    m.fracture_energy *= p.number("fracture_energy");
    if (energy_is_automatic) m.fracture_energy *= toughness * toughness * stiffness;
    m.youngs_modulus *= stiffness;
    m.stiffness = std::min(1.0, m.stiffness * stiffness);
    m.yield *= p.number("yield"), region.yield_factor *= p.number("yield");
    return region;
}

// Those of former regions that this one cuts are divided: each part of it has one of its own.
void divide_regions(const std::vector<uint8_t>& inside, const Parameters& p, BodyValue& io_body) {
    if (io_body.region.empty()) io_body.region.assign(inside.size(), 0);
    std::map<uint32_t, uint32_t> parts;  // by the former region
    for (size_t i = 0; i < inside.size(); ++i) {
        if (!inside[i]) continue;
        uint32_t& region = io_body.region[i];
        const auto [part, is_new] = parts.try_emplace(region, static_cast<uint32_t>(io_body.regions.size() + 1));
        if (is_new) {
            const RegionValue whole{io_body.material, 1};
            const RegionValue& former = region > 0 ? io_body.regions[region - 1] : whole;
            io_body.regions.push_back(scaled(former, io_body.energy_is_automatic, p));
        }
        region = part->second;
    }
}

Result<Value> cook_body_region(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> input = context.input<BodyValue>("body");
    if (!input) return input.error();
    BodyValue body = **input;
    const Parameters& p = context.parameters();
    const Result<std::vector<uint8_t>> inside = in_region(context, *body.fragments, body.rest->rest_position, p);
    if (!inside) return inside.error();
    if (std::ranges::count(*inside, uint8_t{1}) == 0)
        return context.error("region", "no fragment of body '" + body.name + "' lies in it",
                             "regions are tested against the fragments' centres");
    divide_regions(*inside, p, body);
    for (const RegionValue& region : body.regions)
        if (Status ok = region.material.check("node '" + context.node() + "'"); !ok) return ok.error();
    return make_value(std::move(body));
}

ParameterDescription keyed(ParameterDescription factor) {
    factor.animatable = true;
    return factor;
}

}  // namespace

NodeType body_region_node() {
    NodeDescription d{.type = "body_region",
                      .label = "Body Region",
                      .category = "simulation",
                      .sentence =
                          "Makes a part of a body tougher, weaker, softer or stiffer, for all of the shot or with "
                          "time; nothing is cut anew. Several can follow one another: their factors multiply."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "Of which it is a part"}};
    d.outputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The same, with factors"}};
    d.parameters = region_parameters(
        "Fragments whose centre lies in it, with the body as placed at the first frame. all: every "
        "one; box takes `box_min` and `box_max`; sphere takes `center` and `radius`; group takes "
        "`group`; cluster takes `cluster`",
        {"all", "box", "sphere", "group", "cluster"},
        "Vertex group of the mesh: fragments that own one of its vertices");
    d.parameters.insert(
        d.parameters.end(),
        {cluster_parameter(), keyed(factor_parameter("toughness", "Toughness", "Factor on the body's toughnesses")),
         keyed(factor_parameter("yield", "Yield",
                                "Factor on the body's yield, and on what yields have grown to by hardening")),
         keyed(factor_parameter("stiffness", "Stiffness", "Factor on the body's Young's modulus")),
         keyed(factor_parameter("fracture_energy", "Fracture Energy",
                                "Factor on the body's fracture energy; an automatic one goes with `toughness` squared "
                                "and `stiffness`, too"))});
    return {.description = d, .cook = cook_body_region, .check = check_region};
}

}  // namespace sunder
