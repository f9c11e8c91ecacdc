// Graph handles: everything but evaluation.
#include <string>

#include "nodes/files/file_io.h"
#include "nodes/graph/registry.h"
#include "nodes/graph/strict_json.h"
#include "plugin_src/c_api/handles.h"

using sunder::bad_usage;
using sunder::Json;
using sunder::Status;
using sunder::c_api::guarded;

namespace sunder::c_api {

void fill_error(const Told& told, sunder_error* out) {
    if (!has_size(out)) return;
    const bool failed = told.status != SUNDER_OK;
    const auto text = [&](const std::string& s) { return failed ? s.c_str() : ""; };
    sunder_error e{out->struct_size,      told.status,           text(told.error_text), text(told.error.where),
                   text(told.error.what), text(told.error.mend), text(told.error.node), text(told.error.parameter)};
    std::memcpy(out, &e, std::min<size_t>(out->struct_size, sizeof e));
}

HostProgress::HostProgress(const sunder_progress* host, std::atomic<bool>* cancel) {
    const auto function = host && host->struct_size >= sizeof(sunder_progress) ? host->function : nullptr;
    void* const user = function ? host->user : nullptr;
    callback_ = [=](double fraction, std::string_view text) {
        if (cancel && cancel->load(std::memory_order_relaxed)) return false;
        return !function || function(user, fraction, std::string(text).c_str()) != 0;
    };
}

namespace {

Told told_of(Error error) {
    Told told;
    tell(told, std::move(error));
    return told;
}

const Told kCallIsAtWork = told_of(bad_usage("another call on this graph is at work", "wait for its end"));
const Told kJobIsRunning = told_of(bad_usage("a job of this graph is running", "finish it first; cancel ends it soon"));

// This thread's last call on a graph, if it was refused. (What the graph itself tells is for whoever has it.)
thread_local const sunder_graph* refusing_graph = nullptr;
thread_local const Told* refusal = nullptr;

Status no_null(std::initializer_list<const void*> arguments) {
    for (const void* p : arguments)
        if (!p) return bad_usage(kNull);
    return {};
}

// A call on a graph whose pointer arguments must be there.
template <class Work>
sunder_status on_graph(sunder_graph* graph, std::initializer_list<const void*> arguments, Work&& work) noexcept {
    return on_taken(graph, [&]() -> Status {
        if (Status s = no_null(arguments); !s) return s;
        return work(graph->graph);
    });
}

// Gives out JSON text that the handle keeps until its next call.
Status give(sunder_graph* graph, const Result<Json>& json, const char** out) {
    if (!json) return json.error();
    graph->told.text = json->dump(-1, ' ', false, Json::error_handler_t::replace);
    *out = graph->told.text.c_str();
    return {};
}

}  // namespace

bool take(sunder_graph& graph, Holder holder) noexcept {
    Holder before = Holder::nobody;
    const bool is_free = graph.holder.compare_exchange_strong(before, holder);
    refusing_graph = is_free ? nullptr : &graph;
    refusal = before == Holder::job ? &kJobIsRunning : &kCallIsAtWork;
    return is_free;
}

void release(sunder_graph* graph) noexcept {
    if (refusing_graph == graph) refusing_graph = nullptr;  // what the host asked meanwhile counts no more
    if (graph->holder.exchange(Holder::nobody) == Holder::freed) delete graph;
}

}  // namespace sunder::c_api

using namespace sunder::c_api;

uint32_t sunder_abi_version(void) { return SUNDER_ABI_VERSION; }
const char* sunder_version(void) { return SUNDER_VERSION; }

const char* sunder_node_types_json(void) {
    try {
        static const std::string text = sunder::descriptions_to_json().dump();
        return text.c_str();
    } catch (...) {
        return "";
    }
}

sunder_status sunder_graph_create(uint32_t abi_version, sunder_graph** out_graph) {
    if (!out_graph) return SUNDER_BAD_USAGE;
    *out_graph = nullptr;
    if (abi_version != SUNDER_ABI_VERSION) return SUNDER_BAD_USAGE;
    try {
        *out_graph = new sunder_graph;
        return SUNDER_OK;
    } catch (...) {
        return SUNDER_INTERNAL;
    }
}

void sunder_graph_free(sunder_graph* graph) {
    if (!graph) return;
    graph->cancel = true;
    if (graph->holder.exchange(Holder::freed) == Holder::nobody) delete graph;
}

void sunder_graph_error(const sunder_graph* graph, sunder_error* out_error) {
    if (graph) fill_error(graph == refusing_graph ? *refusal : graph->told, out_error);
}

sunder_status sunder_graph_load(sunder_graph* graph, const char* path) {
    return on_graph(graph, {path}, [&](sunder::Graph& g) -> Status {
        auto loaded = sunder::Graph::load(path);
        if (!loaded) return loaded.error();
        g = loaded.take();
        return {};
    });
}

sunder_status sunder_graph_parse(sunder_graph* graph, const char* json, const char* where, const char* base_folder) {
    return on_graph(graph, {json, where, base_folder}, [&](sunder::Graph& g) -> Status {
        auto parsed = sunder::Graph::from_json_text(json, where, base_folder);
        if (!parsed) return parsed.error();
        g = parsed.take();
        return {};
    });
}

