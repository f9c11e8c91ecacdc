#include "nodes/break_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "nodes/bake_files/manifest.h"
#include "nodes/graph/json.h"
#include "nodes/graph/strict_json.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

Json row_of(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }
Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

// The bytes of a file of the log, which must be as listed.
Result<std::string> listed_text(const fs::path& bake, const ManifestFile& file) {
    const std::string path = (bake / file.path).string();
    auto text = read_file(path);
    if (!text) return text.error();
    const auto stamp = stamp_of_file(path);
    if (!stamp) return stamp.error();
    if (*stamp != file.stamp)
        return bad_input(path, "has changed since it was baked", "sunder verify tells more; bake again with --restart");
    return text;
}

Result<std::vector<FragmentLoads>> loads_of(const fs::path& bake, const ManifestLog& log) {
    std::vector<FragmentLoads> all;
    for (const ManifestFile& file : log.loads) {
        const auto text = listed_text(bake, file);
        if (!text) return text.error();
        auto loads = decode_loads(*text, (bake / file.path).string());
        if (!loads) return loads.error();
        all.push_back(loads.take());
    }
    return all;
}

bool is_in_part(const FragmentChoice& choice, const FragmentLoads& loads, const FragmentLoad& f) {
    if (choice.group.empty() && !choice.cluster) return true;
    if (loads.parts.empty()) return false;
    const FragmentParts& parts = loads.parts[f.body];
    if (!choice.group.empty()) {
        const auto group = parts.groups.find(choice.group);
        if (group == parts.groups.end() || !std::ranges::binary_search(group->second, f.fragment)) return false;
    }
    return !choice.cluster || (f.fragment < parts.clusters.size() ? parts.clusters[f.fragment] : 0) == *choice.cluster;
}

bool is_chosen(const FragmentChoice& choice, const FragmentLoads& loads, const FragmentLoad& f) {
    return (choice.body.empty() || choice.body == loads.bodies[f.body]) &&
           (choice.fragments.empty() || std::ranges::find(choice.fragments, f.fragment) != choice.fragments.end()) &&
           (!choice.box || ((f.position.array() >= choice.box->min.array()).all() &&
                            (f.position.array() <= choice.box->max.array()).all())) &&
           is_in_part(choice, loads, f);
}

// What a choice names must be there to be chosen by.
Status check_parts(const FragmentChoice& choice, const std::vector<FragmentLoads>& all) {
    if (choice.group.empty() && !choice.cluster) return {};
    if (std::ranges::all_of(all, [](const FragmentLoads& loads) { return loads.parts.empty(); }))
        return bad_input(choice.group.empty() ? "cluster" : "group",
                         "is not told of by this bake: an earlier Sunder baked it", "bake again with --restart");
    if (choice.group.empty()) return {};
    std::set<std::string> known;
    for (const FragmentLoads& loads : all)
        for (const FragmentParts& parts : loads.parts)
            for (const auto& [name, unused] : parts.groups) known.insert(name);
    if (known.contains(choice.group)) return {};
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "permitted: " : ", ") + name;
    return bad_input("group", "no body has a vertex group '" + choice.group + "'",
                     names.empty() ? "they have none" : names);
}

void count_breaks(const std::vector<FrameBreaks>& breaks, std::vector<FragmentReport>& io_fragments) {
    using Name = std::tuple<std::string, std::string, uint32_t>;
    std::map<Name, FragmentReport*> known;
    for (FragmentReport& f : io_fragments) known[{f.solver, f.body, f.load.fragment}] = &f;
    for (const FrameBreaks& frame : breaks)
        for (const LoggedBreak& b : frame.edges)
            for (const uint32_t fragment : b.fragments) {
                const auto found = known.find({frame.node, b.body, fragment});
                if (found == known.end()) continue;
                FragmentReport& f = *found->second;
                f.first_broken = f.n_broken == 0 ? b.time : std::min(f.first_broken, b.time);
                ++f.n_broken;
            }
}

