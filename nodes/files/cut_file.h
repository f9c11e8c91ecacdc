// Cuts on disk: a FragmentSet bit for bit, so that what was cut once is not cut again. Ours alone, and worthless if
// lost.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "nodes/files/byte_buffer.h"
#include "nodes/files/content_key.h"
#include "solver/data/fragment_set.h"

namespace sunder {

ByteBuffer encode_cut(const FragmentSet& fragments, ContentKey key);

/// None if `bytes` is no whole cut of that key and of this version of Sunder.
std::optional<FragmentSet> decode_cut(std::string_view bytes, ContentKey key);

/// A folder with one cut a node: the last one.
class CutFolder {
public:
    CutFolder() = default;
    explicit CutFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}
    explicit operator bool() const { return !folder_.empty(); }

    std::optional<FragmentSet> read(const std::string& node, ContentKey key) const;
    /// Makes the folder, and removes the node's former cut. What cannot be written is left out: it will be cut again.
    void write(const std::string& node, ContentKey key, const FragmentSet& fragments) const;

private:
    std::filesystem::path path_of(const std::string& node, ContentKey key) const;
    std::filesystem::path folder_;
};

}  // namespace sunder
