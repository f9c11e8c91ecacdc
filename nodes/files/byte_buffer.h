// Bytes of a file being composed, and bytes of a file being read. Files are little-endian; so are the machines we run
// on.
#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace sunder {

static_assert(std::endian::native == std::endian::little, "file formats are written as the machine holds the numbers");

/// Grows as text and numbers are appended. One frame is composed in memory, hashed, and written in one go.
class ByteBuffer {
public:
    void reserve(size_t bytes) { bytes_.reserve(bytes); }
    void text(std::string_view s) { append(s.data(), s.size()); }
    template <class T>
    void number(T value) {
        static_assert(std::is_arithmetic_v<T>);
        append(&value, sizeof value);
    }
    void append(const void* data, size_t n) {
        const char* p = static_cast<const char*>(data);
        bytes_.insert(bytes_.end(), p, p + n);
    }
    /// `n` more bytes, to be written through the pointer before the next call.
    char* grow(size_t n) {
        bytes_.resize(bytes_.size() + n);
        return bytes_.data() + bytes_.size() - n;
    }
    void shrink(size_t n) { bytes_.resize(n); }  // to its first `n` bytes
    std::string_view view() const { return {bytes_.data(), bytes_.size()}; }

private:
    std::vector<char> bytes_;
};

/// A number at `p`, which need not be aligned.
template <class T>
T read_number(const char* p) {
    T value;
    std::memcpy(&value, p, sizeof value);
    return value;
}

}  // namespace sunder
