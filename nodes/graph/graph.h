// The graph: named nodes, their parameters and wires, evaluated on demand at any frame.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/files/content_key.h"
#include "nodes/graph/description.h"
#include "nodes/graph/frame_rate.h"
#include "nodes/graph/registry.h"
#include "nodes/graph/value.h"
#include "solver/data/frame_state.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

/// One end of a wire: "@node.socket" in files.
struct SocketReference {
    std::string node, socket;
    bool operator==(const SocketReference&) const = default;
};

/// "node.socket" or "@node.socket", split at the last dot (node names may have dots). Also "node.parameter".
Result<SocketReference> parse_reference(std::string_view text);

enum class Defaults { leave_out, write };

/// Of graphs, under the key "sunder" of their files: new ones have the latest, and older ones keep what they were
/// written with. Version 2: `damping_time` of bodies is "auto" where it is left out.
constexpr int kFirstGraphVersion = 1, kLatestGraphVersion = 2;

/// Every edit is checked where it enters: unknown names (the nearest permitted one is offered), wrong types, values out
/// of range, wires that do not fit and cycles are refused with Error::node and Error::parameter set, code bad_input,
/// and leave the graph as it was. Not to be used from two threads at once.
class Graph {
public:
    explicit Graph(const Registry& registry = standard_registry());
    ~Graph();
    Graph(Graph&&) noexcept;
    Graph& operator=(Graph&&) noexcept;

    // Files (design: graph file). `where` names the text in errors; input paths are seen from `base_folder`.
    static Result<Graph> from_json_text(std::string_view text, const std::string& where, const std::string& base_folder,
                                        const Registry& registry = standard_registry());
    static Result<Graph> load(const std::string& path, const Registry& registry = standard_registry());
    Json to_json(Defaults defaults = Defaults::leave_out) const;

    // Nodes, in the order in which they were added.
    Status add_node(const std::string& name, const std::string& type);
    Status remove_node(const std::string& name);  // its wires go too
    bool has_node(std::string_view name) const;
    std::vector<std::string> node_names() const;
    Result<const NodeDescription*> describe(const std::string& node) const;

    // Wires. A single socket's wire is replaced, a list gets one more.
    Status connect(const SocketReference& output, const SocketReference& input);
    Status disconnect(const SocketReference& input);                                 // all wires of the input
    Result<std::vector<SocketReference>> wires(const SocketReference& input) const;  // outputs that feed it

    // Parameters, as in files: a value, null, or {"keys": ...}. `set` takes a socket's name too, with a wire
    // ("@node.socket"), a list of wires, or null for none.
    Status set(const std::string& node, const std::string& name, const Json& value);
    Status reset(const std::string& node, const std::string& parameter);                  // to its default
    Result<Json> parameter(const std::string& node, const std::string& parameter) const;  // as given, or the default
    Result<Json> parameter_at(const std::string& node, const std::string& parameter, double frame) const;

    /// Of a number from one frame to a later one.
    Result<double> integral(const std::string& node, const std::string& parameter, double from, double to) const;

    // Settings of the whole.
    int version() const;  // decides what parameters are that are left out
    FrameRate frame_rate() const;
    std::array<int, 2> frame_range() const;  // first and last frame, both included
    int threads() const;
    const std::string& base_folder() const;
    Status set_frame_rate(double frames, double seconds = 1);  // 1 .. 1000 frames per second
    Status set_frame_range(int first, int last);               // within +-1000000, first <= last
    Status set_threads(int threads);                           // 0: all cores; 1 .. 1024. Changes no result
    void set_base_folder(const std::string& folder);
    /// What prefracture nodes cut is kept there, the last cut of each node, and read from there by whoever asks for the
    /// same. Changes no result. Empty: nowhere.
    void set_cut_folder(const std::string& folder);
    void set_cache_limit(size_t bytes);  // that each solver keeps of past frames; 1 GiB unless told

    /// All required sockets wired and parameters in agreement, everywhere. `evaluate` checks the same of what it needs.
    Status check() const;

    /// The value of an output socket at a frame, or between two: 12.5. Cached: what no edit touched is not cooked
    /// again.
    Result<Value> evaluate(const std::string& node, const std::string& socket, double frame,
                           const Progress& progress = {});
    /// The values of several outputs at a frame, in their order: bit for bit what `evaluate` gives for each. Sooner
    /// than one by one, for deformers make their meshes side by side. Each has its own error, and what failed does not
    /// keep the others from being made; but once cancelled, all that follow are.
    std::vector<Result<Value>> evaluate_all(std::span<const SocketReference> outputs, double frame,
                                            const Progress& progress = {});

    /// Content keys of all nodes: of each one's type, parameters, files and of all that feeds it. A changed key names
    /// what changed.
    std::map<std::string, ContentKey> keys() const;
    /// The same without what feeds it: tells the node that was edited from those that only follow.
    std::map<std::string, ContentKey> own_keys() const;

    /// Gives a solver node a frame that was saved earlier with the same keys; evaluation continues from it. Errors:
    /// no solver; a state of the wrong size or with non-finite numbers.
    Status seed_state(const std::string& node, int frame, FrameState state, const Progress& progress = {});

    /// How often a node was really cooked; for tests and for finding slow graphs.
    size_t cook_count(const std::string& node) const;

private:
    std::unique_ptr<struct GraphImpl> impl_;
};

}  // namespace sunder
