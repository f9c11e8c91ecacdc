#include "nodes/files/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <set>
#include <vector>

namespace sunder {

class Descriptor {
public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    explicit operator bool() const { return fd_ >= 0; }
    int get() const { return fd_; }
    bool close() {  // some file systems report a full disk only here
        const int fd = fd_;
        fd_ = -1;
        return ::close(fd) == 0;
    }

private:
    int fd_;
};

namespace {

namespace fs = std::filesystem;

constexpr size_t kChunk = size_t{1} << 20;  // bytes read or written by one system call

Error system_error(const fs::path& path, const std::string& doing, int number) {
    std::string mend;
    switch (number) {
        case ENOSPC:
        case EDQUOT:
            mend = "free some space, then go on with --resume";
            break;
        case EFBIG:
            mend = "raise the file size limit, then go on with --resume";
            break;
        case EACCES:
        case EPERM:
            mend = "check the permissions";
            break;
        case EROFS:
            mend = "choose a folder on a writable disk";
            break;
        case ENOTDIR:
        case EEXIST:
            mend = "a file stands where a folder is needed; choose another folder";
            break;
        default:
            break;
    }
    return io_error(path.string(), "cannot " + doing + ": " + std::strerror(number), mend);
}

Result<Descriptor*> open_plain(const fs::path& path, std::unique_ptr<Descriptor>& out, uint64_t& out_size) {
    out = std::make_unique<Descriptor>(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!*out) {
        if (errno == ENOENT || errno == ENOTDIR) return bad_input(path.string(), "no such file", "check the path");
        return system_error(path, "read", errno);
    }
    struct stat info {};
    if (::fstat(out->get(), &info) != 0) return system_error(path, "read", errno);
    if (S_ISDIR(info.st_mode)) return bad_input(path.string(), "is a folder, not a file");
    if (!S_ISREG(info.st_mode)) return bad_input(path.string(), "is not a plain file");
    out_size = static_cast<uint64_t>(info.st_size);
    return out.get();
}

int write_all(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(fd, bytes.data(), std::min(bytes.size(), kChunk));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return errno;
        bytes.remove_prefix(static_cast<size_t>(n));
    }
    return 0;
}

}  // namespace

FileStamp stamp_of(std::string_view bytes) { return {bytes.size(), XXH3_64bits(bytes.data(), bytes.size())}; }

Result<FileStamp> stamp_of_file(const fs::path& path) {
    std::unique_ptr<Descriptor> file;
    uint64_t size = 0;
    if (auto opened = open_plain(path, file, size); !opened) return opened.error();
    std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
    XXH3_64bits_reset(state.get());
    std::vector<char> chunk(kChunk);
    FileStamp stamp;
    for (;;) {
        const ssize_t n = ::read(file->get(), chunk.data(), chunk.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return system_error(path, "read", errno);
        if (n == 0) break;
        XXH3_64bits_update(state.get(), chunk.data(), static_cast<size_t>(n));
        stamp.size += static_cast<uint64_t>(n);
    }
    stamp.hash = XXH3_64bits_digest(state.get());
    return stamp;
}

Result<std::string> read_file(const fs::path& path, uint64_t max_bytes) {
    std::unique_ptr<Descriptor> file;
    uint64_t size = 0;
    if (auto opened = open_plain(path, file, size); !opened) return opened.error();
    if (size > max_bytes)
        return bad_input(path.string(),
                         "is too large: " + std::to_string(size) + " bytes, at most " + std::to_string(max_bytes));
    std::string bytes(size, '\0');
    size_t got = 0;
    while (got < size) {
        const ssize_t n = ::read(file->get(), bytes.data() + got, std::min<size_t>(size - got, kChunk));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return system_error(path, "read", errno);
        if (n == 0) break;
        got += static_cast<size_t>(n);
    }
    bytes.resize(got);
    return bytes;
}

struct FileWriter::Impl {
    fs::path path, temporary;
    Descriptor file{-1};
    std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> hash{XXH3_createState(), XXH3_freeState};
    uint64_t size = 0;
    bool is_committed = false;

    Impl(fs::path p, fs::path t, int fd) : path(std::move(p)), temporary(std::move(t)), file(fd) {
        XXH3_64bits_reset(hash.get());
    }
    ~Impl() {
        if (!is_committed) ::unlink(temporary.c_str());
    }
};

FileWriter::FileWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FileWriter::FileWriter(FileWriter&& other) noexcept = default;
FileWriter::~FileWriter() = default;

Result<FileWriter> FileWriter::open(const fs::path& path) {
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    const fs::path temporary = folder / (path.filename().string() + std::string(kTemporarySuffix));
    // A temporary left by a killed run is ours to remove; O_EXCL then never follows a link that stands in its place.
    ::unlink(temporary.c_str());
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0) return system_error(path, "write", errno);
    return FileWriter(std::make_unique<Impl>(path, temporary, fd));
}

Status FileWriter::append(std::string_view bytes) {
    if (const int failed = write_all(impl_->file.get(), bytes)) return system_error(impl_->path, "write", failed);
    XXH3_64bits_update(impl_->hash.get(), bytes.data(), bytes.size());
    impl_->size += bytes.size();
    return {};
}

Result<FileStamp> FileWriter::commit() {
    const auto stamps = commit({this, 1});
    if (!stamps) return stamps.error();
    return stamps->front();
}

Result<std::vector<FileStamp>> FileWriter::commit(std::span<FileWriter> files) {
    for (FileWriter& file : files) {
        Impl& self = *file.impl_;
        int failed = ::fsync(self.file.get()) != 0 ? errno : 0;
        if (!self.file.close() && !failed) failed = errno;
        if (failed) return system_error(self.path, "write", failed);
    }
    std::set<fs::path> folders;
    std::vector<FileStamp> stamps;
    for (FileWriter& file : files) {
        Impl& self = *file.impl_;
        if (::rename(self.temporary.c_str(), self.path.c_str()) != 0) return system_error(self.path, "write", errno);
        self.is_committed = true;
        folders.insert(self.temporary.parent_path());
        stamps.push_back({self.size, XXH3_64bits_digest(self.hash.get())});
    }
    for (const fs::path& folder : folders) {  // or the renames may be lost with the power, although the bytes are safe
        Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        if (directory && ::fsync(directory.get()) != 0 && errno != EINVAL && errno != ENOTSUP)
            return system_error(folder, "sync the folder", errno);
    }
    return stamps;
}

Result<FileStamp> write_file(const fs::path& path, std::string_view bytes) {
    auto file = FileWriter::open(path);
    if (!file) return file.error();
    if (Status s = file->append(bytes); !s) return s.error();
    return file->commit();
}

Status make_folders(const fs::path& folder) {
    std::error_code code;
    fs::create_directories(folder, code);
    if (!code && !fs::is_directory(folder, code)) code = std::make_error_code(std::errc::not_a_directory);
    if (code) return system_error(folder, "make the folder", code.value());
    return {};
}

std::string hex(uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
    return text;
}

}  // namespace sunder
