// A node type: its description and the functions that make it work. Nodes are thin: they read inputs and parameters,
// call one library function and translate its errors.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <typeindex>
#include <typeinfo>
#include <utility>
#include <vector>

#include "nodes/files/content_key.h"
#include "nodes/graph/description.h"
#include "nodes/graph/value.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

class WorkerPool;

/// A node's parameters at one frame. Every value was checked against its description when it entered the graph, so
/// that reading cannot fail; asking for a name or type that the description has not is our bug (asserted).
class Parameters {
public:
    virtual ~Parameters() = default;
    virtual Json value(std::string_view name) const = 0;

    bool is_null(std::string_view name) const;
    bool is_automatic(std::string_view name) const;
    bool boolean(std::string_view name) const;
    int integer(std::string_view name) const;
    double number(std::string_view name) const;
    double number_or(std::string_view name, double if_null) const;
    std::string text(std::string_view name) const;
    Vec3 vector3(std::string_view name) const;
    std::array<int, 3> integer3(std::string_view name) const;
    std::vector<Vec3> points(std::string_view name) const;
};

/// What a node keeps between evaluations (a solver's frames, a deformer's topology). Lives as long as the node; whoever
/// keeps something checks by content keys whether it still holds.
class NodeStore {
public:
    /// The store's content, made by default the first time.
    template <class T>
    T& get() {
        if (!content_ || type_ != typeid(T)) {
            content_ = std::make_shared<T>();
            type_ = typeid(T);
        }
        return *static_cast<T*>(content_.get());
    }

private:
    std::shared_ptr<void> content_;
    std::type_index type_ = typeid(void);
};

/// What a cook function sees of the graph. Frames may be asked for in any order.
class CookContext {
public:
    virtual ~CookContext() = default;

    virtual const std::string& node() const = 0;                     // the node's name
    virtual std::string_view output() const = 0;                     // the output socket that is asked for
    virtual double frame() const = 0;                                // that is asked for; of what is solved a whole one
    virtual int start_frame() const = 0;                             // first frame of the graph's range
    virtual double frame_rate() const = 0;                           // frames per second
    virtual double seconds(double n_frames) const = 0;               // that some frames take, rounded once
    virtual int threads() const = 0;                                 // 0: all cores
    virtual std::shared_ptr<const WorkerPool> workers() = 0;         // of the graph; as many threads
    virtual size_t cache_limit() const = 0;                          // bytes that a node may keep of past frames
    virtual std::string resolve(const std::string& path) const = 0;  // an input path, seen from the graph's folder
    virtual const Progress& progress() const = 0;                    // of this node's own work
    virtual NodeStore& store() = 0;

    virtual const Parameters& parameters(double frame) = 0;  // valid until the next call
    const Parameters& parameters() { return parameters(frame()); }

    /// Of one of the node's numbers from one frame to a later one (ParameterValue::integral).
    virtual double integral(std::string_view parameter, double from, double to) const = 0;
    /// How fast one of them changes from a frame on, a frame (ParameterValue::slope).
    virtual double slope(std::string_view parameter, double frame) const = 0;

    /// Of the whole node at every frame: type, parameters, inputs, files. Equal keys, equal results at equal frames.
    virtual ContentKey key() = 0;
    /// Of what feeds an input socket; a constant when nothing does.
    virtual ContentKey input_key(std::string_view socket) = 0;
    /// What feeds an input socket at a frame, in the order of its wires; empty when nothing does.
    virtual Result<std::vector<Value>> inputs(std::string_view socket, double frame) = 0;

    /// The one value that feeds a required socket.
    template <class T>
    Result<std::shared_ptr<const T>> input(std::string_view socket, double frame) {
        Result<std::vector<Value>> values = inputs(socket, frame);
        if (!values) return values.error();
        return std::get<std::shared_ptr<const T>>(values->front());
    }
    template <class T>
    Result<std::shared_ptr<const T>> input(std::string_view socket) {
        return input<T>(socket, frame());
    }

    /// All values that feed a socket, by their type.
    template <class T>
    Result<std::vector<std::shared_ptr<const T>>> inputs_as(std::string_view socket, double frame) {
        Result<std::vector<Value>> values = inputs(socket, frame);
        if (!values) return values.error();
        std::vector<std::shared_ptr<const T>> typed;
        for (const Value& v : *values) typed.push_back(std::get<std::shared_ptr<const T>>(v));
        return typed;
    }

    /// bad_input at this node; `parameter` (or socket) may be empty.
    Error error(const std::string& parameter, std::string what, std::string mend = {}) const;
};

/// bad_input with node and parameter filled in, where = "node 'x', parameter 'y'".
Error node_error(const std::string& node, const std::string& parameter, std::string what, std::string mend = {});

struct NodeType {
    NodeDescription description;
    /// The value of CookContext::output() at CookContext::frame(). A pure function of parameters, inputs and files.
    Result<Value> (*cook)(CookContext& context) = nullptr;
    /// The same for several nodes of this type at one frame and output, with less work or sooner: one result for each,
    /// bit for bit what `cook` gives; the error of one is no other's. For types whose value is always wanted at the
    /// frame of what it feeds, since nodes are found by their wires before anybody asks. May be null.
    std::vector<Result<Value>> (*cook_together)(std::span<CookContext* const> contexts) = nullptr;
    /// Whether parameters agree with one another (ranges of each alone come from the description). May be null.
    Status (*check)(const std::string& node, const Parameters& parameters) = nullptr;
    /// Results differ by frame even if no parameter is animated.
    bool depends_on_frame = false;
    /// Gives fragments that take long to make: kept in the graph's cut folder, if it has one.
    bool is_cut = false;
    /// Takes a frame that was saved earlier, so that evaluation continues from it. Null for all but solvers.
    Status (*seed)(CookContext& context, int frame, FrameState state) = nullptr;
};

}  // namespace sunder
