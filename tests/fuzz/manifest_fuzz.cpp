// Bytes as a manifest: read, or refused by a sentence; what was read is written and read again as the same.
#include "nodes/bake_files/manifest.h"
#include "nodes/graph/json.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace sunder;
    using namespace sunder::testing;
    const std::string_view text = text_of(data, size);
    is_own_manifest(text);
    const auto manifest = parse_manifest(text, "file");
    if (!manifest) return require_refusal(manifest.error(), "file"), 0;
    for (const ManifestFrame& frame : manifest->frames)
        for (const ManifestFile& file : frame.files)
            require(!file.path.starts_with('/') && file.path.find("..") != 0, "a path leaves the folder");
    const std::string written = to_json(*manifest).dump();
    const auto again = parse_manifest(written, "again");
    require(again && *again == *manifest, "what was written is another manifest");
    require(differences(*manifest, *again).empty(), "it differs from itself");
    return 0;
}
