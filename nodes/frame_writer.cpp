#include "nodes/frame_writer.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "nodes/mesh_frame_file.h"
#include "nodes/state_file.h"

namespace sunder {
namespace {

// Node names may hold any character; in a file's name only these stay as they are.
std::string file_name_of(const std::string& node) {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string name;
    for (unsigned char c : node)
        if (std::isalnum(c) || c == '_' || c == '-')
            name += static_cast<char>(c);
        else
            name += '%', name += kDigits[c >> 4], name += kDigits[c & 15];
    return name;
}

Result<ByteBuffer> encode(const BakeItem& item) {
    if (item.state) return encode_state(item.state->frame, *item.state->state, item.state->scene->rest);
    return encode_mesh(item.path, item.mesh->mesh, *item.mesh->fragments);
}

}  // namespace

FrameWriter::FrameWriter(const BakeFolder& folder, Manifest& manifest, std::vector<std::string> bake_nodes,
                         std::vector<std::string> solvers)
    : folder_(folder),
      manifest_(manifest),
      bake_nodes_(std::move(bake_nodes)),
      solvers_(std::move(solvers)),
      thread_([this] { work(); }) {}

FrameWriter::~FrameWriter() {
    {
        const std::lock_guard lock(guard_);
        is_ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

Status FrameWriter::put(FrameToWrite frame) {
    std::unique_lock lock(guard_);
    changed_.wait(lock, [&] { return waiting_.size() < kWaiting || !status_; });
    if (!status_) return status_;
    waiting_.push_back(std::move(frame));
    changed_.notify_all();
    return {};
}

Status FrameWriter::finish() {
    std::unique_lock lock(guard_);
    changed_.wait(lock, [&] { return (waiting_.empty() && !is_writing_) || !status_; });
    return status_;
}

std::vector<BakedFrame> FrameWriter::take_done() {
    const std::lock_guard lock(guard_);
    return std::exchange(done_, {});
}

void FrameWriter::work() {
    std::unique_lock lock(guard_);
    for (;;) {
        changed_.wait(lock, [&] { return !waiting_.empty() || is_ending_; });
        if (waiting_.empty()) return;
        FrameToWrite frame = std::move(waiting_.front());
        waiting_.pop_front();
        is_writing_ = true;
        changed_.notify_all();
        lock.unlock();
        Status written;
        try {
            const auto begin = std::chrono::steady_clock::now();
            written = write(frame);
            frame.done.write_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        } catch (const std::exception& e) {  // out of memory: this thread has no caller who could catch it
            written = Error{ErrorCode::internal,
                            std::string("cannot be written: ") + e.what(),
                            "frame " + std::to_string(frame.done.frame),
                            "go on with --resume",
                            {},
                            {}};
        }
        lock.lock();
        is_writing_ = false;
        if (written)
            done_.push_back(frame.done);
        else
            status_ = written, waiting_.clear();
        changed_.notify_all();
    }
}

Status FrameWriter::write(FrameToWrite& io_frame) {
    ManifestFrame entry{io_frame.done.frame, {}};
    for (size_t i = 0; i < io_frame.items.size(); ++i) {
        auto bytes = encode(*io_frame.items[i]);
        if (!bytes) return bytes.error();
        auto file = write_file(bake_nodes_[i], io_frame.items[i]->path, *bytes, io_frame.done);
        if (!file) return file.error();
        entry.files.push_back(file.take());
    }
    std::vector<ManifestFile> resume;
    for (size_t s = 0; s < solvers_.size(); ++s) {
        auto file = resume_state(s, io_frame, entry.files, io_frame.done);
        if (!file) return file.error();
        resume.push_back(file.take());
    }
    manifest_.frames.push_back(std::move(entry));
    manifest_.resume = std::move(resume);
    if (Status s = folder_.write_manifest(manifest_); !s) return s;
    return folder_.prune_resume_states(manifest_.resume);
}

Result<ManifestFile> FrameWriter::write_file(const std::string& node, const std::string& path, const ByteBuffer& bytes,
                                             BakedFrame& io_done) const {
    auto stamp = folder_.write(path, bytes.view());
    if (!stamp) return stamp.error();
    ++io_done.n_files;
    io_done.bytes += stamp->size;
    return ManifestFile{node, path, *stamp};
}

// The baked file that holds the solver's state, or else one of our own. Two names take turns, so that the state that
// the manifest on disk speaks of is there until the next manifest is.
Result<ManifestFile> FrameWriter::resume_state(size_t solver, const FrameToWrite& frame,
                                               const std::vector<ManifestFile>& written, BakedFrame& io_done) const {
    const std::shared_ptr<const StateValue>& state = frame.states[solver];
    for (size_t i = 0; i < frame.items.size(); ++i)
        if (frame.items[i]->state == state) return ManifestFile{solvers_[solver], written[i].path, written[i].stamp};
    const std::string path = std::string(kResumeFolder) + "/" + file_name_of(solvers_[solver]) +
                             (frame.done.frame % 2 ? ".odd.ply" : ".even.ply");
    return write_file(solvers_[solver], path, encode_state(frame.done.frame, *state->state, state->scene->rest),
                      io_done);
}

}  // namespace sunder
