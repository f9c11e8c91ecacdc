#include "nodes/bake_files/manifest.h"

#include <algorithm>
#include <charconv>

#include "nodes/bake_files/bake_folder.h"
#include "nodes/files/frame_number.h"
#include "nodes/files/output_pattern.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/strict_json.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFormat = "sunder manifest 1";
constexpr uint64_t kLargestManifest = uint64_t{1} << 30;  // bytes

Json stamp_to_json(Json json, const FileStamp& stamp) {
    json["size"] = stamp.size;
    json["hash"] = hex(stamp.hash);
    return json;
}

Json to_json(const ManifestFile& f) { return stamp_to_json({{"node", f.node}, {"path", f.path}}, f.stamp); }

Json to_json(const std::vector<ManifestFile>& files) {
    Json json = Json::array();
    for (const ManifestFile& f : files) json.push_back(to_json(f));
    return json;
}

Json to_json(const ManifestFrame& f) {
    Json json = {{"frame", f.frame}, {"files", to_json(f.files)}};
    for (const ManifestSubFrame& sub : f.before)
        json["subframes"].push_back({{"frame", sub.frame}, {"files", to_json(sub.files)}});
    return json;
}

// Reads fields one after the other and remembers the first that is missing or of another type.
class Reader {
public:
    std::string fault;

    template <class T>
    T get(const Json& json, const char* name) {
        if (fault.empty() && json.is_object() && json.contains(name)) {
            const Json& value = json.at(name);
            if constexpr (std::is_same_v<T, std::string>) {
                if (value.is_string()) return value.get<T>();
            } else {
                // Of two integers the library compares -5 and 2^64 - 5 as equal.
                const bool fits_sign = std::is_signed_v<T> || value.is_number_unsigned();
                if (value.is_number_integer() && fits_sign && value == Json(value.get<T>())) return value.get<T>();
            }
        }
        note(name);
        return {};
    }
    const Json& list(const Json& json, const char* name) {
        static const Json empty = Json::array();
        if (json.is_object() && json.contains(name) && json.at(name).is_array()) return json.at(name);
        note(name);
        return empty;
    }
    uint64_t hash(const Json& json, const char* name) {
        const std::string text = get<std::string>(json, name);
        uint64_t value = 0;
        const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
        if (text.size() != 16 || code != std::errc() || stop != text.data() + text.size()) note(name);
        return value;
    }
    double number(const Json& json, const char* name) {
        if (json.is_object() && json.contains(name) && json.at(name).is_number()) return json.at(name).get<double>();
        note(name);
        return 0;
    }
    FileStamp stamp(const Json& json) { return {get<uint64_t>(json, "size"), hash(json, "hash")}; }
    std::vector<ManifestFile> files(const Json& json, const char* name) {
        std::vector<ManifestFile> out;
        for (const Json& f : list(json, name)) {
            out.push_back({get<std::string>(f, "node"), get<std::string>(f, "path"), stamp(f)});
            if (fault.empty() && !is_path_inside(out.back().path))
                fault = "'" + out.back().path + "' leaves the folder";
        }
        return out;
    }
    ManifestFrame frame(const Json& json) {
        ManifestFrame out{get<int>(json, "frame"), files(json, "files")};
        if (!json.is_object() || !json.contains("subframes")) return out;
        for (const Json& sub : list(json, "subframes")) {
            const double least = out.before.empty() ? out.frame - 1 : out.before.back().frame;
            out.before.push_back({number(sub, "frame"), files(sub, "files")});
            if (!(out.before.back().frame > least && out.before.back().frame < out.frame)) note("subframes");
        }
        return out;
    }
    void note(const char* name) {
        if (fault.empty()) fault = std::string("'") + name + "' is missing or wrong";
    }
};

