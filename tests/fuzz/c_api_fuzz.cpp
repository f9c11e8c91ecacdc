// Lines as calls of the C interface: each ends in a status, and a refusal has its sentence. `~` is NULL.
//
//   set<TAB>clay<TAB>toughness<TAB>0.2
//
// Nothing is read or written on disk, and only small shots are evaluated.
#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "plugin_src/c_api/sunder.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using sunder::testing::require;
using Words = std::vector<std::string>;

constexpr size_t kMostCalls = 40;
constexpr double kLargest = 8;  // of what says how much there is to do

bool is_small(const nlohmann::json& value) {
    if (value.is_number()) return std::abs(value.get<double>()) <= kLargest;
    return !value.is_array() || std::all_of(value.begin(), value.end(), is_small);
}

class Session {
public:
    Session() { require(sunder_graph_create(SUNDER_ABI_VERSION, &graph_) == SUNDER_OK, "there is no graph"); }
    ~Session() {
        sunder_job_free(job_);
        sunder_value_free(value_);
        sunder_graph_free(graph_);
    }
    Session(const Session&) = delete;

    void call(const Words& words) {
        words_ = &words;
        const auto known = calls().find(words[0]);
        if (known != calls().end()) known->second(*this);
    }

private:
    using Calls = std::map<std::string, std::function<void(Session&)>, std::less<>>;

    const char* text(size_t i) const {
        return i >= words_->size() || (*words_)[i] == "~" ? nullptr : (*words_)[i].c_str();
    }
    int32_t number(size_t i) const {
        return i < words_->size() ? static_cast<int32_t>(std::strtol((*words_)[i].c_str(), nullptr, 10)) : 0;
    }
    double real(size_t i) const { return i < words_->size() ? std::strtod((*words_)[i].c_str(), nullptr) : 0.0; }

    void of_graph(sunder_status status) {
        sunder_error error{};
        error.struct_size = sizeof error;
        sunder_graph_error(graph_, &error);
        check(status, error);
    }
    void of_value(sunder_status status) {
        if (!value_) return;
        sunder_error error{};
        error.struct_size = sizeof error;
        sunder_value_error(value_, &error);
        check(status, error);
    }
    static void check(sunder_status status, const sunder_error& error) {
        require(status >= SUNDER_OK && status < SUNDER_INTERNAL, "an internal error");
        require(error.status == status, "an error that was told before");
        if (status == SUNDER_OK) return;
        require(error.text && *error.text && error.what && *error.what, "a refusal without a sentence");
        require(error.where && error.mend && error.node && error.parameter, "an error has a NULL");
    }
    void gives(sunder_status status, const char* const& json) {  // by reference: it is there once the status is
        of_graph(status);
        if (status == SUNDER_OK) require(json && nlohmann::json::accept(json), "what is given is no JSON");
    }
    void replace(sunder_value* value) {
        sunder_value_free(value_);
        value_ = value;
    }

    /// Whether what there is to do is done at once.
    bool is_small_shot() {
        const char* json = nullptr;
        if (sunder_graph_json(graph_, 1, &json) != SUNDER_OK) return false;
        const auto nodes = nlohmann::json::parse(json)["nodes"];
        for (const auto& node : nodes) {
            if (node["type"] == "mesh_file" || node.value("error_budget", 0.0) != 0) return false;
            for (const char* name :
                 {"cells", "substeps", "iterations", "hit_substeps", "crack_passes", "pieces", "resolution"})
                if (node.contains(name) && !is_small(node[name]) && node["type"] != "prefracture" &&
                    node["type"] != "collider")
                    return false;
        }
        return nodes.size() <= kLargest;
    }
    int32_t small_frame(size_t i) const { return std::clamp(number(i), -1, 3); }

