// What fields of a struct (solver/data/fields.h) are as parameters of a node and in keys. (In JSON: field_json.h.)
#pragma once

#include "nodes/files/content_key.h"
#include "nodes/graph/node.h"
#include "solver/data/fields.h"

namespace sunder {

/// Null for infinity.
JsonValue value_of_number(double may_be_infinite);

ParameterDescription parameter_of(const FieldDescription& field, ParameterType type, JsonValue default_value);

/// A field as a parameter; by default it is what a T begins with.
template <class T>
ParameterDescription parameter_of(const Field<T>& field) {
    static const T begins;
    return field.visit(begins, [&](auto value) {
        if constexpr (std::is_same_v<decltype(value), bool>)
            return parameter_of(field.description, ParameterType::boolean, value);
        else if constexpr (std::is_integral_v<decltype(value)>)
            return parameter_of(field.description, ParameterType::integer, static_cast<int>(value));
        else
            return parameter_of(field.description, ParameterType::number, value_of_number(value));
    });
}

/// All fields as parameters, in their order.
template <class T>
std::vector<ParameterDescription> parameters_of(std::span<const Field<T>> fields) {
    std::vector<ParameterDescription> parameters;
    for (const Field<T>& field : fields) parameters.push_back(parameter_of(field));
    return parameters;
}

/// Takes up the parameters of those names, but for what is "auto", or null where that means no infinity.
template <class T>
void read_fields(const Parameters& parameters, std::span<const Field<T>> fields, T& io_values) {
    for (const Field<T>& field : fields) {
        const char* name = field.description.name;
        if (parameters.is_automatic(name)) continue;
        field.visit(io_values, [&]<class N>(N& io_value) {
            if constexpr (std::is_floating_point_v<N>)
                io_value = parameters.number_or(name, std::numeric_limits<N>::infinity());
            else if (parameters.is_null(name))
                return;
            else if constexpr (std::is_same_v<N, bool>)
                io_value = parameters.boolean(name);
            else
                io_value = static_cast<N>(parameters.integer(name));
        });
    }
}

template <class T>
void add_fields(KeyHasher& io_hasher, std::span<const Field<T>> fields, const T& values) {
    for (const Field<T>& field : fields) field.visit(values, [&](auto value) { io_hasher.add(value); });
}

}  // namespace sunder
