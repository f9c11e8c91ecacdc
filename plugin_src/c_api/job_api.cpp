// Jobs: evaluating and baking on a thread of the library's own. The host looks at them when it likes; it is never
// called.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "plugin_src/c_api/handles.h"

using sunder::Progress;
using sunder::Status;
using namespace sunder::c_api;

struct sunder_job {
    explicit sunder_job(sunder_graph* g) : graph(g) {}

    sunder_graph* graph;  // taken until the job is finished, then NULL
    Told told;            // the work's, until it has ended
    std::atomic<bool> cancel = false;
    std::mutex mutex;  // of all below but the thread
    std::condition_variable has_ended;
    bool is_running = true;
    double fraction = 0;  // [0, 1]
    std::string text, given_text;
    sunder_status status = SUNDER_OK;
    sunder_bake_report report{};
    std::thread thread;
};

namespace {

int32_t on_progress(void* user, double fraction, const char* text) {
    auto* job = static_cast<sunder_job*>(user);
    const std::lock_guard lock(job->mutex);
    job->fraction = fraction;
    job->text = text;
    return !job->cancel;
}

sunder_status refuse_null(sunder_graph* graph) noexcept {
    return on_taken(graph, [] { return Status(sunder::bad_usage(kNull)); });
}

/// Takes the graph. `work` owns what it needs, for the caller returns at once.
template <class Work>
sunder_status start(sunder_graph* graph, sunder_job** out_job, Work work) noexcept {
    if (!take(*graph, Holder::job)) return SUNDER_BAD_USAGE;
    graph->cancel = false;
    const sunder_status status = guarded(graph->told, [&]() -> Status {
        auto made = std::make_unique<sunder_job>(graph);
        made->report.struct_size = sizeof made->report;
        made->thread = std::thread([job = made.get(), work = std::move(work)] {
            const sunder_status result = guarded(job->told, [&] {
                const sunder_progress progress{sizeof progress, on_progress, job};
                const HostProgress host(&progress, &job->graph->cancel);
                return work(*job, host.progress());
            });
            const std::lock_guard lock(job->mutex);
            job->status = result;
            job->is_running = false;
            job->has_ended.notify_all();
        });
        *out_job = made.release();
        return {};
    });
    if (status != SUNDER_OK) release(graph);
    return status;
}

}  // namespace

sunder_status sunder_graph_start_evaluate(sunder_graph* graph, const char* output, int32_t frame,
                                          sunder_job** out_job) {
    if (out_job) *out_job = nullptr;
    if (!graph || !output || !out_job) return refuse_null(graph);
    return start(graph, out_job, [frame, output = std::string(output)](sunder_job& job, const Progress& progress) {
        sunder_value* value = nullptr;
        const Status status = evaluate(*job.graph, output.c_str(), frame, progress, &value);
        sunder_value_free(value);
        return status;
    });
}

sunder_status sunder_graph_start_evaluate_all(sunder_graph* graph, const char* const* outputs, uint32_t n_outputs,
                                              int32_t frame, sunder_job** out_job) {
    return sunder_graph_start_evaluate_all_at(graph, outputs, n_outputs, frame, out_job);
}

sunder_status sunder_graph_start_evaluate_all_at(sunder_graph* graph, const char* const* outputs, uint32_t n_outputs,
                                                 double frame, sunder_job** out_job) {
    if (out_job) *out_job = nullptr;
    if (!graph || !out_job || (n_outputs > 0 && !outputs)) return refuse_null(graph);
    if (std::find(outputs, outputs + n_outputs, nullptr) != outputs + n_outputs) return refuse_null(graph);
    return start(graph, out_job,
                 [frame, own = std::vector<std::string>(outputs, outputs + n_outputs)](sunder_job& job,
                                                                                       const Progress& progress) {
                     std::vector<const char*> names;
                     for (const std::string& output : own) names.push_back(output.c_str());
                     std::vector<sunder_value*> values(names.size());
                     const Status status = evaluate_all(*job.graph, names, frame, progress, values.data());
                     for (sunder_value* value : values) sunder_value_free(value);
                     return status;
                 });
}

sunder_status sunder_graph_start_bake(sunder_graph* graph, const sunder_bake_settings* settings, sunder_job** out_job) {
    if (out_job) *out_job = nullptr;
    if (!graph || !settings || settings->struct_size < sizeof *settings || !settings->folder || !out_job)
        return refuse_null(graph);
    return start(graph, out_job,
                 [s = *settings, folder = std::string(settings->folder)](sunder_job& job, const Progress& progress) {
                     sunder_bake_settings own = s;
                     own.folder = folder.c_str();
                     return bake(*job.graph, own, progress, job.told, &job.report);
                 });
}

void sunder_job_look(sunder_job* job, sunder_job_state* out_state) {
    if (!job || !has_size(out_state)) return;
    const std::lock_guard lock(job->mutex);
    job->given_text = job->text;
    const sunder_job_state now{out_state->struct_size, job->is_running, job->fraction, job->given_text.c_str()};
    std::memcpy(out_state, &now, std::min<size_t>(out_state->struct_size, sizeof now));
}

void sunder_job_cancel(sunder_job* job) {
    if (job) job->cancel = true;
}

int32_t sunder_job_wait(sunder_job* job, double seconds) {
    if (!job) return 1;
    std::unique_lock lock(job->mutex);
    const std::chrono::duration<double> patience(seconds > 0 ? std::min(seconds, 1e6) : 0.0);  // nor for NaN
    return job->has_ended.wait_for(lock, patience, [&] { return !job->is_running; });
}

sunder_status sunder_job_finish(sunder_job* job, sunder_bake_report* out_report) {
    if (!job) return SUNDER_BAD_USAGE;
    if (job->thread.joinable()) job->thread.join();
    if (job->graph) {
        job->graph->told = std::move(job->told);
        if (job->report.notes) job->report.notes = job->graph->told.text.c_str();
        release(std::exchange(job->graph, nullptr));
    }
    if (has_size(out_report) && job->status == SUNDER_OK) {
        const uint32_t known = out_report->struct_size;
        std::memcpy(out_report, &job->report, std::min<size_t>(known, sizeof job->report));
        out_report->struct_size = known;
    }
    return job->status;
}

void sunder_job_free(sunder_job* job) {
    sunder_job_cancel(job);
    sunder_job_finish(job, nullptr);
    delete job;
}
