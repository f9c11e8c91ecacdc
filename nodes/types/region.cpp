#include "nodes/types/region.h"

#include "fracture_tools/fragments/fragment_factors.h"

namespace sunder {

Status check_box(const std::string& node, const Parameters& p) {
    if ((p.vector3("box_min").array() <= p.vector3("box_max").array()).all()) return {};
    return node_error(node, "box_min", "lies beyond box_max", "each of its coordinates is at most that of box_max");
}

Status check_region(const std::string& node, const Parameters& p) {
    const std::string region = p.text("region");
    if (region == "box")
        if (Status ok = check_box(node, p); !ok) return ok;
    if (region == "group" && p.text("group").empty()) return node_error(node, "group", "no vertex group is named");
    return {};
}

std::string known_groups(const FragmentSet& set) {
    std::string known;
    for (const auto& [name, unused] : set.vertex_groups) known += (known.empty() ? "" : ", ") + name;
    return known.empty() ? "they have none" : "permitted: " + known;
}

Result<std::vector<uint8_t>> in_region(const CookContext& context, const FragmentSet& set,
                                       std::span<const Vec3> centers, const Parameters& p) {
    const std::string region = p.text("region");
    std::vector<uint8_t> inside(centers.size(), 0);
    if (region == "group") {
        const auto group = set.vertex_groups.find(p.text("group"));
        if (group == set.vertex_groups.end())
            return context.error("group", "the fragments have no vertex group '" + p.text("group") + "'",
                                 known_groups(set));
        for (const FragmentId f : group->second) inside[f.index()] = 1;
        return inside;
    }
    const Vec3 low = p.vector3("box_min"), high = p.vector3("box_max"), center = p.vector3("center");
    const double radius = p.number("radius");
    for (size_t i = 0; i < inside.size(); ++i) {
        const Vec3& x = centers[i];
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

ParameterDescription factor_parameter(const char* name, const char* label, const char* sentence) {
    return {.name = name,
            .label = label,
            .min = kLeastFactor,
            .max = kMostFactor,
            .default_value = 1.0,
            .sentence = sentence};
}

void add_region(const Parameters& p, KeyHasher& io_hasher) {
    io_hasher.add(p.text("region")).add(p.text("group")).add(p.number("radius"));
    for (const char* name : {"box_min", "box_max", "center"}) io_hasher.add(p.vector3(name));
}

}  // namespace sunder
