// Bytes as a state frame, compressed or not: read, or refused; what was read is written and read again bit for bit.
#include "nodes/files/compression.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/value_arrays.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

constexpr std::string_view kZstd = "\x28\xb5\x2f\xfd";
constexpr size_t kMostCompressed = 2048;  // bytes: four of them may stand for 128 KB

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    std::string bytes(text_of(data, size));
    if (bytes.starts_with(kZstd) && size <= kMostCompressed) {
        auto unpacked = decompress(bytes, "file");
        if (!unpacked) return require_refusal(unpacked.error(), "file"), 0;
        bytes = unpacked.take();
    }
    auto file = decode_state(std::move(bytes), "file");
    if (!file) return require_refusal(file.error(), "file"), 0;

    const Value value = state_value(file.take());
    const auto& state = *std::get<std::shared_ptr<const StateValue>>(value);
    for (const std::string& name : array_names(value))
        require(static_cast<bool>(value_array(value, name)), "an array is not there");
    const std::string written(encode_state(state.frame, *state.state, state.scene->rest, state.at).view());
    auto again = decode_state(written, "again");
    require(static_cast<bool>(again), "what was written is refused");
    require(encode_state(again->frame, again->state, state.scene->rest, again->at).view() == written,
            "what was written is another state");
    return 0;
}