sunder_status sunder_graph_save(sunder_graph* graph, const char* path) {
    return on_graph(graph, {path}, [&](sunder::Graph& g) -> Status {
        auto written = sunder::write_file(path, g.to_json().dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
        return written ? Status() : Status(written.error());
    });
}

sunder_status sunder_graph_json(sunder_graph* graph, int32_t all_defaults, const char** out_json) {
    return on_graph(graph, {out_json}, [&](sunder::Graph& g) {
        return give(graph, g.to_json(all_defaults ? sunder::Defaults::write : sunder::Defaults::leave_out), out_json);
    });
}

sunder_status sunder_graph_add_node(sunder_graph* graph, const char* name, const char* type) {
    return on_graph(graph, {name, type}, [&](sunder::Graph& g) { return g.add_node(name, type); });
}

sunder_status sunder_graph_remove_node(sunder_graph* graph, const char* name) {
    return on_graph(graph, {name}, [&](sunder::Graph& g) { return g.remove_node(name); });
}

sunder_status sunder_graph_connect(sunder_graph* graph, const char* output, const char* input) {
    return on_graph(graph, {output, input}, [&](sunder::Graph& g) -> Status {
        const auto from = sunder::parse_reference(output), to = sunder::parse_reference(input);
        if (!from) return from.error();
        if (!to) return to.error();
        return g.connect(*from, *to);
    });
}

sunder_status sunder_graph_disconnect(sunder_graph* graph, const char* input) {
    return on_graph(graph, {input}, [&](sunder::Graph& g) -> Status {
        const auto to = sunder::parse_reference(input);
        return to ? g.disconnect(*to) : Status(to.error());
    });
}

sunder_status sunder_graph_set(sunder_graph* graph, const char* node, const char* name, const char* json) {
    return on_graph(graph, {node, name, json}, [&](sunder::Graph& g) -> Status {
        const auto value = sunder::parse_json(json, std::string("node '") + node + "', parameter '" + name + "'");
        if (value) return g.set(node, name, *value);
        sunder::Error error = value.error();
        error.node = node;
        error.parameter = name;
        return error;
    });
}

sunder_status sunder_graph_get(sunder_graph* graph, const char* node, const char* name, const char** out_json) {
    return on_graph(graph, {node, name, out_json}, [&](sunder::Graph& g) -> Status {
        const auto wires = g.wires({node, name});
        if (!wires) return give(graph, g.parameter(node, name), out_json);
        Json list = Json::array();
        for (const sunder::SocketReference& w : *wires) list.push_back("@" + w.node + "." + w.socket);
        const bool many = (*g.describe(node))->find_input(name)->many;
        return give(graph, many ? list : list.empty() ? Json(nullptr) : list.front(), out_json);
    });
}

sunder_status sunder_graph_get_at(sunder_graph* graph, const char* node, const char* parameter, double frame,
                                  const char** out_json) {
    return on_graph(graph, {node, parameter, out_json},
                    [&](sunder::Graph& g) { return give(graph, g.parameter_at(node, parameter, frame), out_json); });
}

sunder_status sunder_graph_reset(sunder_graph* graph, const char* node, const char* parameter) {
    return on_graph(graph, {node, parameter}, [&](sunder::Graph& g) { return g.reset(node, parameter); });
}

sunder_status sunder_graph_set_frame_rate(sunder_graph* graph, double frames_per_second) {
    return on_graph(graph, {}, [&](sunder::Graph& g) { return g.set_frame_rate(frames_per_second); });
}

sunder_status sunder_graph_set_frame_ratio(sunder_graph* graph, int32_t frames, int32_t seconds) {
    return on_graph(graph, {}, [&](sunder::Graph& g) { return g.set_frame_rate(frames, seconds); });
}

sunder_status sunder_graph_set_frame_range(sunder_graph* graph, int32_t first, int32_t last) {
    return on_graph(graph, {}, [&](sunder::Graph& g) { return g.set_frame_range(first, last); });
}

sunder_status sunder_graph_set_threads(sunder_graph* graph, int32_t threads) {
    return on_graph(graph, {}, [&](sunder::Graph& g) { return g.set_threads(threads); });
}

sunder_status sunder_graph_set_cache_limit(sunder_graph* graph, uint64_t bytes) {
    return on_graph(graph, {}, [&](sunder::Graph& g) -> Status {
        g.set_cache_limit(bytes);
        return {};
    });
}

sunder_status sunder_graph_set_base_folder(sunder_graph* graph, const char* folder) {
    return on_graph(graph, {folder}, [&](sunder::Graph& g) -> Status {
        g.set_base_folder(folder);
        return {};
    });
}

sunder_status sunder_graph_set_cut_folder(sunder_graph* graph, const char* folder) {
    return on_graph(graph, {folder}, [&](sunder::Graph& g) -> Status {
        g.set_cut_folder(folder);
        return {};
    });
}

void sunder_graph_cancel(sunder_graph* graph) {
    if (graph) graph->cancel.store(true, std::memory_order_relaxed);
}
