#include "nodes/graph/evaluation.h"

#include <algorithm>
#include <exception>
#include <new>
#include <optional>
#include <set>

#include "nodes/files/frame_number.h"
#include "nodes/graph/cook_groups.h"
#include "nodes/graph/nearest_name.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr size_t kCachedFrames = 2;  // values a node keeps if they differ by frame; solvers keep more in their store
constexpr double kInputShare = 0.3;  // of a node's progress that goes to what feeds it

class NodeContext : public CookContext {
public:
    /// `of_inputs`: what evaluating them may tell; `own`: what the node itself may.
    NodeContext(Evaluation& evaluation, const WantedValue& wanted, double frame, const Progress& of_inputs,
                const Progress& own)
        : evaluation_(evaluation),
          node_(*wanted.node),
          output_(wanted.output),
          frame_(frame),
          of_inputs_(of_inputs),
          own_(own),
          n_wires_(count_wires(node_)) {}
    NodeContext(Evaluation& evaluation, const WantedValue& wanted, double frame, const Progress& whole)
        : NodeContext(evaluation, wanted, frame, whole.part(0, kInputShare),
                      count_wires(*wanted.node) ? whole.part(kInputShare, 1) : whole) {}

    const std::string& node() const override { return node_.name; }
    std::string_view output() const override { return node_.description().outputs[output_].name; }
    double frame() const override { return frame_; }
    int start_frame() const override { return graph().frame_range[0]; }
    double frame_rate() const override { return graph().frame_rate.per_second(); }
    double seconds(double n_frames) const override { return graph().frame_rate.seconds(n_frames); }
    int threads() const override { return graph().threads; }
    std::shared_ptr<const WorkerPool> workers() override { return evaluation_.graph().workers(); }
    size_t cache_limit() const override { return graph().cache_limit; }
    std::string resolve(const std::string& path) const override { return graph().resolve(path); }
    const Progress& progress() const override { return own_; }
    NodeStore& store() override { return node_.store; }
    ContentKey key() override { return evaluation_.key(node_); }
    ContentKey input_key(std::string_view socket) override { return evaluation_.socket_key(node_, index_of(socket)); }

    const Parameters& parameters(double frame) override { return parameters_.emplace(node_, frame); }

    double integral(std::string_view parameter, double from, double to) const override {
        return value_of(parameter).integral(from, to);
    }
    double slope(std::string_view parameter, double frame) const override { return value_of(parameter).slope(frame); }

    Result<std::vector<Value>> inputs(std::string_view socket, double frame) override {
        const size_t index = index_of(socket);
        size_t before = 0;
        for (size_t i = 0; i < index; ++i) before += node_.inputs[i].size();
        std::vector<Value> values;
        for (const Wire& wire : node_.inputs[index]) {
            const auto number = static_cast<double>(before + values.size()), n = static_cast<double>(n_wires_);
            Result<Value> value =
                evaluation_.evaluate(*wire.source, wire.output, frame, of_inputs_.part(number / n, (number + 1) / n));
            if (!value) return value.error();
            values.push_back(value.take());
        }
        return values;
    }

private:
    static size_t count_wires(const GraphNode& node) {
        size_t n = 0;
        for (const auto& socket : node.inputs) n += socket.size();
        return n;
    }
    const GraphImpl& graph() const { return evaluation_.graph(); }
    ParameterValue value_of(std::string_view parameter) const {
        const ParameterDescription* const found = node_.description().find_parameter(parameter);
        SUNDER_ASSERT(found && "a node reads a parameter that it does not describe");
        return node_.value(*found);
    }
    size_t index_of(std::string_view socket) const {
        const SocketDescription* const found = node_.description().find_input(socket);
        SUNDER_ASSERT(found && "a node reads an input that it does not describe");
        return index_in(node_.description().inputs, found);
    }

    Evaluation& evaluation_;
    GraphNode& node_;
    size_t output_;
    double frame_;
    Progress of_inputs_, own_;
    size_t n_wires_;
    std::optional<ParametersAt> parameters_;
};

Progress nth_part(const Progress& whole, size_t i, size_t n) {
    return whole.part(static_cast<double>(i) / static_cast<double>(n),
                      static_cast<double>(i + 1) / static_cast<double>(n));
}

