#include "nodes/bake_files/break_log.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "nodes/files/output_pattern.h"
#include "nodes/graph/json.h"
#include "nodes/graph/strict_json.h"
#include "solver/scene/strength.h"
#include "solver/solver.h"

namespace sunder {
namespace {

constexpr std::string_view kBreaksFormat = "sunder breaks 1", kLoadsFormat = "sunder loads 1";
constexpr size_t kLargest = 5;  // pieces that are told of
constexpr const char* kMend = "bake again with --restart";

// A row of numbers, read in their order; a fault stays.
class Row {
public:
    explicit Row(const Json& row) : row_(row), good_(row.is_array()) {}
    double number() {
        const Json* value = next();
        if (value && value->is_number()) return value->get<double>();
        good_ = false;
        return 0;
    }
    double number_or_never() {
        if (!good_ || at_ >= row_.size() || !row_[at_].is_null()) return number();
        ++at_;
        return kNever;
    }
    /// -1 and up, below `end`; -1 as kNone.
    uint32_t whole(double end) {
        const double n = number();
        if (n != std::floor(n) || n < -1 || n >= end) good_ = false;
        return n == -1 || !good_ ? kNone : static_cast<uint32_t>(n);
    }
    Vec3 vector() {
        const double x = number(), y = number(), z = number();
        return {x, y, z};
    }
    bool is_done() const { return good_ && at_ == row_.size(); }

private:
    const Json* next() { return good_ && at_ < row_.size() ? &row_[at_++] : nullptr; }

