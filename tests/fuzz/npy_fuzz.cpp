// Bytes as an array of places over frames: read, with as many numbers as its shape tells, or refused.
#include <algorithm>

#include "nodes/files/npy_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    const auto frames = decode_npy(std::string(text_of(data, size)), "file");
    if (!frames) return require_refusal(frames.error(), "file"), 0;
    const size_t n = frames->n_frames * frames->n_vertices;
    require(n > 0 && n == std::max(frames->single.size(), frames->exact.size()), "not as many as the shape tells");
    require(frames->single.empty() != frames->exact.empty(), "both kinds of numbers, or none");
    return 0;
}