    void evaluate() {
        if (!is_small_shot()) return;
        struct Patience {
            int left;
        } patience{200};
        sunder_progress progress{sizeof progress,
                                 [](void* user, double fraction, const char* at) -> int32_t {
                                     require(fraction >= 0 && fraction <= 1 && at, "progress out of range");
                                     return --static_cast<Patience*>(user)->left > 0;
                                 },
                                 &patience};
        sunder_value* value = nullptr;
        const sunder_status status = sunder_graph_evaluate(graph_, text(1), small_frame(2), &progress, &value);
        of_graph(status);
        require((status == SUNDER_OK) == (value != nullptr), "a status that does not fit the value");
        if (value) replace(value);
    }
    void evaluate_all() {
        if (!is_small_shot()) return;
        std::vector<const char*> outputs;
        for (size_t i = 2; i < words_->size(); ++i) outputs.push_back(text(i));
        std::vector<sunder_value*> values(outputs.size());
        const double quarters = std::clamp(number(1), -4, 12);
        of_graph(sunder_graph_evaluate_all_at(graph_, outputs.data(), static_cast<uint32_t>(outputs.size()),
                                              quarters / 4, nullptr, values.data()));
        for (sunder_value* value : values) sunder_value_free(value);
    }
    void look_at_value() {
        if (!value_) return;
        require(sunder_value_type(value_) != nullptr, "a value without a type");
        const uint32_t n = sunder_value_array_count(value_);
        for (uint32_t i = 0; i < n; ++i) {
            sunder_array array{};
            array.struct_size = sizeof array;
            require(sunder_value_array(value_, sunder_value_array_name(value_, i), &array) == SUNDER_OK,
                    "an array is not there");
            look_at(array);
        }
        require(sunder_value_array_name(value_, n) == nullptr, "there is an array behind the last");
        const char* json = nullptr;
        of_value(sunder_value_info(value_, &json));
    }
    static void look_at(const sunder_array& array) {
        constexpr std::array<size_t, 5> kBytes = {1, 4, 4, 4, 8};
        size_t bytes = kBytes.at(static_cast<size_t>(array.type));
        require(array.rank <= 4, "an array of too many dimensions");
        for (uint32_t i = 0; i < array.rank; ++i) bytes *= array.shape[i];
        require(bytes == 0 || array.data, "an array without numbers");
        uint8_t sum = 0;  // every byte is there
        for (size_t i = 0; i < bytes; ++i) sum = static_cast<uint8_t>(sum + static_cast<const uint8_t*>(array.data)[i]);
        volatile uint8_t sink = sum;
        (void)sink;
    }
    void array() {
        if (!value_) return;
        const uint32_t size = std::min<uint32_t>(static_cast<uint32_t>(number(2)), sizeof(sunder_array));
        // What lies behind struct_size is not the library's.
        const auto memory = std::make_unique<char[]>(std::max<size_t>(size, sizeof size));
        std::memcpy(memory.get(), &size, sizeof size);
        of_value(sunder_value_array(value_, text(1), reinterpret_cast<sunder_array*>(memory.get())));
    }
    void part() {
        if (!value_) return;
        sunder_value* value = nullptr;
        of_value(sunder_value_part(value_, text(1), static_cast<uint64_t>(number(2)), &value));
        if (value) replace(value);
    }
    void start() {
        if (job_ || !is_small_shot()) return;
        of_graph(sunder_graph_start_evaluate(graph_, text(1), small_frame(2), &job_));
    }
    /// With a job of it at work, too; only the job can then be freed.
    void free() {
        sunder_graph_free(graph_);
        if (job_) sunder_job_free(job_);
        job_ = nullptr;
        require(sunder_graph_create(SUNDER_ABI_VERSION, &graph_) == SUNDER_OK, "there is no graph");
    }
    void look() {
        sunder_job_state state{};
        state.struct_size = sizeof state;
        if (job_) sunder_job_look(job_, &state);
    }
    void finish() {
        if (!job_) return;
        of_graph(sunder_job_finish(job_, nullptr));
        sunder_job_free(job_);
        job_ = nullptr;
    }

