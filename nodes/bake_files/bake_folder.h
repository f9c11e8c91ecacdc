// The folder of a bake: the one place where baked files are written, replaced and removed, and what may be touched
// there.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/bake_files/manifest.h"
#include "nodes/files/file_io.h"
#include "solver/data/result.h"

namespace sunder {

/// Subfolder for what only we read: states to resume from.
inline constexpr std::string_view kResumeFolder = ".sunder";

/// "state/sim.0001.ply": relative, forward slashes, every part a plain name.
bool is_path_inside(std::string_view path);

/// Held by one bake at a time; others are refused as long as it lives.
class BakeFolder {
public:
    /// Makes the folder if need be and locks it. Errors: a file in its place, not permitted, another bake is at work
    /// there.
    static Result<BakeFolder> open(const std::filesystem::path& folder);
    ~BakeFolder();
    BakeFolder(BakeFolder&& other) noexcept;
    BakeFolder& operator=(BakeFolder&&) = delete;

    const std::filesystem::path& path() const { return path_; }
    bool has_manifest() const;

    /// Ok if `path` is free or holds a file that we wrote (`manifest` lists it, or it bears our mark in a folder that
    /// has our manifest) and its folder does not lead outside through a link. The error names the foreign file.
    Status check_writable(const std::string& path, const std::set<std::string>& listed) const;

    /// Where to write a file that is not composed in memory; makes its subfolder.
    Result<std::filesystem::path> prepare(const std::string& path) const;
    /// A file with these bytes, to be committed; makes its subfolder.
    Result<FileWriter> begin(const std::string& path, std::string_view bytes) const;
    Status write_manifest(const Manifest& manifest) const;

    /// Whether the file is there and we wrote it: its contents are as listed, or bear our mark.
    bool is_own(const ManifestFile& file) const;
    /// Removes it if it is. Leaves all others alone.
    Status remove_own(const ManifestFile& file) const;
    /// Removes what lies beside the states to resume from and the manifest does not list.
    Status prune_resume_states(const Manifest& manifest) const;

private:
    BakeFolder(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}
    Status check_inside(const std::string& path) const;

    std::filesystem::path path_;  // without links
    int lock_;
};

/// Paths that a manifest lists.
std::set<std::string> listed_paths(const Manifest& manifest);

}  // namespace sunder