/// Runs a node's function at the edge: exceptions of libraries become errors, and every error names the node.
template <class T, class Function>
Result<T> at_edge(const std::string& node, Function&& function) {
    Error error;
    try {
        Result<T> result = function();
        if (result || result.error().code == ErrorCode::cancelled || !result.error().node.empty()) return result;
        error = result.error();
    } catch (const std::bad_alloc&) {
        error = {ErrorCode::internal, "out of memory", {}, "fewer pieces or frames need less", {}, {}};
    } catch (const std::exception& e) {
        error = {ErrorCode::internal, std::string("unexpected: ") + e.what(), {}, {}, {}, {}};
    }
    const std::string place = "node '" + node + "'";
    if (!error.where.starts_with(place)) error.where = error.where.empty() ? place : place + ": " + error.where;
    error.node = node;
    return error;
}

/// Forgets the values of a node and of all that it feeds.
void forget_values_from(const GraphImpl& graph, GraphNode& node) {
    std::set<const GraphNode*> stale = {&node};
    const auto is_fed = [&](const GraphNode& by) {
        return std::ranges::any_of(by.inputs, [&](const std::vector<Wire>& socket) {
            return std::ranges::any_of(socket, [&](const Wire& wire) { return stale.contains(wire.source); });
        });
    };
    for (size_t known = 0; known < stale.size();) {
        known = stale.size();
        for (const auto& other : graph.nodes)
            if (is_fed(*other)) stale.insert(other.get());
    }
    for (const auto& other : graph.nodes)
        if (stale.contains(other.get())) other->cache.clear();
}

Result<WantedValue> find_output(const GraphImpl& graph, const SocketReference& reference) {
    Result<GraphNode*> node = graph.find(reference.node);
    if (!node) return node.error();
    const NodeDescription& description = (*node)->description();
    if (const SocketDescription* const output = description.find_output(reference.socket))
        return WantedValue{*node, index_in(description.outputs, output)};
    std::vector<std::string> permitted;
    for (const SocketDescription& s : description.outputs) permitted.push_back(s.name);
    return node_error(reference.node, reference.socket,
                      "a node of type " + description.type + " has no output '" + reference.socket + "'",
                      permitted_text(reference.socket, permitted));
}

}  // namespace

Status Evaluation::check_upstream(const GraphNode& node) {
    if (const auto known = checked_.find(&node); known != checked_.end()) return known->second;
    Status status;
    for (const auto& socket : node.inputs)
        for (const Wire& wire : socket)
            if (status) status = check_upstream(*wire.source);
    if (status) status = check_node(node, graph_.frame_range[0]);
    return checked_[&node] = status;
}

const Value* Evaluation::find(const GraphNode& node, size_t output, double frame) {
    const auto known = std::ranges::find_if(node.cache, [&](const CachedValue& c) {
        return c.key == key(node) && c.frame == slot(node, frame) && c.output == output;
    });
    return known == node.cache.end() ? nullptr : &known->value;
}

Result<Value> Evaluation::keep(GraphNode& node, size_t output, double frame, Result<Value> value) {
    if (!value) {
        is_cancelled_ = is_cancelled_ || value.error().code == ErrorCode::cancelled;
        failed_[{&node, output, slot(node, frame)}] = value.error();
        return value;
    }
    SUNDER_ASSERT(type_of(*value) == node.description().outputs[output].type &&
                  "a node gave another type than it describes");

    // What was cooked from other content will not be asked for again.
    std::erase_if(node.cache, [&](const CachedValue& c) { return c.key != key(node); });
    const size_t capacity = node.description().outputs.size() * (depends_on_frame(node) ? kCachedFrames : 1);
    node.cache.insert(node.cache.begin(), {key(node), slot(node, frame), output, *value});
    if (node.cache.size() > capacity) node.cache.pop_back();
    return value;
}

Result<Value> Evaluation::evaluate(GraphNode& node, size_t output, double frame, const Progress& progress) {
    if (is_cancelled_) return cancelled();
    if (const Value* known = find(node, output, frame)) return *known;
    if (const auto known = failed_.find({&node, output, slot(node, frame)}); known != failed_.end())
        return known->second;

    NodeContext context(*this, {&node, output}, frame, progress);
    ++node.cook_count;
    const CutFolder kept = node.type->is_cut && !depends_on_frame(node) ? graph_.cuts : CutFolder();
    return keep(node, output, frame, at_edge<Value>(node.name, [&]() -> Result<Value> {
                    if (!kept) return node.type->cook(context);
                    if (auto cut = kept.read(node.name, key(node))) return make_value(std::move(*cut));
                    Result<Value> made = node.type->cook(context);
                    if (made) kept.write(node.name, key(node), *std::get<std::shared_ptr<const FragmentSet>>(*made));
                    return made;
                }));
}

