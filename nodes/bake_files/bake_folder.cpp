#include "nodes/bake_files/bake_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "nodes/bake_files/break_log.h"
#include "nodes/files/compression.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMarkBytes = 200;  // our mark stands within the first bytes of each file

bool bears_mark(const fs::path& path) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (fd < 0) return false;
    const bool compressed = is_compressed(path.native());
    std::string head(compressed ? kCompressedHead : kMarkBytes, '\0');
    const ssize_t n = ::read(fd, head.data(), head.size());
    ::close(fd);
    head.resize(n > 0 ? static_cast<size_t>(n) : 0);
    const std::string text = compressed ? decompress_head(head, kMarkBytes) : head;
    return text.find(kStateFileMark) != std::string_view::npos || text.find(kMeshFileMagic) != std::string_view::npos ||
           text.starts_with(kBreaksMark) || text.starts_with(kLoadsMark);
}

bool is_there(const fs::path& path) {
    std::error_code code;
    return fs::exists(fs::symlink_status(path, code));
}

Status remove_file(const fs::path& path) {
    std::error_code code;
    fs::remove(path, code);
    if (code) return io_error(path.string(), "cannot remove: " + code.message(), "check the permissions");
    return {};
}

}  // namespace

bool is_path_inside(std::string_view path) {
    if (path.empty() || path.find('\\') != std::string_view::npos || path.find('\0') != std::string_view::npos)
        return false;
    for (size_t begin = 0; begin <= path.size();) {
        const size_t end = std::min(path.find('/', begin), path.size());
        const std::string_view part = path.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..") return false;
        begin = end + 1;
    }
    return true;
}

Result<BakeFolder> BakeFolder::open(const fs::path& folder) {
    if (Status s = make_folders(folder); !s) return s.error();
    std::error_code code;
    const fs::path real = fs::canonical(folder, code);
    if (code) return io_error(folder.string(), "cannot be opened: " + code.message());
    const int fd = ::open(real.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return io_error(folder.string(), std::string("cannot be opened: ") + std::strerror(errno),
                        "check the permissions");
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        ::close(fd);
        return bad_input(folder.string(), "another bake is writing here", "wait for it, or choose another folder");
    }
    return BakeFolder(real, fd);  // file systems without locks: we go on without
}

BakeFolder::BakeFolder(BakeFolder&& other) noexcept : path_(std::move(other.path_)), lock_(other.lock_) {
    other.lock_ = -1;
}
BakeFolder::~BakeFolder() {
    if (lock_ >= 0) ::close(lock_);
}

bool BakeFolder::has_manifest() const { return is_there(path_ / kManifestName); }

Status BakeFolder::check_inside(const std::string& path) const {
    if (!is_path_inside(path))
        return bad_input(path, "leaves the output folder", "give a path below it, as mesh/bunny.####.ply");
    std::error_code code;
    const fs::path parent = fs::weakly_canonical((path_ / path).parent_path(), code);
    const auto [rest, unused] = std::mismatch(path_.begin(), path_.end(), parent.begin(), parent.end());
    if (code || rest != path_.end())
        return bad_input(path, "leaves the output folder through a link", "remove the link, or choose another folder");
    return {};
}

Status BakeFolder::check_writable(const std::string& path, const std::set<std::string>& listed) const {
    if (Status s = check_inside(path); !s) return s;
    const fs::path full = path_ / path;
    std::error_code code;
    for (fs::path folder = full.parent_path(); folder != path_; folder = folder.parent_path())
        if (is_there(folder) && !fs::is_directory(folder, code))
            return bad_input(folder.string(), "is a file where a folder is needed",
                             "choose another folder, or move it away");
    if (!is_there(full)) return {};
    if (fs::is_regular_file(fs::symlink_status(full, code)) &&
        (listed.contains(path) || (has_manifest() && bears_mark(full))))
        return {};
    return bad_input(full.string(), "is there already and is not what a bake wrote there",
                     "choose another folder, or move it away");
}

Result<fs::path> BakeFolder::prepare(const std::string& path) const {
    if (Status s = check_inside(path); !s) return s.error();
    const fs::path full = path_ / path;
    if (Status s = make_folders(full.parent_path()); !s) return s.error();
    return full;
}

Result<FileWriter> BakeFolder::begin(const std::string& path, std::string_view bytes) const {
    const auto full = prepare(path);
    if (!full) return full.error();
    auto file = FileWriter::open(*full);
    if (!file) return file.error();
    if (Status s = file->append(bytes); !s) return s.error();
    return file;
}

Status BakeFolder::write_manifest(const Manifest& manifest) const {
    const std::string text = to_json(manifest).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
    if (auto written = write_file(path_ / kManifestName, text); !written) return written.error();
    return {};
}

bool BakeFolder::is_own(const ManifestFile& file) const {
    const fs::path full = path_ / file.path;
    std::error_code code;
    if (!check_inside(file.path) || !fs::is_regular_file(fs::symlink_status(full, code))) return false;
    if (bears_mark(full)) return true;
    const auto stamp = stamp_of_file(full);
    return stamp && *stamp == file.stamp;
}

Status BakeFolder::remove_own(const ManifestFile& file) const {
    return is_own(file) ? remove_file(path_ / file.path) : Status();
}

Status BakeFolder::prune_resume_states(const Manifest& manifest) const {
    const fs::path folder = path_ / kResumeFolder;
    std::error_code code;
    std::vector<fs::path> stale;
    const auto is_kept = [&](const std::string& path) {
        const auto lists = [&](const std::vector<ManifestFile>& files) {
            return std::ranges::find(files, path, &ManifestFile::path) != files.end();
        };
        return lists(manifest.resume) || (manifest.log && lists(manifest.log->loads));
    };
    for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
        const std::string path = std::string(kResumeFolder) + "/" + it->path().filename().string();
        if (!is_kept(path) && (path.ends_with(kTemporarySuffix) || bears_mark(it->path()))) stale.push_back(it->path());
    }
    for (const fs::path& path : stale)
        if (Status s = remove_file(path); !s) return s;
    return {};
}

std::set<std::string> listed_paths(const Manifest& manifest) {
    std::set<std::string> paths;
    for (const ManifestFrame& frame : manifest.frames)
        frame.for_each_file([&](double, const ManifestFile& f) { paths.insert(f.path); });
    for (const ManifestFile& f : manifest.resume) paths.insert(f.path);
    for (const ManifestFile& f : manifest.exports) paths.insert(f.path);
    if (manifest.log)
        for (const auto* files : {&manifest.log->breaks, &manifest.log->loads})
            for (const ManifestFile& f : *files) paths.insert(f.path);
    return paths;
}

}  // namespace sunder
