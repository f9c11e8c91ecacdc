// Bytes as a kept cut: taken or left. A damaged one is left by its hash; so the bytes are also given a right one.
#include "nodes/files/cut_file.h"
#include "nodes/files/file_io.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

constexpr sunder::ContentKey kKey = 42;
constexpr size_t kKeyAndHash = 2 * sizeof(uint64_t);

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    const std::string_view content = text_of(data, size);
    decode_cut(content, kKey);

    // As a cut of this version: the input is what lies between head and hash.
    static const std::string empty(encode_cut({}, kKey).view());
    static const size_t mark = empty.find('\n') + 1;
    const auto sealed = [](std::string bytes) {
        const uint64_t hash = stamp_of(bytes).hash;
        return bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
    };
    require(empty.size() > mark + kKeyAndHash && decode_cut(empty, kKey).has_value(), "an empty cut is not taken");
    const std::string bytes = sealed(empty.substr(0, mark + sizeof kKey).append(content));
    const auto set = decode_cut(bytes, kKey);
    require(!decode_cut(bytes, kKey + 1), "a cut of another key is taken");
    if (!set) return 0;
    const std::string written(encode_cut(*set, kKey).view());
    const auto again = decode_cut(written, kKey);
    require(again && encode_cut(*again, kKey).view() == written, "what was written is another cut");
    return 0;
}
