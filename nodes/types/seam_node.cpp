// seam: tells interfaces of a body when to break.
#include <algorithm>
#include <cmath>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/region.h"

namespace sunder {
namespace {

double distance_to_line(const Vec3& x, const Vec3& from, const Vec3& to) {
    const Vec3 along = to - from;
    const double length = along.squaredNorm();
    const double share = length > 0 ? std::clamp(along.dot(x - from) / length, 0.0, 1.0) : 0;
    return (x - from - share * along).norm();
}

double distance_to_curve(const Vec3& x, const std::vector<Vec3>& points) {
    double least = (x - points.front()).norm();
    for (size_t k = 1; k < points.size(); ++k) least = std::min(least, distance_to_line(x, points[k - 1], points[k]));
    return least;
}

// Where an edge's interface is, in the scene.
Vec3 place_of(const BodyValue& body, const Edge& edge) {
    const std::pair<uint32_t, uint32_t> wanted(edge.a, edge.b);
    const auto key = [](const Interface& i) { return std::pair<uint32_t, uint32_t>(i.a, i.b); };
    const auto found = std::ranges::lower_bound(body.fragments->interfaces, wanted, {}, key);
    if (found != body.fragments->interfaces.end() && key(*found) == wanted) return body.pose.apply(found->centroid);
    return 0.5 * (body.rest->rest_position[edge.a] + body.rest->rest_position[edge.b]);
}

// 1 of the fragments of one group, 2 of those of the other, 3 of both. Without another it is all that is not in the
// one.
Result<std::vector<uint8_t>> sides(const CookContext& context, const FragmentSet& set, const Parameters& p) {
    std::vector<uint8_t> side(set.fragments.size(), 0);
    for (const auto& [parameter, bit] : {std::pair("group", 1), std::pair("other_group", 2)}) {
        const std::string name = p.text(parameter);
        if (name.empty()) continue;
        const auto found = set.vertex_groups.find(name);
        if (found == set.vertex_groups.end())
            return context.error(parameter, "the fragments have no vertex group '" + name + "'", known_groups(set));
        for (const FragmentId f : found->second) side[f.index()] |= static_cast<uint8_t>(bit);
    }
    if (p.text("other_group").empty())
        for (uint8_t& s : side) s |= s == 0 ? 2 : 0;
    return side;
}

Result<std::vector<EdgeId>> edges_of(const CookContext& context, const BodyValue& body, const Parameters& p) {
    const std::string between = p.text("between");
    const std::vector<Edge>& edges = body.rest->edges;
    const FragmentSet& set = *body.fragments;
    std::vector<EdgeId> chosen;
    std::vector<uint8_t> side;
    if (between == "groups") {
        Result<std::vector<uint8_t>> found = sides(context, set, p);
        if (!found) return found.error();
        side = found.take();
    }
    const std::vector<Vec3> points = p.points("points");
    const auto is_in = [&](const Edge& e) {
        if (between == "groups") return ((side[e.a] & 1) && (side[e.b] & 2)) || ((side[e.a] & 2) && (side[e.b] & 1));
        if (between == "clusters") return set.fragments[e.a].cluster != set.fragments[e.b].cluster;
        return between == "all" || distance_to_curve(place_of(body, e), points) < p.number("distance");
    };
    for (EdgeId e(0); e < edges.size(); ++e)
        if (is_in(edges[e])) chosen.push_back(e);
    return chosen;
}

double factor_at(double frame, const Parameters& p) {
    const int when = p.integer("frame");
    if (p.text("mode") == "hold") return frame < when ? kNever : 1;
    const double since = frame - when, over = p.integer("frames");
    if (since >= over) return 0;
    return since > 0 ? 1 - since / over : 1;
}

Result<Value> cook_seam(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> input = context.input<BodyValue>("body");
    if (!input) return input.error();
    BodyValue body = **input;
    const Parameters& p = context.parameters();
    Result<std::vector<EdgeId>> edges = edges_of(context, body, p);
    if (!edges) return edges.error();
    if (edges->empty())
        body.warnings.push_back("seam '" + context.node() + "' has no interface: none of body '" + body.name +
                                "' lies there");
    KeyHasher hasher;
    hasher.add(context.node()).add(edges->size());
    for (const EdgeId e : *edges) hasher.add(e.value);
    body.seams.push_back({hasher.key(), {context.node(), edges.take()}, factor_at(context.frame(), p)});
    return make_value(std::move(body));
}

Status check_seam(const std::string& node, const Parameters& p) {
    if (p.text("between") == "groups" && p.text("group").empty())
        return node_error(node, "group", "no vertex group is named");
    if (p.text("between") == "curve" && p.points("points").empty())
        return node_error(node, "points", "there are none", "give one or more");
    return {};
}

std::vector<ParameterDescription> place_parameters() {
    return {{.name = "between",
             .label = "Between",
             .type = ParameterType::choice,
             .default_value = "clusters",
             .sentence = "Which interfaces: groups: of fragments of `group` with those of `other_group`; clusters: of "
                         "different clusters; curve: nearer than `distance` to the line through `points`; all",
             .choices = {"groups", "clusters", "curve", "all"}},
            {.name = "group",
             .label = "Group",
             .type = ParameterType::text,
             .default_value = "",
             .sentence = "Vertex group of the mesh: fragments that own one of its vertices",
             .needs = {{is("between", {"groups"})}}},
            {.name = "other_group",
             .label = "Other Group",
             .type = ParameterType::text,
             .default_value = "",
             .sentence = "Likewise; empty: all that are not in the one",
             .needs = {{is("between", {"groups"})}}},
            {.name = "points",
             .label = "Points",
             .type = ParameterType::points,
             .unit = "m",
             .min = -1e6,
             .max = 1e6,
             .default_value = JsonValue::empty_list(),
             .sentence = "Of the line, in the scene, with the body as placed at the first frame",
             .needs = {{is("between", {"curve"})}}},
            {.name = "distance",
             .label = "Distance",
             .unit = "m",
             .min = 0,
             .max = 1e5,
             .min_excluded = true,
             .default_value = 0.1,
             .sentence = "From the line to the middle of an interface",
             .needs = {{is("between", {"curve"})}}}};
}

}  // namespace

NodeType seam_node() {
    NodeDescription d{.type = "seam",
                      .label = "Seam",
                      .category = "simulation",
                      .sentence =
                          "Tells interfaces of a body when to break, or not to. Several can follow one another; "
                          "what one holds no other breaks."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "Whose interfaces these are"}};
    d.outputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The same, with the seam"}};
    d.parameters = {
        {.name = "mode",
         .label = "Mode",
         .type = ParameterType::choice,
         .default_value = "break",
         .sentence = "break: they break at `frame`, or weaken from there on; hold: they cannot break before",
         .choices = {"break", "hold"}}};
    std::ranges::move(place_parameters(), std::back_inserter(d.parameters));
    d.parameters.push_back({.name = "frame",
                            .label = "Frame",
                            .type = ParameterType::integer,
                            .default_value = 1,
                            .sentence = "At which they are broken; from which on they may break"});
    d.parameters.push_back({.name = "frames",
                            .label = "Over",
                            .type = ParameterType::integer,
                            .unit = "frames",
                            .min = 0,
                            .max = 100000,
                            .default_value = 0,
                            .sentence = "How long it takes from that frame on: a factor on their toughness falls to 0, "
                                        "where what is left of them breaks; 0: at once",
                            .needs = {{is("mode", {"break"})}}});
    return {.description = d, .cook = cook_seam, .check = check_seam, .depends_on_frame = true};
}

}  // namespace sunder
