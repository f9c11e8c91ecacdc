// What fuzz targets share. A target takes bytes as libFuzzer gives them; without libFuzzer mutation_driver.cpp runs it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "solver/data/result.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace sunder::testing {

inline void require(bool condition, const char* what) {
    if (condition) return;
    std::fprintf(stderr, "fuzz: %s\n", what);
    std::abort();
}

/// A refusal of bytes tells what is wrong and where, and blames nobody but them.
inline void require_refusal(const Error& error, const std::string& where) {
    require(error.code == ErrorCode::bad_input, "an error that is not about the input");
    require(!error.what.empty(), "an error without a sentence");
    require(error.where == where, "an error that does not name the file");
}

inline std::string_view text_of(const uint8_t* data, size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

}  // namespace sunder::testing