void Evaluation::cook_together(std::span<const WantedValue> group, double frame, const Progress& progress) {
    // The inputs of all, then the work of all.
    const Progress of_inputs = progress.part(0, kInputShare), own = progress.part(kInputShare, 1);
    std::vector<std::unique_ptr<NodeContext>> contexts;
    std::vector<CookContext*> views;
    for (size_t i = 0; i < group.size(); ++i) {
        contexts.push_back(std::make_unique<NodeContext>(*this, group[i], frame, nth_part(of_inputs, i, group.size()),
                                                         nth_part(own, i, group.size())));
        views.push_back(contexts.back().get());
    }
    std::vector<Result<Value>> values;
    try {
        values = group.front().node->type->cook_together(views);
    } catch (const std::exception&) {
        return;  // whose fault it was shows when each is cooked by itself
    }
    SUNDER_ASSERT(values.size() == group.size());
    for (size_t i = 0; i < group.size(); ++i) {
        GraphNode& node = *group[i].node;
        ++node.cook_count;
        (void)keep(node, group[i].output, frame, at_edge<Value>(node.name, [&] { return std::move(values[i]); }));
    }
}

std::vector<Result<Value>> Evaluation::evaluate_all(std::span<const WantedValue> wanted, double frame,
                                                    const Progress& progress) {
    const std::vector<std::vector<WantedValue>> groups = cook_groups(*this, wanted, frame);
    size_t n_nodes = wanted.size(), n_done = 0;  // in steps of progress
    for (const auto& group : groups) n_nodes += group.size();
    const auto next = [&](size_t n) {
        const double whole = static_cast<double>(n_nodes), begin = static_cast<double>(n_done);
        n_done += n;
        return progress.part(begin / whole, static_cast<double>(n_done) / whole);
    };
    for (const auto& group : groups)
        if (!is_cancelled_) cook_together(group, frame, next(group.size()));
    std::vector<Result<Value>> values;
    for (const WantedValue& w : wanted) values.push_back(evaluate(*w.node, w.output, frame, next(1)));
    return values;
}

Status Evaluation::seed(GraphNode& node, int frame, FrameState state, const Progress& progress) {
    if (!node.type->seed) return node_error(node.name, "", "takes no saved state", "only solver nodes do");
    NodeContext context(*this, {&node, 0}, frame, progress);
    Status ok = at_edge<void>(node.name, [&] { return node.type->seed(context, frame, std::move(state)); });
    if (!ok) return ok;
    forget_values_from(graph_, node);  // keys do not tell what was seeded
    return {};
}

Result<Value> Graph::evaluate(const std::string& name, const std::string& socket, double frame,
                              const Progress& progress) {
    const SocketReference output{name, socket};
    return std::move(evaluate_all({&output, 1}, frame, progress).front());
}

std::vector<Result<Value>> Graph::evaluate_all(std::span<const SocketReference> outputs, double frame,
                                               const Progress& progress) {
    if (!(std::abs(frame) <= kFarthestFrame))
        return std::vector<Result<Value>>(outputs.size(), bad_input("frame " + frame_text(frame), "is out of range",
                                                                    "permitted: -1000000 to 1000000"));
    Evaluation evaluation(*impl_);
    std::vector<Status> status;
    std::vector<WantedValue> wanted;
    for (const SocketReference& output : outputs) {
        const Result<WantedValue> found = find_output(*impl_, output);
        status.push_back(found ? evaluation.check_upstream(*found->node) : Status(found.error()));
        if (status.back()) wanted.push_back(*found);
    }
    std::vector<Result<Value>> values = evaluation.evaluate_all(wanted, frame, progress), all;
    size_t n_evaluated = 0;
    for (const Status& s : status) all.push_back(s ? std::move(values[n_evaluated++]) : Result<Value>(s.error()));
    return all;
}

Status Graph::seed_state(const std::string& name, int frame, FrameState state, const Progress& progress) {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Evaluation evaluation(*impl_);
    if (Status ok = evaluation.check_upstream(**node); !ok) return ok;
    return evaluation.seed(**node, frame, std::move(state), progress);
}

}  // namespace sunder
