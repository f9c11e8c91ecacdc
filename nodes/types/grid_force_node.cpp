// grid_force: any field, as vectors at the nodes of a box.
#include <algorithm>
#include <cmath>

#include "nodes/files/file_io.h"
#include "nodes/graph/json.h"
#include "nodes/graph/node_list.h"
#include "nodes/graph/parameter.h"
#include "nodes/graph/strict_json.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

constexpr size_t kMostBytes = size_t{1} << 30;  // of a file

std::vector<ParameterDescription> grid_parameters() {
    std::vector<ParameterDescription> all = {
        {.name = "values",
         .label = "Values",
         .type = ParameterType::vectors,
         .unit = "m/s or m/s2",
         .min = -1e6,
         .max = 1e6,
         .default_value = JsonValue::empty_list(),
         .sentence =
             "A vector for each node, z fastest, then y, then x; as often as there are frames, one after the other"},
        {.name = "nodes",
         .label = "Nodes",
         .type = ParameterType::integer3,
         .min = 2,
         .max = 1000,
         .default_value = {2, 2, 2},
         .sentence = "How many there are along each side of the box"},
        {.name = "box_min",
         .label = "Box Min",
         .type = ParameterType::vector3,
         .unit = "m",
         .default_value = {-1.0, -1.0, -1.0},
         .sentence = "Lowest corner of the box, the first node"},
        {.name = "box_max",
         .label = "Box Max",
         .type = ParameterType::vector3,
         .unit = "m",
         .default_value = {1.0, 1.0, 1.0},
         .sentence = "Highest corner of the box, the last node"},
        {.name = "first_frame",
         .label = "First Frame",
         .type = ParameterType::integer,
         .default_value = 1,
         .sentence = "Of the first of several grids, one a frame; before and after, the first and the last one stay",
         .group = "Time"}};
    for (ParameterDescription& p : all) p.needs = {{is("source", {"values"})}};
    return all;
}

/// What the grids were made of last, with the key of the node that they were made for.
struct GridStore {
    ContentKey node = 0, key = 0;
    VectorGrid box;                         // without values
    std::vector<std::vector<Vec3>> frames;  // values of each
    int first_frame = 1;
};

/// The grid's parameters as a file gives them.
class OfFile final : public Parameters {
public:
    static Result<OfFile> read(CookContext& context) {
        const std::string path = context.parameters().text("path");
        const Result<std::string> text = read_file(context.resolve(path), kMostBytes);
        if (!text) return context.error("path", text.error().what, text.error().mend);
        Result<Json> json = parse_json(*text, path);
        if (!json) return context.error("path", json.error().text(), json.error().mend);
        if (!json->is_object()) return context.error("path", "'" + path + "' holds no object {\"values\": ...}");
        OfFile file;
        const std::vector<ParameterDescription> described = grid_parameters();
        for (const ParameterDescription& p : described) file.values_[p.name] = p.default_value.get();
        for (const auto& [name, value] : json->items()) {
            const auto p = std::ranges::find(described, name, &ParameterDescription::name);
            if (p == described.end())
                return context.error("path", "'" + path + "' has '" + name + "', which no grid has",
                                     "permitted: values, nodes, box_min, box_max, first_frame");
            const Result<ParameterValue> checked = ParameterValue::check(*p, value, context.node());
            if (!checked)
                return context.error("path", "'" + path + "', '" + name + "': " + checked.error().what,
                                     checked.error().mend);
            file.values_[name] = checked->at(0);
        }
        return file;
    }
    Json value(std::string_view name) const override { return values_.at(std::string(name)); }

private:
    Json values_ = Json::object();
};

