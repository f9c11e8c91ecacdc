// Evaluation, values and files.
#include <algorithm>
#include <cstring>
#include <vector>

#include "nodes/bake.h"
#include "nodes/bake_files/manifest.h"
#include "nodes/break_report.h"
#include "nodes/exports/fragment_folder.h"
#include "nodes/exports/shot_export.h"
#include "nodes/graph/json.h"
#include "plugin_src/c_api/handles.h"

using sunder::bad_usage;
using sunder::Json;
using sunder::Status;
using namespace sunder::c_api;

namespace {

// A call on a graph that may take long: a cancel of an earlier call is forgotten, this call's is looked for.
template <class Work>
sunder_status long_call(sunder_graph* graph, bool arguments_there, const sunder_progress* host, Work&& work) noexcept {
    return on_taken(graph, [&]() -> Status {
        if (!arguments_there) return bad_usage(kNull);
        graph->cancel = false;
        const HostProgress progress(host, &graph->cancel);
        return work(progress.progress());
    });
}

// Of a state that lies between two simulated frames.
enum class Between { is_refused, is_shown };

sunder_status place(sunder_graph* graph, const char* node, int32_t frame, const sunder_value* state, Between between) {
    return long_call(graph, node && state, nullptr, [&](const sunder::Progress& p) -> Status {
        const auto* value = std::get_if<std::shared_ptr<const sunder::StateValue>>(&state->value);
        if (!value) return bad_usage("a " + std::string(name_of(type_of(state->value))) + " is no state");
        if (between == Between::is_refused && !(*value)->at.is_on_grid())
            return sunder::bad_input("state", "lies between two simulated frames: nothing goes on from it",
                                     "take one of a whole simulated frame");
        return graph->graph.seed_state(node, frame, *(*value)->state, p);
    });
}

}  // namespace

Status sunder::c_api::evaluate(sunder_graph& graph, const char* output, double frame, const Progress& progress,
                               sunder_value** out_value) {
    const auto reference = parse_reference(output);
    if (!reference) return reference.error();
    auto value = graph.graph.evaluate(reference->node, reference->socket, frame, progress);
    if (!value) return value.error();
    *out_value = new sunder_value(value.take());
    return {};
}

Status sunder::c_api::evaluate_all(sunder_graph& graph, std::span<const char* const> outputs, double frame,
                                   const Progress& progress, sunder_value** out_values) {
    std::vector<Status> named;  // of each output
    std::vector<SocketReference> references;
    for (const char* output : outputs) {
        const auto reference = parse_reference(output);
        named.push_back(reference ? Status() : reference.error());
        if (reference) references.push_back(*reference);
    }
    auto values = graph.graph.evaluate_all(references, frame, progress);
    auto next = values.begin();
    Status first;
    for (size_t i = 0; i < outputs.size(); ++i) {
        Result<Value> value = named[i] ? std::move(*next++) : named[i].error();
        if (value)
            out_values[i] = new sunder_value(value.take());
        else if (first)
            first = value.error();
    }
    return first;
}

Status sunder::c_api::bake(sunder_graph& graph, const sunder_bake_settings& settings, const Progress& progress,
                           Told& out_told, sunder_bake_report* out_report) {
    if (settings.start < SUNDER_BAKE_FRESH || settings.start > SUNDER_BAKE_RESTART)
        return bad_usage("there is no such way to start a bake");
    BakeSettings s;
    s.folder = settings.folder;
    if (settings.has_frames) s.frames = {settings.first_frame, settings.last_frame};
    s.start = static_cast<BakeStart>(settings.start);
    const auto report = sunder::bake(graph.graph, s, progress);
    if (!report) return report.error();
    if (!has_size(out_report)) return {};
    out_told.text = Json(report->notes).dump(-1, ' ', false, Json::error_handler_t::replace);
    const sunder_bake_report r{out_report->struct_size, report->frames[0], report->frames[1], report->first_new_frame,
                               report->n_frames,        report->n_files,   report->bytes,     out_told.text.c_str()};
    std::memcpy(out_report, &r, std::min<size_t>(out_report->struct_size, sizeof r));
    return {};
}