Status choose(const FragmentChoice& choice, const std::vector<FragmentLoads>& all, const std::string& where,
              BreakReport& io_report) {
    if (choice.is_empty()) return {};
    if (all.empty()) return bad_input(where, "tells of no fragment: nothing in it can break", "give a body toughness");
    if (Status s = check_parts(choice, all); !s) return s;
    for (const FragmentLoads& loads : all)
        for (const FragmentLoad& f : loads.of)
            if (is_chosen(choice, loads, f)) io_report.fragments.push_back({loads.node, loads.bodies[f.body], f});
    if (io_report.fragments.empty())
        return bad_input("fragments", "none is chosen: there is none of that number, body, box, group or cluster",
                         "numbers begin at 0; boxes are of where fragments start");
    count_breaks(io_report.breaks, io_report.fragments);
    return {};
}

Json to_json(const LoggedBreak& b, const FrameBreaks& frame) {
    return {{"frame", frame.frame},
            {"time", b.time},
            {"solver", frame.node},
            {"body", b.body},
            {"edge", b.edge},
            {"fragments", b.fragments},
            {"position", row_of(b.position)},
            {"strain", b.strain},
            {"toughness", b.toughness},
            {"by_kind", kind_name(b.by_kind)},
            {"by", b.by_kind == Pusher::Kind::nothing ? Json() : Json(b.by)},
            {"by_fragment", b.by_fragment == kNone ? Json() : Json(b.by_fragment)}};
}

Json to_json(const FragmentReport& f) {
    const bool loaded = f.load.strain > 0;
    return {{"solver", f.solver},
            {"body", f.body},
            {"fragment", f.load.fragment},
            {"position", row_of(f.load.position)},
            {"strain", f.load.strain},
            {"toughness", number_or_null(f.load.toughness)},
            {"share", f.load.strain / f.load.toughness},
            {"frame", loaded ? Json(f.load.frame) : Json()},
            {"broken_edges", f.n_broken},
            {"first_broken", f.n_broken ? Json(f.first_broken) : Json()}};
}

// Its ratio: what cracks took of what their area takes by its fracture energy; null without any, or if that is unknown.
Json to_json(const CrackReport& c) {
    const bool is_known = !c.from && c.cracks.broken_work;
    return {{"solver", c.solver},
            {"energy", c.cracks.taken},
            {"parted_area", c.cracks.parted_area},
            {"faded_area", c.cracks.faded_area},
            {"surface_work", c.cracks.surface_work},
            {"ratio", is_known ? number_or_null(c.cracks.taken / c.cracks.surface_work) : Json()},
            {"since", c.from ? Json(*c.from) : Json()}};
}

Result<Aabb> box_of(const Json& json) {
    const auto fault = bad_input("box", "is no box", "give [[x, y, z], [x, y, z]], two opposite corners");
    if (!json.is_array() || json.size() != 2) return fault;
    Aabb box;
    for (const Json& corner : json) {
        if (!corner.is_array() || corner.size() != 3) return fault;
        for (const Json& x : corner)
            if (!x.is_number()) return fault;
        box.extend(Vec3(corner[0].get<double>(), corner[1].get<double>(), corner[2].get<double>()));
    }
    return box;
}

}  // namespace

Result<FragmentChoice> fragment_choice(const std::string& text) {
    auto json = parse_json(text, "fragments");
    if (!json) return json.error();
    const auto fault = bad_input("fragments", "are not told as they should be",
                                 "give {\"fragments\": [NUMBERS], \"body\": NAME, \"box\": CORNERS, \"group\": NAME, "
                                 "\"cluster\": NUMBER, \"all\": true}");
    if (!json->is_object()) return fault;
    FragmentChoice choice;
    for (const auto& [name, value] : json->items())
        if (name == "all" && value.is_boolean()) {
            choice.all = value.get<bool>();
        } else if (name == "body" && value.is_string()) {
            choice.body = value.get<std::string>();
        } else if (name == "group" && value.is_string() && value != "") {
            choice.group = value.get<std::string>();
        } else if (name == "cluster" && value.is_number_integer() &&
                   std::abs(value.get<double>()) <= std::numeric_limits<int32_t>::max()) {
            choice.cluster = value.get<int32_t>();
        } else if (name == "box") {
            const auto box = box_of(value);
            if (!box) return box.error();
            choice.box = *box;
        } else if (name == "fragments" && value.is_array() && !value.empty()) {
            for (const Json& number : value) {
                if (!number.is_number_unsigned() || number.get<uint64_t>() >= kNone) return fault;
                choice.fragments.push_back(number.get<uint32_t>());
            }
        } else {
            return fault;
        }
    if (!choice.body.empty() && choice.is_empty()) choice.all = true;
    return choice;
}

