#include "nodes/types/chosen_edges.h"

#include <algorithm>
#include <functional>

#include "nodes/graph/body_edges.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/types/region.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kRounding = 1e-9;  // of cosines, -: an angle of 0 takes what is parallel but for its last bits

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

// Points of which the nearest is looked for.
class Points {
public:
    explicit Points(std::vector<Vec3> points) : by_x_(std::move(points)) {
        std::ranges::sort(by_x_, {}, [](const Vec3& p) { return p.x(); });
    }
    /// To the nearest one that is nearer than `most`; `most` where none is, m.
    double distance(const Vec3& x, double most) const {
        auto p = std::ranges::lower_bound(by_x_, x.x() - most, {}, [](const Vec3& at) { return at.x(); });
        for (; p != by_x_.end() && p->x() < x.x() + most; ++p) most = std::min(most, (x - *p).norm());
        return most;
    }

private:
    std::vector<Vec3> by_x_;
};

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

using Chooser = std::function<bool(const Edge&, const InterfacePlace&)>;

Result<Chooser> chooser_of(const CookContext& context, const BodyValue& body, const Parameters& p) {
    const std::string between = p.text("between");
    if (between == "groups") {
        Result<std::vector<uint8_t>> found = sides(context, *body.fragments, p);
        if (!found) return found.error();
        return Chooser([side = found.take()](const Edge& e, const InterfacePlace&) {
            return ((side[e.a] & 1) && (side[e.b] & 2)) || ((side[e.a] & 2) && (side[e.b] & 1));
        });
    }
    if (between == "clusters")
        return Chooser([&fragments = body.fragments->fragments](const Edge& e, const InterfacePlace&) {
            return fragments[e.a].cluster != fragments[e.b].cluster;
        });
    if (between == "curve")
        return Chooser(
            [points = p.points("points"), most = p.number("distance")](const Edge&, const InterfacePlace& place) {
                return distance_to_curve(place.middle, points) < most;
            });
    if (between == "places")
        return Chooser([points = Points(p.points("points")), spared = Points(p.points("spared")),
                        most = p.number("distance")](const Edge&, const InterfacePlace& place) {
            const double near = points.distance(place.middle, most);
            return near < most && spared.distance(place.middle, near) == near;
        });
    if (between == "box")
        return Chooser(
            [low = p.vector3("box_min"), high = p.vector3("box_max")](const Edge&, const InterfacePlace& place) {
                return (place.middle.array() >= low.array()).all() && (place.middle.array() <= high.array()).all();
            });
    if (between == "sphere")
        return Chooser(
            [center = p.vector3("center"), radius = p.number("radius")](const Edge&, const InterfacePlace& place) {
                return (place.middle - center).norm() <= radius;
            });
    return Chooser([](const Edge&, const InterfacePlace&) { return true; });
}

// What every choice is narrowed by.
class Filter {
public:
    explicit Filter(const Parameters& p) : least_(p.number("least_area")), most_(p.number_or("most_area", kNever)) {
        if (p.is_null("angle")) return;
        direction_ = p.vector3("direction").normalized();
        least_cosine_ = math::cos(radians(Vec3::Constant(p.number("angle"))).x()) - kRounding;
    }
    bool passes(const InterfacePlace& place) const {
        return place.share >= least_ && place.share <= most_ && std::abs(place.normal.dot(direction_)) >= least_cosine_;
    }

private:
    double least_, most_;
    Vec3 direction_ = Vec3::Zero();
    double least_cosine_ = 0;
};

std::vector<ParameterDescription> filter_parameters() {
    ParameterDescription direction =
        needing({{is_not_null("angle")}}, direction_parameter(Animation::constant, "direction", "Direction",
                                                              "That `angle` is measured from; either of its two ways"));
    return {
        {.name = "angle",
         .label = "Angle",
         .unit = "degrees",
         .min = 0,
         .max = 90,
         .default_value = nullptr,
         .sentence = "Only interfaces whose normal is at most so far from `direction`: 0 takes those that lie across "
                     "it, 90 all; null: all",
         .nullable = true,
         .group = "Only"},
        in_group("Only", std::move(direction)),
        {.name = "least_area",
         .label = "Least Area",
         .min = 0,
         .max = 1e6,
         .default_value = 0.0,
         .sentence = "Only interfaces of at least this area, as a share of its fragments' cross-section",
         .group = "Only"},
        {.name = "most_area",
         .label = "Most Area",
         .min = 0,
         .max = 1e6,
         .default_value = nullptr,
         .sentence = "Only interfaces of at most this area, likewise; null: however large",
         .nullable = true,
         .group = "Only"}};
}