Status take_grids(CookContext& context, const Parameters& p, const std::string& said, GridStore& o_store) {
    VectorGrid& box = o_store.box;
    const std::array<int, 3> nodes = p.integer3("nodes");
    for (size_t i = 0; i < 3; ++i) box.nodes[i] = static_cast<uint32_t>(nodes[i]);
    box.low = p.vector3("box_min"), box.high = p.vector3("box_max");
    if (!((box.high - box.low).minCoeff() > 0))
        return context.error(said.empty() ? "box_min" : said, "the box has no volume: box_min is not below box_max");
    const std::vector<Vec3> all = p.points("values");
    const size_t n = size_t{box.nodes[0]} * box.nodes[1] * box.nodes[2];
    if (all.empty() || all.size() % n != 0)
        return context.error(said.empty() ? "values" : said,
                             "there are " + std::to_string(all.size()) + " vectors for " + std::to_string(n) + " nodes",
                             "one for each node, or as many times that as there are frames");
    KeyHasher hasher;
    for (const Vec3& v : all) hasher.add(v);
    for (const uint32_t count : box.nodes) hasher.add(count);
    o_store.key = hasher.add(box.low).add(box.high).key();
    o_store.first_frame = p.integer("first_frame");
    o_store.frames.clear();
    for (auto begin = all.begin(); begin != all.end(); begin += static_cast<std::ptrdiff_t>(n))
        o_store.frames.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(n));
    return {};
}

Status prepare(CookContext& context, GridStore& io_store) {
    if (io_store.node == context.key() && !io_store.frames.empty()) return {};
    if (context.parameters().text("source") == "values") {
        if (Status ok = take_grids(context, context.parameters(), "", io_store); !ok) return ok;
    } else {
        const Result<OfFile> file = OfFile::read(context);
        if (!file) return file.error();
        if (Status ok = take_grids(context, *file, "path", io_store); !ok) return ok;
    }
    io_store.node = context.key();
    return {};
}

Result<Value> cook_grid_force(CookContext& context) {
    GridStore& store = context.store().get<GridStore>();
    if (Status ok = prepare(context, store); !ok) return ok.error();
    const Parameters& p = context.parameters();
    const double strength = p.number("strength"), last = static_cast<double>(store.frames.size() - 1);
    const std::optional<double> drag = drag_of(p);
    if (!drag || (strength == 0 && *drag == 0)) return local_force(context, Nothing());
    const double moment = std::clamp(double(context.frame()) - store.first_frame, 0.0, last);
    VectorGrid grid = store.box;
    grid.values = store.frames[static_cast<size_t>(moment)];
    for (Vec3& v : grid.values) v *= strength;
    KeyHasher hasher;
    hasher.add(store.key).add(strength).add(moment);
    return local_force(context, GridField{std::make_shared<const VectorGrid>(std::move(grid)), hasher.key()}, *drag);
}

Status check_grid_force(const std::string& node, const Parameters& p) {
    if (p.text("source") == "file" && p.text("path").empty()) return node_error(node, "path", "no file is given");
    return {};
}

}  // namespace

NodeType grid_force_node() {
    NodeDescription d{.type = "grid_force",
                      .label = "Grid Force",
                      .category = "simulation",
                      .sentence =
                          "Any field, as vectors at the nodes of a box: what a script worked out, or another "
                          "program. Between nodes it is linear, outside of the box there is nothing."};
    d.outputs = {force_output()};
    d.parameters = {
        {.name = "source",
         .label = "Source",
         .type = ParameterType::choice,
         .default_value = "values",
         .sentence = "values: they stand in the graph; file: in a file of their own",
         .choices = {"values", "file"}},
        {.name = "path",
         .label = "Path",
         .type = ParameterType::path,
         .default_value = "",
         .sentence = "A JSON file {\"nodes\": [i, j, k], \"box_min\": [x, y, z], \"box_max\": ..., \"values\": "
                     "[[x, y, z], ...], \"first_frame\": n}, relative to the graph file's folder",
         .needs = {{is("source", {"file"})}}}};
    for (ParameterDescription& p : grid_parameters()) d.parameters.push_back(std::move(p));
    d.parameters.push_back({.name = "strength",
                            .label = "Strength",
                            .min = -1e6,
                            .max = 1e6,
                            .default_value = 1.0,
                            .sentence = "A factor on the values",
                            .animatable = true});
    for (ParameterDescription& p : acting_parameters()) d.parameters.push_back(std::move(p));
    return {.description = d, .cook = cook_grid_force, .check = check_grid_force, .depends_on_frame = true};
}

}  // namespace sunder