std::string short_text(const Json& value) {
    const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

// As far as two of them are compared.
bool is_graph(const Json& json) {
    if (!json.is_object() || !json.contains("nodes") || !json["nodes"].is_object()) return false;
    const auto range = json.find("frame_range");
    if (range != json.end() && !(range->is_array() && range->size() == 2)) return false;
    return std::ranges::all_of(json["nodes"], [](const Json& node) { return node.is_object(); });
}

void compare_nodes(const Json& baked, const Json& wanted, std::vector<std::string>& out) {
    for (const auto& [name, node] : baked.items()) {
        if (!wanted.contains(name)) {
            out.push_back("node '" + name + "' is no longer there");
            continue;
        }
        const Json& other = wanted.at(name);
        for (const auto& [key, value] : node.items())
            if (!other.contains(key))
                out.push_back("node '" + name + "', '" + key + "': " + short_text(value) + " was baked, now nothing");
            else if (other.at(key) != value)
                out.push_back("node '" + name + "', '" + key + "': " + short_text(value) + " was baked, now " +
                              short_text(other.at(key)));
        for (const auto& [key, value] : other.items())
            if (!node.contains(key))
                out.push_back("node '" + name + "', '" + key + "': nothing was baked, now " + short_text(value));
    }
    for (const auto& [name, node] : wanted.items())
        if (!baked.contains(name)) out.push_back("node '" + name + "' is new");
}

std::string frames_text(int first, int last) {
    return first == last ? "frame " + std::to_string(first)
                         : "frames " + std::to_string(first) + " to " + std::to_string(last);
}

}  // namespace

Json to_json(const Manifest& m) {
    Json json = {{"format", kFormat}, {"version", m.version}, {"frame_range", m.frame_range}, {"graph", m.graph}};
    Json inputs = Json::array(), keys = Json::object(), frames = Json::array();
    for (const ManifestInput& i : m.inputs)
        inputs.push_back(stamp_to_json({{"node", i.node}, {"parameter", i.parameter}, {"path", i.path}}, i.stamp));
    for (const auto& [node, key] : m.keys) keys[node] = hex(key);
    for (const ManifestFrame& f : m.frames) frames.push_back(to_json(f));
    json["inputs"] = std::move(inputs);
    json["keys"] = std::move(keys);
    json["frames"] = std::move(frames);
    json["resume"] = to_json(m.resume);
    if (!m.exports.empty()) json["exports"] = to_json(m.exports);
    if (m.log)
        json["log"] = {{"from", m.log->from}, {"breaks", to_json(m.log->breaks)}, {"loads", to_json(m.log->loads)}};
    return json;
}

bool is_own_manifest(std::string_view text) {
    return text.substr(0, 100).find("\"format\": \"sunder manifest ") != std::string_view::npos;
}

Result<Manifest> parse_manifest(std::string_view text, const std::string& where) {
    const char* mend = "bake again with --restart";
    auto parsed = parse_json(text, where);
    if (!parsed) {
        Error error = parsed.error();
        error.mend = mend;
        return error;
    }
    const Json& json = *parsed;
    Reader read;
    const std::string format = read.get<std::string>(json, "format");
    if (!format.starts_with("sunder manifest ")) return bad_input(where, "is not the manifest of a bake");
    if (format != kFormat)
        return bad_input(where, "is a " + format + ", which this version does not know", "use a newer Sunder");

    Manifest m;
    m.version = read.get<std::string>(json, "version");
    if (json.contains("graph") && is_graph(json["graph"]))
        m.graph = json["graph"];
    else
        read.note("graph");
    const Json& range = read.list(json, "frame_range");
    if (range.size() == 2 && range[0].is_number_integer() && range[1].is_number_integer())
        m.frame_range = {range[0].get<int>(), range[1].get<int>()};
    else
        read.note("frame_range");
    for (const Json& i : read.list(json, "inputs"))
        m.inputs.push_back({read.get<std::string>(i, "node"), read.get<std::string>(i, "parameter"),
                            read.get<std::string>(i, "path"), read.stamp(i)});
    if (json.contains("keys") && json["keys"].is_object())
        for (const auto& [node, unused] : json["keys"].items()) m.keys[node] = read.hash(json["keys"], node.c_str());
    else
        read.note("keys");
    for (const Json& f : read.list(json, "frames")) m.frames.push_back(read.frame(f));
    m.resume = read.files(json, "resume");
    if (json.contains("exports")) m.exports = read.files(json, "exports");
    if (json.contains("log")) {
        const Json& log = json["log"];
        m.log = {read.get<int>(log, "from"), read.files(log, "breaks"), read.files(log, "loads")};
    }
    if (!read.fault.empty()) return bad_input(where, "is not a whole manifest: " + read.fault, mend);
    for (size_t i = 0; i < m.frames.size(); ++i)
        if (m.frames[i].frame != m.frame_range[0] + static_cast<int>(i) || m.frames[i].frame > m.frame_range[1])
            return bad_input(where,
                             "lists frame " + std::to_string(m.frames[i].frame) + " where " +
                                 std::to_string(m.frame_range[0] + static_cast<int>(i)) + " belongs",
                             mend);
    return m;
}