sunder_status sunder_graph_evaluate(sunder_graph* graph, const char* output, int32_t frame,
                                    const sunder_progress* progress, sunder_value** out_value) {
    if (out_value) *out_value = nullptr;
    return long_call(graph, output && out_value, progress,
                     [&](const sunder::Progress& p) { return evaluate(*graph, output, frame, p, out_value); });
}

sunder_status sunder_graph_evaluate_all(sunder_graph* graph, const char* const* outputs, uint32_t n_outputs,
                                        int32_t frame, const sunder_progress* progress, sunder_value** out_values) {
    return sunder_graph_evaluate_all_at(graph, outputs, n_outputs, frame, progress, out_values);
}

sunder_status sunder_graph_evaluate_all_at(sunder_graph* graph, const char* const* outputs, uint32_t n_outputs,
                                           double frame, const sunder_progress* progress, sunder_value** out_values) {
    if (out_values) std::fill_n(out_values, n_outputs, nullptr);
    const bool all_there =
        n_outputs == 0 ||
        (outputs && out_values && std::all_of(outputs, outputs + n_outputs, [](const char* o) { return o; }));
    return long_call(graph, all_there, progress, [&](const sunder::Progress& p) {
        return evaluate_all(*graph, {outputs, n_outputs}, frame, p, out_values);
    });
}

sunder_status sunder_graph_read_state(sunder_graph* graph, const char* path, sunder_value** out_value) {
    if (out_value) *out_value = nullptr;
    return long_call(graph, path && out_value, nullptr, [&](const sunder::Progress&) -> Status {
        auto file = sunder::read_state_file(path);
        if (!file) return file.error();
        *out_value = new sunder_value(sunder::state_value(file.take()));
        return {};
    });
}

sunder_status sunder_graph_seed_state(sunder_graph* graph, const char* node, int32_t frame, const sunder_value* state) {
    return place(graph, node, frame, state, Between::is_refused);
}

sunder_status sunder_graph_show_state(sunder_graph* graph, const char* node, int32_t frame, const sunder_value* state) {
    return place(graph, node, frame, state, Between::is_shown);
}

void sunder_value_free(sunder_value* value) { delete value; }

void sunder_value_error(const sunder_value* value, sunder_error* out_error) {
    if (value) fill_error(value->told, out_error);
}

const char* sunder_value_type(const sunder_value* value) { return value ? name_of(type_of(value->value)).data() : ""; }
uint32_t sunder_value_array_count(const sunder_value* value) {
    return value ? static_cast<uint32_t>(value->names.size()) : 0;
}

const char* sunder_value_array_name(const sunder_value* value, uint32_t index) {
    return value && index < value->names.size() ? value->names[index].c_str() : nullptr;
}

sunder_status sunder_value_array(sunder_value* value, const char* name, sunder_array* out_array) {
    if (!value) return SUNDER_BAD_USAGE;
    return guarded(value->told, [&]() -> Status {
        if (!name || !has_size(out_array)) return bad_usage(name ? "struct_size of the array is not set" : kNull);
        auto known = value->arrays.find(name);
        if (known == value->arrays.end()) {
            auto view = sunder::value_array(value->value, name);
            if (!view) return view.error();
            known = value->arrays.emplace(name, view.take()).first;
        }
        const sunder::ArrayView& view = known->second;
        sunder_array array{};
        array.struct_size = out_array->struct_size;
        array.type = static_cast<sunder_array_type>(view.type);
        array.data = view.data;
        array.rank = static_cast<uint32_t>(view.shape.size());
        std::copy(view.shape.begin(), view.shape.end(), array.shape);
        std::memcpy(out_array, &array, std::min<size_t>(out_array->struct_size, sizeof array));
        return {};
    });
}

