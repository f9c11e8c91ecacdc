#include "nodes/frame_writer.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "nodes/files/compression.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/state_file.h"

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
    Result<ByteBuffer> plain =
        item.state ? encode_state(item.state->frame, *item.state->state, item.state->scene->rest, item.state->at)
                   : encode_mesh(uncompressed_path(item.path), item.mesh->mesh, *item.mesh->fragments);
    return plain && is_compressed(item.path) ? compress(plain->view()) : std::move(plain);
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

// All files of a frame first, then the disk is waited for: once for every few files instead of twice for each.
Status FrameWriter::write(FrameToWrite& io_frame) {
    ManifestFrame entry{io_frame.done.frame, {}};
    std::vector<ManifestFile> resume;
    std::vector<FileWriter> begun;
    std::vector<ManifestFile> written;
    const auto commit = [&]() -> Status {
        const auto stamps = FileWriter::commit(begun);
        if (!stamps) return stamps.error();
        for (const FileStamp& stamp : *stamps) {
            written[written.size() - begun.size() + static_cast<size_t>(&stamp - stamps->data())].stamp = stamp;
            ++io_frame.done.n_files, io_frame.done.bytes += stamp.size;
        }
        begun.clear();
        return {};
    };
    const auto add = [&](const std::string& node, const std::string& path, const ByteBuffer& bytes) -> Status {
        auto file = folder_.begin(path, bytes.view());
        if (!file) return file.error();
        begun.push_back(file.take()), written.push_back({node, path, {}});
        constexpr size_t kMostOpen = 64;
        return begun.size() < kMostOpen ? Status() : commit();
    };
    for (size_t i = 0; i < io_frame.items.size(); ++i) {
        auto bytes = encode(*io_frame.items[i]);
        if (!bytes) return bytes.error();
        if (Status s = add(bake_nodes_[i], io_frame.items[i]->path, *bytes); !s) return s;
    }
    for (size_t s = 0; s < solvers_.size(); ++s)
        if (baked_state(s, io_frame) == io_frame.items.size()) {
            const StateValue& state = *io_frame.states[s];
            const ByteBuffer bytes = encode_state(io_frame.done.frame, *state.kept, state.scene->rest,
                                                  {static_cast<double>(state.at.grid()), state.at.scale});
            if (Status added = add(solvers_[s], resume_path(s, io_frame.done.frame), bytes); !added) return added;
        }
    if (Status s = commit(); !s) return s;
    entry.files.assign(written.begin(), written.begin() + static_cast<std::ptrdiff_t>(io_frame.items.size()));
    size_t own = io_frame.items.size();
    for (size_t s = 0; s < solvers_.size(); ++s) {
        const size_t item = baked_state(s, io_frame);
        const ManifestFile& file = written[item < io_frame.items.size() ? item : own++];
        resume.push_back({solvers_[s], file.path, file.stamp});
    }
    manifest_.frames.push_back(std::move(entry));
    manifest_.resume = std::move(resume);
    if (Status s = folder_.write_manifest(manifest_); !s) return s;
    return folder_.prune_resume_states(manifest_.resume);
}

size_t FrameWriter::baked_state(size_t solver, const FrameToWrite& frame) const {
    const auto same = [&](const auto& item) {
        return item->state == frame.states[solver] && item->state->kept == item->state->state;
    };
    return static_cast<size_t>(std::find_if(frame.items.begin(), frame.items.end(), same) - frame.items.begin());
}

// Two names take turns, so that the state that the manifest on disk speaks of is there until the next manifest is.
std::string FrameWriter::resume_path(size_t solver, int frame) const {
    return std::string(kResumeFolder) + "/" + file_name_of(solvers_[solver]) + (frame % 2 ? ".odd.ply" : ".even.ply");
}

}  // namespace sunder