    const Json& row_;
    size_t at_ = 0;
    bool good_;
};

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json number_of(uint32_t number) { return number == kNone ? Json(-1) : Json(number); }

constexpr double kNoLimit = double{kNone};

struct Thing {
    Pusher::Kind kind = Pusher::Kind::nothing;
    std::string name;
    auto operator<=>(const Thing&) const = default;
};

std::optional<Pusher::Kind> kind_of(std::string_view name) {
    for (const auto kind : {Pusher::Kind::nothing, Pusher::Kind::particle, Pusher::Kind::rigid_body,
                            Pusher::Kind::collider, Pusher::Kind::seam})
        if (kind_name(kind) == name) return kind;
    return {};
}

LoggedBreak logged(const StateValue& value, const BrokenEdge& broken) {
    const Scene& scene = *value.scene;
    const SimulationMesh& rest = scene.rest;
    const Edge& edge = rest.edges[broken.edge];
    const auto& x = value.state->position;
    LoggedBreak out{.edge = broken.edge,
                    .body = scene.bodies[rest.body[edge.a]].name,
                    .fragments = {rest.fragment[edge.a], rest.fragment[edge.b]},
                    .position = 0.5 * (x[edge.a] + x[edge.b]),
                    .time = broken.time,
                    .strain = broken.strain,
                    .toughness = broken.toughness,
                    .by_kind = broken.by.kind,
                    .by = {}};
    const uint32_t n = broken.by.number;
    switch (broken.by.kind) {
        case Pusher::Kind::nothing:
            break;
        case Pusher::Kind::particle:
            out.by = scene.bodies[rest.body[n]].name, out.by_fragment = rest.fragment[n];
            break;
        case Pusher::Kind::rigid_body:
            out.by = scene.rigid_bodies[n].name;
            break;
        case Pusher::Kind::collider:
            out.by = scene.colliders[n].name;
            break;
        case Pusher::Kind::seam:
            out.by = scene.seams[n].name;
            break;
    }
    return out;
}

// The file as JSON; its errors at `where`.
Result<Json> parse(std::string_view text, std::string_view mark, std::string_view format, const std::string& where) {
    if (!text.starts_with(mark)) return bad_input(where, "is no log of a bake", kMend);
    auto json = parse_json(text, where);
    if (!json) return json.error();
    const Json& told = (*json)["format"];
    if (told != format)
        return bad_input(where, "is of a format that this version does not know: " + told.dump(), "use a newer Sunder");
    return json;
}

template <class T>
bool take(const Json& json, const char* name, T& o_value) {
    if (!json.contains(name)) return false;
    const Json& value = json.at(name);
    if constexpr (std::is_same_v<T, std::string>) {
        if (!value.is_string()) return false;
    } else if constexpr (std::is_floating_point_v<T>) {
        if (!value.is_number()) return false;
    } else {
        if (!value.is_number_integer()) return false;
    }
    o_value = value.get<T>();
    return true;
}

bool take_list(const Json& json, const char* name, const Json*& o_list) {
    if (!json.contains(name) || !json.at(name).is_array()) return false;
    o_list = &json.at(name);
    return true;
}

bool decode(const Json& json, FrameBreaks& o_breaks) {
    const Json *things = nullptr, *edges = nullptr, *largest = nullptr;
    if (!take(json, "node", o_breaks.node) || !take(json, "frame", o_breaks.frame) ||
        !take(json, "time", o_breaks.time) || !take(json, "pieces", o_breaks.n_pieces) ||
        !take_list(json, "largest", largest) || !take_list(json, "things", things) || !take_list(json, "edges", edges))
        return false;
    Row sizes(*largest);
    for (size_t i = 0; i < largest->size(); ++i) o_breaks.largest.push_back(sizes.whole(kNoLimit));
    if (!sizes.is_done()) return false;
    std::vector<Thing> known;
    for (const Json& thing : *things) {
        std::string kind, name;
        if (!take(thing, "kind", kind) || !take(thing, "name", name) || !kind_of(kind)) return false;
        known.push_back({*kind_of(kind), name});
    }
    for (const Json& e : *edges) {
        Row row(e);
        LoggedBreak b;
        b.edge = row.whole(kNoLimit);
        const uint32_t body = row.whole(static_cast<double>(known.size()));
        b.fragments[0] = row.whole(kNoLimit), b.fragments[1] = row.whole(kNoLimit);
        b.position = row.vector();
        b.time = row.number(), b.strain = row.number(), b.toughness = row.number();
        const uint32_t by = row.whole(static_cast<double>(known.size()));
        b.by_fragment = row.whole(kNoLimit);
        if (!row.is_done() || body == kNone) return false;
        b.body = known[body].name;
        if (by != kNone) b.by_kind = known[by].kind, b.by = known[by].name;
        o_breaks.edges.push_back(std::move(b));
    }
    return true;
}

bool decode(const Json& json, Cracks& o_cracks) {
    if (!take(json, "taken", o_cracks.taken) || !take(json, "parted_area", o_cracks.parted_area) ||
        !take(json, "faded_area", o_cracks.faded_area) || !take(json, "surface_work", o_cracks.surface_work))
        return false;
    if (json.contains("broken_work")) return take(json, "broken_work", *o_cracks.broken_work);
    if (o_cracks.surface_work > 0) o_cracks.broken_work.reset();  // an earlier Sunder wrote it
    return true;
}

bool decode_cracks(const Json& json, FragmentLoads& o_loads) {
    int from = 0;
    if (json.contains("cracks_from") && !take(json, "cracks_from", from)) return false;
    if (json.contains("cracks_from")) o_loads.cracks_from = from;
    if (json.contains("cracks") && json.at("cracks").is_null()) return true;
    if (json.contains("cracks")) return decode(json.at("cracks"), o_loads.cracks.emplace());
    constexpr int kLast = std::numeric_limits<int>::max() - 1;
    o_loads.cracks_from = std::min(o_loads.frame, kLast) + 1;  // an earlier Sunder wrote it
    return true;
}

// A list of whole numbers that int32_t holds.
bool take_clusters(const Json& json, std::vector<int32_t>& o_clusters) {
    const Json* clusters = nullptr;
    if (!take_list(json, "clusters", clusters)) return false;
    for (const Json& cluster : *clusters) {
        if (!cluster.is_number_integer()) return false;
        const double n = cluster.get<double>();
        if (!(n >= std::numeric_limits<int32_t>::min() && n <= std::numeric_limits<int32_t>::max())) return false;
        o_clusters.push_back(static_cast<int32_t>(n));
    }
    return true;
}

bool decode_parts(const Json& json, size_t n_bodies, std::vector<FragmentParts>& o_parts) {
    if (!json.contains("parts")) return true;
    const Json* bodies = nullptr;
    if (!take_list(json, "parts", bodies) || bodies->size() != n_bodies) return false;
    for (const Json& body : *bodies) {
        FragmentParts& parts = o_parts.emplace_back();
        if (!body.is_object() || !take_clusters(body, parts.clusters) || !body.contains("groups")) return false;
        if (!body.at("groups").is_object()) return false;
        for (const auto& [name, members] : body.at("groups").items()) {
            Row row(members);
            for (size_t i = 0; i < members.size(); ++i) parts.groups[name].push_back(row.whole(kNoLimit));
            if (!row.is_done()) return false;
            std::ranges::sort(parts.groups[name]);
        }
    }
    return true;
}

Json to_json(const Cracks& cracks) {
    Json json = {{"taken", cracks.taken},
                 {"parted_area", cracks.parted_area},
                 {"faded_area", cracks.faded_area},
                 {"surface_work", cracks.surface_work}};
    if (cracks.broken_work) json["broken_work"] = *cracks.broken_work;
    return json;
}

Json to_json(const FragmentParts& parts) {
    Json groups = Json::object();
    for (const auto& [name, members] : parts.groups) groups[name] = members;
    return {{"clusters", parts.clusters}, {"groups", std::move(groups)}};
}

FragmentParts parts_of(const FragmentSet& set) {
    FragmentParts parts;
    for (const Fragment& fragment : set.fragments) parts.clusters.push_back(fragment.cluster);
    if (std::ranges::all_of(parts.clusters, [](int32_t cluster) { return cluster == 0; })) parts.clusters.clear();
    for (const auto& [name, members] : set.vertex_groups) {
        auto& numbers = parts.groups[name];
        for (const FragmentId member : members) numbers.push_back(static_cast<uint32_t>(member.index()));
        std::ranges::sort(numbers);
    }
    return parts;
}

bool decode(const Json& json, FragmentLoads& o_loads) {
    const Json *bodies = nullptr, *rows = nullptr;
    if (!take(json, "node", o_loads.node) || !take(json, "frame", o_loads.frame) ||
        !take_list(json, "bodies", bodies) || !take_list(json, "fragments", rows))
        return false;
    for (const Json& name : *bodies) {
        if (!name.is_string()) return false;
        o_loads.bodies.push_back(name.get<std::string>());
    }
    if (!decode_parts(json, bodies->size(), o_loads.parts)) return false;
    for (const Json& r : *rows) {
        Row row(r);
        FragmentLoad load;
        load.body = row.whole(static_cast<double>(bodies->size()));
        load.fragment = row.whole(kNoLimit);
        load.position = row.vector();
        load.strain = row.number(), load.toughness = row.number_or_never();
        const double frame = row.number();
        if (!row.is_done() || load.body == kNone || !(std::abs(frame) < 1e9)) return false;
        load.frame = static_cast<int>(frame);
        o_loads.of.push_back(load);
    }
    return decode_cracks(json, o_loads);
}

// What an edge takes until it parts, J. One that bears f times as much opens as far as a sound one, and takes f^2 times
// as much; what is held now was not when it faded.
double work_of(const Edge& edge, const Material& material, double bond) {
    return material.fracture_energy * edge.area * (bond < kNever ? bond * bond : 1);
}

// Of edges that broke since the frame before; a seam that is told to break takes none.
double broken_work(const StateValue& value, std::span<const Material> materials) {
    const SimulationMesh& rest = value.scene->rest;
    double sum = 0;
    for (const BrokenEdge& b : value.broken) {
        const Edge& edge = rest.edges[b.edge];
        const Material &of_a = materials[rest.material_of(edge.a)], &of_b = materials[rest.material_of(edge.b)];
        const double sound = sound_toughness(rest, of_a, of_b, b.edge);
        if (of_a.fracture_energy < kNever && b.by.kind != Pusher::Kind::seam)
            sum += work_of(edge, of_a, sound > 0 ? b.toughness / sound : 1);
    }
    return sum;
}

void add_cracks(const StateValue& value, std::span<const Material> materials, std::span<const double> bonds,
                std::optional<Cracks>& io_cracks) {
    const SimulationMesh& rest = value.scene->rest;
    const FrameState& state = *value.state;
    if (state.edge_damage.empty()) return;
    const std::vector<PieceId> pieces = connected_pieces(rest, state.edge_intact);
    Cracks now = io_cracks.value_or(Cracks());
    now.taken += value.report.cracks_J;
    if (now.broken_work) *now.broken_work += broken_work(value, materials);
    now.surface_work = now.broken_work.value_or(0), now.parted_area = now.faded_area = 0;
    for (EdgeId e(0); e < rest.n_edges(); ++e) {
        const Edge& edge = rest.edges[e];
        const Material& material = materials[rest.material_of(edge.a)];
        if (!(material.fracture_energy < kNever)) continue;
        const bool is_parted = pieces[edge.a] != pieces[edge.b];
        const double area = edge.area * (is_parted ? 1 : state.edge_damage[e]);
        (is_parted ? now.parted_area : now.faded_area) += area;
        if (state.edge_intact[e])
            now.surface_work += state.edge_damage[e] * work_of(edge, material, bonds.empty() ? 1 : bonds[e]);
        else if (!now.broken_work)
            now.surface_work += material.fracture_energy * area;
    }
    io_cracks = now;
}

}  // namespace

std::string_view kind_name(Pusher::Kind kind) {
    switch (kind) {
        case Pusher::Kind::particle:
            return "body";
        case Pusher::Kind::rigid_body:
            return "rigid_body";
        case Pusher::Kind::collider:
            return "collider";
        case Pusher::Kind::seam:
            return "seam";
        default:
            return "nothing";
    }
}

std::string breaks_path(const std::string& solver, int frame) {
    return output_path("breaks/" + file_name_of(solver) + ".####.json", frame);
}

FrameBreaks breaks_of(const std::string& solver, const StateValue& value) {
    FrameBreaks out{
        .node = solver, .frame = static_cast<int>(value.frame), .time = value.state->time, .largest = {}, .edges = {}};
    const std::vector<PieceId> pieces = connected_pieces(value.scene->rest, value.state->edge_intact);
    std::map<uint32_t, uint32_t> sizes;
    for (const PieceId piece : pieces) ++sizes[piece];
    out.n_pieces = sizes.size();
    for (const auto& [unused, n] : sizes) out.largest.push_back(n);
    std::ranges::sort(out.largest, std::greater());
    out.largest.resize(std::min(out.largest.size(), kLargest));
    for (const BrokenEdge& b : value.broken) out.edges.push_back(logged(value, b));
    return out;
}

std::string encode_breaks(const FrameBreaks& breaks) {
    std::map<Thing, size_t> number;
    Json things = Json::array(), edges = Json::array();
    const auto number_in = [&](Pusher::Kind kind, const std::string& name) {
        const auto [known, is_new] = number.try_emplace({kind, name}, things.size());
        if (is_new) things.push_back({{"kind", kind_name(kind)}, {"name", name}});
        return known->second;
    };
    for (const LoggedBreak& b : breaks.edges) {
        Json row = {b.edge,         number_in(Pusher::Kind::particle, b.body),
                    b.fragments[0], b.fragments[1],
                    b.position.x(), b.position.y(),
                    b.position.z(), b.time,
                    b.strain,       b.toughness};
        row.push_back(b.by_kind == Pusher::Kind::nothing ? Json(-1) : Json(number_in(b.by_kind, b.by)));
        row.push_back(number_of(b.by_fragment));
        edges.push_back(std::move(row));
    }
    const Json json = {{"format", kBreaksFormat},
                       {"node", breaks.node},
                       {"frame", breaks.frame},
                       {"time", breaks.time},
                       {"pieces", breaks.n_pieces},
                       {"largest", breaks.largest},
                       {"things", std::move(things)},
                       {"columns",
                        {"edge", "body", "fragment_a", "fragment_b", "x", "y", "z", "time", "strain", "toughness", "by",
                         "by_fragment"}},
                       {"edges", std::move(edges)}};
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<FrameBreaks> decode_breaks(std::string_view text, const std::string& where) {
    const auto json = parse(text, kBreaksMark, kBreaksFormat, where);
    if (!json) return json.error();
    FrameBreaks breaks;
    if (!decode(*json, breaks)) return bad_input(where, "is not a whole log of what broke", kMend);
    return breaks;
}

bool FragmentLoads::matter() const {
    return std::ranges::any_of(of, [](const FragmentLoad& f) { return f.toughness < kNever; });
}

void add_loads(const StateValue& value, FragmentLoads& io_loads) {
    const Scene& scene = *value.scene;
    const SimulationMesh& rest = scene.rest;
    const int frame = static_cast<int>(value.frame);
    if (io_loads.of.size() != rest.n_particles()) {
        if (value.state->time > 0 && !io_loads.goes_on) io_loads.cracks_from = frame;
        io_loads.of.clear(), io_loads.bodies.clear(), io_loads.parts.clear();
        for (const Body& body : scene.bodies) io_loads.bodies.push_back(body.name);
        for (size_t g = 0; g < rest.n_particles(); ++g)
            io_loads.of.push_back({rest.body[g], rest.fragment[g], rest.rest_position[g]});
    }
    if (io_loads.parts.empty())
        for (const auto& body : value.bodies) io_loads.parts.push_back(parts_of(*body->fragments));
    io_loads.frame = frame;
    const auto offer = [&](size_t g, double strain, double toughness) {
        FragmentLoad& load = io_loads.of[g];
        if (load.strain > 0 ? !(strain / toughness > load.share()) : !(toughness < kNever)) return;
        load.strain = strain, load.toughness = toughness, load.frame = frame;
    };
    const std::vector<Material> materials = materials_of(value.bodies);
    const std::vector<double> bonds = edge_bonds(scene, seams_of(value.bodies), *value.state);
    add_cracks(value, materials, bonds, io_loads.cracks);
    const std::vector<double> toughness = fragment_toughness(rest, materials, value.state->edge_intact, bonds);
    for (size_t g = 0; g < toughness.size(); ++g) offer(g, value.state->strain[g], toughness[g]);
    for (const BrokenEdge& b : value.broken)
        if (b.toughness > 0)
            for (const ParticleId g : {rest.edges[b.edge].a, rest.edges[b.edge].b})
                offer(g, std::abs(b.strain), b.toughness);
}

std::string encode_loads(const FragmentLoads& loads) {
    Json rows = Json::array(), parts = Json::array();
    for (const FragmentParts& p : loads.parts) parts.push_back(to_json(p));
    for (const FragmentLoad& f : loads.of)
        rows.push_back({f.body, f.fragment, f.position.x(), f.position.y(), f.position.z(), f.strain,
                        number_or_null(f.toughness), f.frame});
    Json json = {{"format", kLoadsFormat},
                 {"node", loads.node},
                 {"frame", loads.frame},
                 {"bodies", loads.bodies},
                 {"columns", {"body", "fragment", "x", "y", "z", "strain", "toughness", "frame"}},
                 {"fragments", std::move(rows)}};
    json["cracks"] = loads.cracks ? to_json(*loads.cracks) : Json();
    if (loads.cracks_from) json["cracks_from"] = *loads.cracks_from;
    if (!loads.parts.empty()) json["parts"] = std::move(parts);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<FragmentLoads> decode_loads(std::string_view text, const std::string& where) {
    const auto json = parse(text, kLoadsMark, kLoadsFormat, where);
    if (!json) return json.error();
    FragmentLoads loads;
    if (!decode(*json, loads)) return bad_input(where, "is not a whole log of loads", kMend);
    return loads;
}

}  // namespace sunder
