// Whole files in and out: what is written appears complete under its name, or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "solver/data/result.h"

namespace sunder {

/// What a manifest remembers of a file's contents.
struct FileStamp {
    uint64_t size = 0;  // bytes
    uint64_t hash = 0;  // XXH3, 64 bits, of all bytes
    bool operator==(const FileStamp&) const = default;
};

/// Ending of the names that half-written files carry; such a file is ours and worthless.
inline constexpr std::string_view kTemporarySuffix = ".sunder-tmp";

FileStamp stamp_of(std::string_view bytes);
/// Reads the file once. Errors: missing, not a plain file, unreadable.
Result<FileStamp> stamp_of_file(const std::filesystem::path& path);

/// Errors: missing, a folder, unreadable, larger than `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, uint64_t max_bytes = UINT64_MAX);

/// Writes to a temporary name beside `path`, syncs it, renames it onto `path`, and syncs the folder. The folder must
/// be there. On an error (disk full, not permitted, ...) whatever `path` held before is untouched and the temporary is
/// gone.
Result<FileStamp> write_file(const std::filesystem::path& path, std::string_view bytes);

/// The same for a file that is too large to be composed in memory: written piece by piece under the temporary name,
/// complete under its own once `commit` has returned. Without a commit nothing remains.
class FileWriter {
public:
    static Result<FileWriter> open(const std::filesystem::path& path);
    ~FileWriter();
    FileWriter(FileWriter&& other) noexcept;
    FileWriter& operator=(FileWriter&&) = delete;

    Status append(std::string_view bytes);
    Result<FileStamp> commit();
    /// The same of several at once, stamps in their order: what the disk must be waited for is asked for together, and
    /// each folder is synced once, behind all renames. On an error some may have their names, each of them whole.
    static Result<std::vector<FileStamp>> commit(std::span<FileWriter> files);

private:
    struct Impl;
    explicit FileWriter(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Makes `folder` and what leads to it. Errors name the first part that could not be made.
Status make_folders(const std::filesystem::path& folder);

std::string hex(uint64_t value);  // 16 digits, as manifests write hashes

}  // namespace sunder
