// What stands behind the handles of sunder.h, and the edge at which exceptions and errors become statuses.
#pragma once

#include <atomic>
#include <exception>
#include <map>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "nodes/graph/graph.h"
#include "nodes/graph/value_arrays.h"
#include "plugin_src/c_api/sunder.h"

namespace sunder::c_api {

/// The last error of a handle, and the text that it gave out last.
struct Told {
    Error error;
    std::string error_text;
    sunder_status status = SUNDER_OK;
    std::string text;
};

inline sunder_status status_of(ErrorCode code) {
    switch (code) {
        case ErrorCode::bad_usage:
            return SUNDER_BAD_USAGE;
        case ErrorCode::bad_input:
            return SUNDER_BAD_INPUT;
        case ErrorCode::io:
            return SUNDER_IO;
        case ErrorCode::numerical:
            return SUNDER_NUMERICAL;
        case ErrorCode::cancelled:
            return SUNDER_CANCELLED;
        case ErrorCode::internal:
            break;
    }
    return SUNDER_INTERNAL;
}

inline sunder_status tell(Told& told, Error error) {
    told.status = status_of(error.code);
    told.error = std::move(error);
    told.error_text = told.error.text();
    return told.status;
}

inline constexpr const char* kNull = "an argument is NULL that must not be";

/// Runs `work` (which returns a Status) so that nothing is thrown across the boundary.
template <class Work>
sunder_status guarded(Told& told, Work&& work) noexcept {
    try {
        told.status = SUNDER_OK;
        try {
            const Status status = work();
            return status ? SUNDER_OK : tell(told, status.error());
        } catch (const std::bad_alloc&) {
            return tell(told, {ErrorCode::internal, "out of memory", {}, {}, {}, {}});
        } catch (const std::exception& e) {
            return tell(told, {ErrorCode::internal, std::string("unexpected: ") + e.what(), {}, {}, {}, {}});
        }
    } catch (...) {  // not even the error's text could be made
        told.status = SUNDER_INTERNAL;
        return SUNDER_INTERNAL;
    }
}

void fill_error(const Told& told, sunder_error* out);

/// Who uses a graph: one call or one job at a time. `freed`: the host is through with it, and who has it deletes it.
enum class Holder { nobody, call, job, freed };

/// Whether the graph is the caller's from now on. If it is another's, sunder_graph_error tells so on this thread: what
/// the graph has to tell is the other's.
bool take(sunder_graph& graph, Holder holder) noexcept;
void release(sunder_graph* graph) noexcept;

/// As much of a struct as the host knows, which may be an older or a newer one.
template <class Struct>
bool has_size(const Struct* s) {
    return s && s->struct_size >= sizeof(uint32_t);
}

/// The host's progress function and the handle's cancel flag as one Progress. Lives through one call.
class HostProgress {
public:
    HostProgress(const sunder_progress* host, std::atomic<bool>* cancel);
    Progress progress() const { return Progress(callback_); }

private:
    Progress::Callback callback_;
};

}  // namespace sunder::c_api

struct sunder_graph {
    sunder::Graph graph;
    sunder::c_api::Told told;  // of the last call; a job has its own until it is finished
    std::atomic<bool> cancel = false;
    std::atomic<sunder::c_api::Holder> holder = sunder::c_api::Holder::nobody;
};

namespace sunder::c_api {

/// A call on a graph, refused while another call or a job has it.
template <class Work>
sunder_status on_taken(sunder_graph* graph, Work&& work) noexcept {
    if (!graph || !take(*graph, Holder::call)) return SUNDER_BAD_USAGE;
    const sunder_status status = guarded(graph->told, work);
    release(graph);
    return status;
}

// What calls and jobs both do, with a graph that they took.
Status evaluate(sunder_graph& graph, const char* output, double frame, const Progress& progress,
                sunder_value** out_value);
Status evaluate_all(sunder_graph& graph, std::span<const char* const> outputs, double frame, const Progress& progress,
                    sunder_value** out_values);
Status bake(sunder_graph& graph, const sunder_bake_settings& settings, const Progress& progress, Told& out_told,
            sunder_bake_report* out_report);

}  // namespace sunder::c_api

struct sunder_value {
    explicit sunder_value(sunder::Value v) : value(std::move(v)), names(sunder::array_names(value)) {}

    sunder::Value value;
    std::vector<std::string> names;
    std::map<std::string, sunder::ArrayView, std::less<>> arrays;  // given out already; they live with the value
    sunder::c_api::Told told;
};
