// Bytes as a graph file: read, or refused by a sentence; what was read is written and read again as the same.
#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    const auto graph = Graph::from_json_text(text_of(data, size), "file", "");
    if (!graph) {
        require(graph.error().code == ErrorCode::bad_input && !graph.error().what.empty(),
                "a refusal without a reason");
        return 0;
    }
    const std::string written = graph->to_json().dump();
    const auto again = Graph::from_json_text(written, "again", "");
    require(static_cast<bool>(again), "what was written is refused");
    require(again->to_json().dump() == written, "what was written is read as another graph");
    require(again->keys() == graph->keys(), "what was written has other keys");
    return 0;
}
