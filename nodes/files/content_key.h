// Content keys: what a result depends on, as one number. Equal keys mean equal results.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "solver/data/math.h"

namespace sunder {

using ContentKey = uint64_t;

/// Hashes values in the order given, each with its length where it has one, so that no two inputs run together.
class KeyHasher {
public:
    KeyHasher();
    ~KeyHasher();
    KeyHasher(const KeyHasher&) = delete;
    KeyHasher& operator=(const KeyHasher&) = delete;

    template <class T>
    requires std::is_integral_v<T> KeyHasher& add(T value) { return add_integer(static_cast<uint64_t>(value)); }
    KeyHasher& add(double value);  // by its bits
    KeyHasher& add(std::string_view text);
    KeyHasher& add(const Vec3& value);
    KeyHasher& add(const Quat& value);
    KeyHasher& add(const Pose& value);
    ContentKey key() const;

private:
    KeyHasher& add_integer(uint64_t value);
    struct State;
    std::unique_ptr<State> state_;
};

/// 16 hexadecimal digits, as manifests store it.
std::string to_text(ContentKey key);

}  // namespace sunder