    static const Calls& calls() {
        static const Calls known = {
            {"add", [](Session& s) { s.of_graph(sunder_graph_add_node(s.graph_, s.text(1), s.text(2))); }},
            {"remove", [](Session& s) { s.of_graph(sunder_graph_remove_node(s.graph_, s.text(1))); }},
            {"connect", [](Session& s) { s.of_graph(sunder_graph_connect(s.graph_, s.text(1), s.text(2))); }},
            {"disconnect", [](Session& s) { s.of_graph(sunder_graph_disconnect(s.graph_, s.text(1))); }},
            {"set", [](Session& s) { s.of_graph(sunder_graph_set(s.graph_, s.text(1), s.text(2), s.text(3))); }},
            {"get",
             [](Session& s) {
                 const char* json = nullptr;
                 s.gives(sunder_graph_get(s.graph_, s.text(1), s.text(2), &json), json);
             }},
            {"get_at",
             [](Session& s) {
                 const char* json = nullptr;
                 s.gives(sunder_graph_get_at(s.graph_, s.text(1), s.text(2), s.real(3), &json), json);
             }},
            {"reset", [](Session& s) { s.of_graph(sunder_graph_reset(s.graph_, s.text(1), s.text(2))); }},
            {"rate", [](Session& s) { s.of_graph(sunder_graph_set_frame_rate(s.graph_, s.real(1))); }},
            {"ratio", [](Session& s) { s.of_graph(sunder_graph_set_frame_ratio(s.graph_, s.number(1), s.number(2))); }},
            {"range", [](Session& s) { s.of_graph(sunder_graph_set_frame_range(s.graph_, s.number(1), s.number(2))); }},
            {"cache",
             [](Session& s) {
                 s.of_graph(sunder_graph_set_cache_limit(s.graph_, static_cast<uint64_t>(s.number(1))));
             }},
            {"threads", [](Session& s) { s.of_graph(sunder_graph_set_threads(s.graph_, std::min(s.number(1), 2))); }},
            {"json",
             [](Session& s) {
                 const char* json = nullptr;
                 s.gives(sunder_graph_json(s.graph_, s.number(1), &json), json);
             }},
            {"parse", [](Session& s) { s.of_graph(sunder_graph_parse(s.graph_, s.text(1), s.text(2), s.text(3))); }},
            {"seed",
             [](Session& s) {
                 if (s.is_small_shot())
                     s.of_graph(sunder_graph_seed_state(s.graph_, s.text(1), s.small_frame(2), s.value_));
             }},
            {"show",
             [](Session& s) {
                 if (s.is_small_shot())
                     s.of_graph(sunder_graph_show_state(s.graph_, s.text(1), s.small_frame(2), s.value_));
             }},
            {"cancel", [](Session& s) { sunder_graph_cancel(s.graph_); }},
            {"free", &Session::free},
            {"evaluate", &Session::evaluate},
            {"evaluate_all", &Session::evaluate_all},
            {"value", &Session::look_at_value},
            {"array", &Session::array},
            {"part", &Session::part},
            {"start", &Session::start},
            {"look", &Session::look},
            {"cancel_job",
             [](Session& s) {
                 if (s.job_) sunder_job_cancel(s.job_);
             }},
            {"wait",
             [](Session& s) {
                 if (s.job_) sunder_job_wait(s.job_, std::clamp(s.real(1), -1.0, 0.01));
             }},
            {"finish", &Session::finish}};
        return known;
    }

    sunder_graph* graph_ = nullptr;
    sunder_value* value_ = nullptr;
    sunder_job* job_ = nullptr;
    const Words* words_ = nullptr;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view text = sunder::testing::text_of(data, size);
    Session session;
    size_t n_calls = 0;
    for (size_t at = 0; at < text.size() && n_calls < kMostCalls; ++n_calls) {
        const std::string_view line = text.substr(at, text.find('\n', at) - at);
        at += line.size() + 1;
        Words words;
        for (size_t begin = 0; begin <= line.size();) {
            const size_t end = std::min(line.find('\t', begin), line.size());
            words.emplace_back(line.substr(begin, end - begin));
            words.back().resize(std::strlen(words.back().c_str()));  // as C sees it
            begin = end + 1;
        }
        session.call(words);
    }
    return 0;
}
