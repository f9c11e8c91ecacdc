// Baked files as Zstandard compresses them (RFC 8878): smaller on disk, the same bytes once read.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "nodes/files/byte_buffer.h"
#include "solver/data/result.h"

namespace sunder {

/// What a compressed file's name ends in, behind the ending of what it holds; as the `zstd` program has it.
inline constexpr std::string_view kCompressedSuffix = ".zst";

bool is_compressed(std::string_view path);
/// The name without that ending.
std::string uncompressed_path(const std::string& path);

/// One frame with a checksum, at a fixed level: the same bytes for the same input and version of the library.
Result<ByteBuffer> compress(std::string_view bytes);

/// Errors (`where` names the file): not compressed, cut off, damaged, bytes left over.
Result<std::string> decompress(std::string_view bytes, const std::string& where);

/// The first `n` bytes, or fewer, of what begins with `bytes`; none where these are not compressed, or are less than
/// kCompressedHead of a larger file.
inline constexpr size_t kCompressedHead = size_t{160} << 10;  // a block, of which the standard has 128 KB at most
std::string decompress_head(std::string_view bytes, size_t n);

/// A whole baked file, compressed or not, as its name tells. Errors: as of read_file and decompress.
Result<std::string> read_baked_file(const std::filesystem::path& path);

}  // namespace sunder