size_t BreakReport::n_broken() const {
    size_t n = 0;
    for (const FrameBreaks& frame : breaks) n += frame.edges.size();
    return n;
}

const LoggedBreak* BreakReport::first() const {
    const LoggedBreak* first = nullptr;
    for (const FrameBreaks& frame : breaks)
        for (const LoggedBreak& b : frame.edges)
            if (!first || b.time < first->time) first = &b;
    return first;
}

Result<BreakReport> break_report(const fs::path& bake, const FragmentChoice& choice) {
    const auto manifest = read_manifest(bake);
    if (!manifest) return manifest.error();
    if (!manifest->log)
        return bad_input(bake.string(), "keeps no log of what broke: an earlier Sunder baked it",
                         "bake again with --restart");
    const int first = manifest->frame_range[0], last = first + static_cast<int>(manifest->frames.size()) - 1;
    BreakReport report;
    report.frames = {manifest->log->from, last};
    report.is_complete = last == manifest->frame_range[1];
    if (manifest->log->from > first)
        report.note = "frames " + std::to_string(first) + " to " + std::to_string(manifest->log->from - 1) +
                      " have no log: an earlier Sunder baked them";
    for (const ManifestFile& file : manifest->log->breaks) {
        const auto text = listed_text(bake, file);
        if (!text) return text.error();
        auto breaks = decode_breaks(*text, (bake / file.path).string());
        if (!breaks) return breaks.error();
        report.breaks.push_back(breaks.take());
    }
    const auto loads = loads_of(bake, *manifest->log);
    if (!loads) return loads.error();
    for (const FragmentLoads& of : *loads) {
        if (!of.cracks) continue;
        report.cracks.push_back({of.node, *of.cracks, of.cracks_from});
        const auto note = [&](const std::string& what) { report.note += (report.note.empty() ? "" : "; ") + what; };
        if (of.cracks_from)
            note("what cracks of '" + of.node + "' took before frame " + std::to_string(*of.cracks_from) +
                 " is not counted");
        if (!of.cracks->broken_work)
            note("what seams left of the fracture energy of cracks of '" + of.node +
                 "' is not known: an earlier Sunder baked them");
    }
    if (Status s = choose(choice, *loads, bake.string(), report); !s) return s.error();
    return report;
}

Json to_json(const BreakReport& report) {
    Json breaks = Json::array(), pieces = Json::array(), fragments = Json::array(), cracks = Json::array(), first;
    const LoggedBreak* first_broken = report.first();
    for (const FrameBreaks& frame : report.breaks) {
        for (const LoggedBreak& b : frame.edges) {
            breaks.push_back(to_json(b, frame));
            if (&b == first_broken) first = breaks.back();
        }
        pieces.push_back({{"frame", frame.frame},
                          {"time", frame.time},
                          {"solver", frame.node},
                          {"edges", frame.edges.size()},
                          {"pieces", frame.n_pieces},
                          {"largest", frame.largest}});
    }
    for (const FragmentReport& f : report.fragments) fragments.push_back(to_json(f));
    for (const CrackReport& c : report.cracks) cracks.push_back(to_json(c));
    return {{"frames", report.frames},     {"complete", report.is_complete},    {"note", report.note},
            {"broken", report.n_broken()}, {"first", std::move(first)},         {"pieces", std::move(pieces)},
            {"breaks", std::move(breaks)}, {"fragments", std::move(fragments)}, {"cracks", std::move(cracks)}};
}

}  // namespace sunder