// Of a region, but for the choice itself and its group.
std::vector<ParameterDescription> box_and_sphere_parameters() {
    std::vector<ParameterDescription> all = region_parameters({}, {}, {}), kept;
    for (const auto& [name, choice] : {std::pair("box_min", "box"), std::pair("box_max", "box"),
                                       std::pair("center", "sphere"), std::pair("radius", "sphere")}) {
        ParameterDescription& p = at(all, name);
        kept.push_back(needing({{is("between", {choice})}}, std::move(p)));
    }
    return kept;
}

}  // namespace

std::vector<ParameterDescription> interface_parameters() {
    std::vector<ParameterDescription> all = {
        {.name = "between",
         .label = "Between",
         .type = ParameterType::choice,
         .default_value = "clusters",
         .sentence =
             "Which interfaces: groups: of fragments of `group` with those of `other_group`; clusters: of "
             "different clusters; curve: nearer than `distance` to the line through `points`; all; box takes "
             "`box_min` and `box_max`; sphere takes `center` and `radius`; places: nearer than `distance` to "
             "one of `points`, and to none of `spared` nearer still. What counts is an interface's middle, with "
             "the body as placed at the first frame",
         .choices = {"groups", "clusters", "curve", "all", "box", "sphere", "places"}},
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
         .sentence = "Of the line, or places, in the scene, with the body as placed at the first frame",
         .needs = {{is("between", {"curve", "places"})}}},
        {.name = "spared",
         .label = "Spared",
         .type = ParameterType::points,
         .unit = "m",
         .min = -1e6,
         .max = 1e6,
         .default_value = JsonValue::empty_list(),
         .sentence = "Places, likewise, that are left out: an interface goes by what is nearest to it",
         .needs = {{is("between", {"places"})}}},
        {.name = "distance",
         .label = "Distance",
         .unit = "m",
         .min = 0,
         .max = 1e5,
         .min_excluded = true,
         .default_value = 0.1,
         .sentence = "From the line, or a place, to the middle of an interface",
         .needs = {{is("between", {"curve", "places"})}}}};
    for (std::vector<ParameterDescription> some : {box_and_sphere_parameters(), filter_parameters()})
        std::ranges::move(some, std::back_inserter(all));
    return all;
}

Status check_interfaces(const std::string& node, const Parameters& p) {
    const std::string between = p.text("between");
    if (between == "groups" && p.text("group").empty()) return node_error(node, "group", "no vertex group is named");
    if ((between == "curve" || between == "places") && p.points("points").empty())
        return node_error(node, "points", "there are none", "give one or more");
    if (between == "box")
        if (Status ok = check_box(node, p); !ok) return ok;
    if (!p.is_null("angle"))
        if (Status ok = check_direction(node, p, "direction"); !ok) return ok;
    if (p.number_or("most_area", kNever) < p.number("least_area"))
        return node_error(node, "most_area", "is below least_area: no interface is left");
    return {};
}

Result<std::vector<EdgeId>> chosen_edges(const CookContext& context, const BodyValue& body, const Parameters& p) {
    const Result<Chooser> chooses = chooser_of(context, body, p);
    if (!chooses) return chooses.error();
    const Filter filter(p);
    std::vector<EdgeId> chosen;
    for (EdgeId e(0); e < body.rest->n_edges(); ++e) {
        const Edge& edge = body.rest->edges[e];
        const InterfacePlace place = place_of(body, edge);
        if (filter.passes(place) && (*chooses)(edge, place)) chosen.push_back(e);
    }
    return chosen;
}

}  // namespace sunder