Result<Manifest> read_manifest(const fs::path& folder) {
    const fs::path path = folder / kManifestName;
    std::error_code code;
    if (!fs::exists(folder, code)) return bad_input(folder.string(), "there is no such folder", "check the path");
    if (!fs::exists(path, code))
        return bad_input(folder.string(), "holds no bake: there is no " + std::string(kManifestName),
                         "give the folder that a bake wrote");
    auto text = read_file(path, kLargestManifest);
    if (!text) return text.error();
    return parse_manifest(*text, path.string());
}

Result<Manifest> new_manifest(const Graph& graph, std::array<int, 2> frame_range) {
    Manifest m;
    m.graph = graph.to_json(Defaults::write);
    m.graph["frame_range"][1] = std::max(graph.frame_range()[1], frame_range[1]);
    m.keys = graph.keys();
    m.frame_range = frame_range;
    for (const std::string& node : graph.node_names()) {
        const NodeDescription& description = **graph.describe(node);
        for (const ParameterDescription& p : description.parameters) {
            if (p.type != ParameterType::path) continue;
            const auto value = graph.parameter(node, p.name);
            if (!value || !value->is_string() || value->get<std::string>().empty()) continue;
            const std::string path = value->get<std::string>();
            auto stamp = stamp_of_file(fs::path(graph.base_folder()) / path);
            if (!stamp) {
                Error error = stamp.error();
                error.where = "node '" + node + "', parameter '" + p.name + "': " + error.where;
                error.node = node, error.parameter = p.name;
                return error;
            }
            m.inputs.push_back({node, p.name, path, *stamp});
        }
    }
    return m;
}

std::vector<std::string> differences(const Manifest& baked, const Manifest& wanted) {
    std::vector<std::string> out;
    if (baked.version != wanted.version)
        out.push_back("Sunder " + baked.version + " baked it, this is " + wanted.version);
    Json a = baked.graph, b = wanted.graph;
    compare_nodes(a["nodes"], b["nodes"], out);
    if (a["frame_rate"] != b["frame_rate"])
        out.push_back("frame_rate: " + short_text(a["frame_rate"]) + " was baked, now " + short_text(b["frame_rate"]));
    if (a["frame_range"][0] != b["frame_range"][0])
        out.push_back("the simulation began at frame " + short_text(a["frame_range"][0]) + ", now at " +
                      short_text(b["frame_range"][0]));
    if (baked.frame_range[0] != wanted.frame_range[0])
        out.push_back("the bake began at frame " + std::to_string(baked.frame_range[0]) + ", now at " +
                      std::to_string(wanted.frame_range[0]));
    for (const ManifestInput& i : baked.inputs)
        for (const ManifestInput& j : wanted.inputs)
            if (i.node == j.node && i.parameter == j.parameter && i.path == j.path && i.stamp != j.stamp)
                out.push_back("node '" + i.node + "': the file '" + i.path + "' has changed");
    if (out.empty())
        for (const auto& [node, key] : wanted.keys)
            if (const auto found = baked.keys.find(node); found == baked.keys.end() || found->second != key) {
                out.push_back("node '" + node + "' gives something else now");
                break;
            }
    return out;
}

