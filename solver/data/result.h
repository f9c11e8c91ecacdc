// Errors are values: a code, a sentence, where it happened and how to mend it.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "solver/data/invariant.h"

namespace sunder {

enum class ErrorCode {
    bad_usage,  // the call itself is wrong (CLI exit 2)
    bad_input,  // a file, mesh, graph, parameter or wire is wrong (CLI exit 3)
    io,         // reading or writing failed (CLI exit 1)
    numerical,  // numbers went bad: not finite, runaway (CLI exit 1)
    cancelled,  // the caller asked to stop (CLI exit 130); not a fault
    internal,   // our bug (CLI exit 1)
};

/// One error. Printed as "WHERE: WHAT (how to mend it)".
struct Error {
    ErrorCode code = ErrorCode::internal;
    std::string what;       // one sentence, no full stop at the end
    std::string where;      // file, node, fragment, ...; may be empty
    std::string mend;       // how to mend it; may be empty
    std::string node;       // graph node concerned; may be empty
    std::string parameter;  // parameter or socket concerned; may be empty

    std::string text() const {
        std::string s = where.empty() ? what : where + ": " + what;
        return mend.empty() ? s : s + " (" + mend + ")";
    }
};

inline Error bad_input(std::string where, std::string what, std::string mend = {}) {
    return {ErrorCode::bad_input, std::move(what), std::move(where), std::move(mend), {}, {}};
}
inline Error bad_usage(std::string what, std::string mend = {}) {
    return {ErrorCode::bad_usage, std::move(what), {}, std::move(mend), {}, {}};
}
inline Error io_error(std::string where, std::string what, std::string mend = {}) {
    return {ErrorCode::io, std::move(what), std::move(where), std::move(mend), {}, {}};
}
inline Error cancelled() { return {ErrorCode::cancelled, "cancelled", {}, {}, {}, {}}; }

/// Either a value or an Error.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {}

    explicit operator bool() const { return content_.index() == 0; }
    T& operator*() {
        SUNDER_ASSERT(*this);
        return std::get<0>(content_);
    }
    const T& operator*() const {
        SUNDER_ASSERT(*this);
        return std::get<0>(content_);
    }
    T* operator->() { return &**this; }
    const T* operator->() const { return &**this; }
    T take() {
        SUNDER_ASSERT(*this);
        return std::move(std::get<0>(content_));
    }
    const Error& error() const {
        SUNDER_ASSERT(!*this);
        return std::get<1>(content_);
    }

private:
    std::variant<T, Error> content_;
};

/// Success, or an Error.
template <>
class [[nodiscard]] Result<void> {
public:
    Result() = default;
    Result(Error error) : error_(std::move(error)), failed_(true) {}

    explicit operator bool() const { return !failed_; }
    const Error& error() const {
        SUNDER_ASSERT(failed_);
        return error_;
    }

private:
    Error error_;
    bool failed_ = false;
};

using Status = Result<void>;

}  // namespace sunder
