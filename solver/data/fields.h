// The numbers of a struct, described once: checks, hashes, keys, files, nodes and their reference are made from that.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "solver/data/result.h"

namespace sunder {

/// What there is to say of a number besides its value.
struct FieldDescription {
    const char* name = "";      // as in files and scripts, snake_case
    const char* label = "";     // as artists read it
    const char* unit = "";      // "m", "Pa", ...; empty: a pure number
    const char* sentence = "";  // what it does
    double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
    bool min_excluded = false;
    bool animatable = false;  // may be another in each frame
    bool is_added = false;    // after there were hashes: its default adds nothing to them, so that they stay
};

/// Errors: not permitted, or not a number; `parameter` is the field's name.
Status check_field(const FieldDescription& field, double value, const std::string& where);

/// A member of T. Infinity, where it is permitted, means never: null in files.
template <class T>
struct Field {
    FieldDescription description;
    std::variant<double T::*, int T::*, bool T::*, size_t T::*> member;

    /// Calls body(of.member), whatever its type.
    template <class Body>
    auto visit(T& of, const Body& body) const {
        return std::visit([&](auto m) { return body(of.*m); }, member);
    }
    template <class Body>
    auto visit(const T& of, const Body& body) const {
        return std::visit([&](auto m) { return body(of.*m); }, member);
    }
    double number(const T& of) const {
        return visit(of, [](auto value) { return static_cast<double>(value); });
    }
};

struct Anything {
    template <class T>
    operator T() const;
};

/// How many members an aggregate has.
template <class T, class... Some>
consteval size_t n_members() {
    if constexpr (requires { T{Some()..., Anything()}; })
        return n_members<T, Some..., Anything>();
    else
        return sizeof...(Some);
}

/// All of those fields.
template <class T>
Status check_fields(std::span<const Field<T>> fields, const T& of, const std::string& where) {
    for (const Field<T>& field : fields)
        if (Status ok = check_field(field.description, field.number(of), where); !ok) return ok;
    return {};
}

/// Their values in their order, as hashes of them want it.
template <class T>
std::vector<double> numbers_of(std::span<const Field<T>> fields, const T& of) {
    static const T unset = {};
    std::vector<double> numbers;
    for (const Field<T>& field : fields) {
        const double number = field.number(of);
        if (!field.description.is_added || number != field.number(unset)) numbers.push_back(number);
    }
    return numbers;
}

/// The one of that name, or null.
template <class T>
const Field<T>* find_field(std::span<const Field<T>> fields, std::string_view name) {
    for (const Field<T>& field : fields)
        if (field.description.name == name) return &field;
    return nullptr;
}

}  // namespace sunder