namespace {

void verify_file(const ManifestFile& f, const fs::path& folder, const std::string& whose, BakeCheck& io_check) {
    ++io_check.n_files;
    const auto stamp = stamp_of_file(folder / f.path);
    if (!stamp) {
        io_check.faults.push_back(f.path + ": " + stamp.error().what + whose);
        return;
    }
    io_check.bytes += stamp->size;
    if (stamp->size != f.stamp.size)
        io_check.faults.push_back(f.path + ": has " + std::to_string(stamp->size) + " bytes instead of " +
                                  std::to_string(f.stamp.size) + whose);
    else if (stamp->hash != f.stamp.hash)
        io_check.faults.push_back(f.path + ": its contents have changed (hash " + hex(stamp->hash) + " instead of " +
                                  hex(f.stamp.hash) + ")" + whose);
}

}  // namespace

Result<BakeCheck> verify_files(const Manifest& manifest, const fs::path& folder, const Progress& progress) {
    BakeCheck check;
    const double n = static_cast<double>(manifest.frames.size() + 1);
    const auto look_at = [&](const ManifestFile& f, const std::string& whose) { verify_file(f, folder, whose, check); };
    for (size_t i = 0; i < manifest.frames.size(); ++i) {
        const ManifestFrame& frame = manifest.frames[i];
        if (!progress.report(static_cast<double>(i) / n, "checking frame " + std::to_string(frame.frame)))
            return cancelled();
        frame.for_each_file([&](double at, const ManifestFile& f) { look_at(f, " (frame " + frame_text(at) + ")"); });
    }
    for (const ManifestFile& f : manifest.resume) {
        const bool is_baked =
            !manifest.frames.empty() && std::find_if(manifest.frames.back().files.begin(),
                                                     manifest.frames.back().files.end(), [&](const ManifestFile& g) {
                                                         return g.path == f.path && g.stamp == f.stamp;
                                                     }) != manifest.frames.back().files.end();
        if (!is_baked) look_at(f, " (state to resume from)");
    }
    if (manifest.log)
        for (const auto* files : {&manifest.log->breaks, &manifest.log->loads})
            for (const ManifestFile& f : *files) look_at(f, " (log)");
    const int next = manifest.frame_range[0] + static_cast<int>(manifest.frames.size());
    for (int f = next; f <= manifest.frame_range[1]; ++f) check.missing_frames.push_back(f);
    if (!check.missing_frames.empty())
        check.faults.push_back(frames_text(next, manifest.frame_range[1]) + " of " +
                               frames_text(manifest.frame_range[0], manifest.frame_range[1]) + " not baked yet");
    return check;
}

Result<BakeCheck> verify_bake(const fs::path& folder, const Progress& progress) {
    auto manifest = read_manifest(folder);
    if (!manifest) return manifest.error();
    auto check = verify_files(*manifest, folder, progress);
    if (check) verify_exports(*manifest, folder, *check);
    return check;
}

bool verify_exports(const Manifest& manifest, const fs::path& folder, BakeCheck& io_check) {
    const size_t n_faults = io_check.faults.size();
    for (const ManifestFile& f : manifest.exports)
        if (f.stamp == FileStamp{})
            io_check.faults.push_back(f.path + ": this export was not finished");
        else
            verify_file(f, folder, " (export)", io_check);
    return io_check.faults.size() == n_faults;
}

std::vector<ManifestFile> begun_files(const Manifest& manifest) {
    std::vector<ManifestFile> files;
    if (manifest.frames.empty()) return files;
    for (const auto& [name, node] : manifest.graph["nodes"].items()) {
        const auto steps = node.find("subframes"), path = node.find("path"), compression = node.find("compression");
        if (steps == node.end() || !steps->is_number_integer() || path == node.end() || !path->is_string() ||
            compression == node.end() || !compression->is_string() || !check_output_pattern(path->get<std::string>()))
            continue;
        const std::string pattern = path->get<std::string>() + compressed_suffix(compression->get<std::string>());
        const int n = std::min(steps->get<int>(), kMostSubFrames);
        for (int step = 1; step < n; ++step)
            files.push_back({name, output_path(pattern, sub_frame(manifest.frames.back().frame, step, n)), {}});
    }
    return files;
}

}  // namespace sunder