sunder_status sunder_value_info(sunder_value* value, const char** out_json) {
    if (!value) return SUNDER_BAD_USAGE;
    return guarded(value->told, [&]() -> Status {
        if (!out_json) return bad_usage(kNull);
        value->told.text = sunder::value_info(value->value).dump(-1, ' ', false, Json::error_handler_t::replace);
        *out_json = value->told.text.c_str();
        return {};
    });
}

sunder_status sunder_value_part(sunder_value* value, const char* name, uint64_t index, sunder_value** out_value) {
    if (out_value) *out_value = nullptr;
    if (!value) return SUNDER_BAD_USAGE;
    return guarded(value->told, [&]() -> Status {
        if (!name || !out_value) return bad_usage(kNull);
        auto part = sunder::value_part(value->value, name, index);
        if (!part) return part.error();
        *out_value = new sunder_value(part.take());
        return {};
    });
}

sunder_status sunder_graph_bake(sunder_graph* graph, const sunder_bake_settings* settings,
                                const sunder_progress* progress, sunder_bake_report* out_report) {
    const bool there = settings && settings->struct_size >= sizeof *settings && settings->folder;
    return long_call(graph, there, progress,
                     [&](const sunder::Progress& p) { return bake(*graph, *settings, p, graph->told, out_report); });
}

sunder_status sunder_graph_verify_bake(sunder_graph* graph, const char* folder, const sunder_progress* progress,
                                       const char** out_json) {
    return long_call(graph, folder && out_json, progress, [&](const sunder::Progress& p) -> Status {
        const auto check = sunder::verify_bake(folder, p);
        if (!check) return check.error();
        const Json json = {{"files", check->n_files},
                           {"bytes", check->bytes},
                           {"faults", check->faults},
                           {"missing_frames", check->missing_frames}};
        graph->told.text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
        *out_json = graph->told.text.c_str();
        return {};
    });
}

sunder_status sunder_graph_report_bake(sunder_graph* graph, const char* folder, const char* fragments,
                                       const char** out_json) {
    return long_call(graph, folder && out_json, nullptr, [&](const sunder::Progress&) -> Status {
        const auto choice = sunder::fragment_choice(fragments ? fragments : "{}");
        if (!choice) return choice.error();
        const auto report = sunder::break_report(folder, *choice);
        if (!report) return report.error();
        graph->told.text = to_json(*report).dump(-1, ' ', false, Json::error_handler_t::replace);
        *out_json = graph->told.text.c_str();
        return {};
    });
}

sunder_status sunder_graph_export_bake(sunder_graph* graph, const sunder_export_settings* settings,
                                       const sunder_progress* progress, const char** out_json) {
    const bool there = settings && settings->struct_size >= sizeof *settings && settings->bake && settings->file;
    return long_call(graph, there && out_json, progress, [&](const sunder::Progress& p) -> Status {
        sunder::BakeExport wanted{.bake = settings->bake,
                                  .settings = {.file = settings->file, .tolerance = settings->tolerance},
                                  .choice = {.node = settings->node ? settings->node : ""},
                                  .overwrite = settings->overwrite != 0};
        if (settings->has_frames) wanted.choice.frames = {settings->first_frame, settings->last_frame};
        const auto report = sunder::export_bake(wanted, p);
        if (!report) return report.error();
        Json json = {{"frames", report->frames}, {"files", Json::array()}, {"note", report->note}};
        for (const auto& [path, unused] : report->files) json["files"].push_back(path.string());
        graph->told.text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
        *out_json = graph->told.text.c_str();
        return {};
    });
}

sunder_status sunder_value_write_fragments(sunder_value* value, const char* folder, const sunder_progress* progress) {
    if (!value) return SUNDER_BAD_USAGE;
    return guarded(value->told, [&]() -> Status {
        if (!folder) return bad_usage(kNull);
        const auto* set = std::get_if<std::shared_ptr<const sunder::FragmentSet>>(&value->value);
        if (!set) return bad_usage("a " + std::string(name_of(type_of(value->value))) + " is no set of fragments");
        const HostProgress host(progress, nullptr);
        return sunder::write_fragments(**set, folder, host.progress());
    });
}
