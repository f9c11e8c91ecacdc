// Parameter values: checked where they enter, constant or animated.
#pragma once

#include <string>
#include <vector>

#include "nodes/graph/description.h"
#include "nodes/graph/json.h"
#include "solver/data/result.h"

namespace sunder {

/// A value that fits its description. Numbers are stored as the description's type, so that 1 and 1.0 are one value.
class ParameterValue {
public:
    enum class Interpolation { linear, step };
    struct Key {
        double frame;
        Json value;
    };

    /// Errors: wrong type, not finite, out of range, not a choice, animated though it cannot be; keys out of order.
    static Result<ParameterValue> check(const ParameterDescription& description, const Json& value,
                                        const std::string& node);

    bool is_animated() const { return !keys_.empty(); }
    /// Keys hold their value before the first and after the last; between two, linear or that of the earlier one.
    Json at(double frame) const;
    /// Of a number over frames, linear and stepped keys alike: piece after piece, each rounded once; `from` <= `to`.
    double integral(double from, double to) const;
    /// How fast such a number changes from there on, a frame.
    double slope(double frame) const;
    Json to_json() const;  // as in files

private:
    Json constant_;
    std::vector<Key> keys_;  // ascending by frame; empty: constant
    Interpolation interpolation_ = Interpolation::linear;
};

}  // namespace sunder
