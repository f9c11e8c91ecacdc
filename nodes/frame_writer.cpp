#include "nodes/frame_writer.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>

#include "nodes/files/compression.h"
#include "nodes/files/frame_number.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/output_pattern.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/body_edges.h"

namespace sunder {
namespace {

// Of fragments, where any has another than its body's; else none.
std::vector<double> own_toughness(const StateValue& state) {
    const SimulationMesh& rest = state.scene->rest;
    const auto differs = [](const auto& body) {
        return !body->regions.empty() ||
               std::ranges::any_of(body->seams, [](const SeamValue& s) { return s.factor != 1; });
    };
    const auto is_glued = [](const Inactivity& i) { return (i.what & Inactivity::kGlued) != 0; };
    const bool any = !rest.toughness_factor.empty() ||
                     std::ranges::count(rest.group_uneven, 0) != std::ssize(rest.group_uneven) ||
                     std::ranges::any_of(state.bodies, differs) || std::ranges::any_of(state.state->inactive, is_glued);
    return any ? fragment_toughness(state) : std::vector<double>();
}

Result<ByteBuffer> encode(const BakeItem& item) {
    Result<ByteBuffer> plain = item.state
                                   ? encode_state(item.state->frame, *item.state->state, item.state->scene->rest,
                                                  item.state->at, own_toughness(*item.state))
                                   : encode_mesh(uncompressed_path(item.path), item.mesh->mesh, *item.mesh->fragments);
    return plain && is_compressed(item.path) ? compress(plain->view()) : std::move(plain);
}

bool breaks(size_t solver, const FrameToWrite& frame) { return !frame.states[solver]->broken.empty(); }

// Files that are to appear together.
class FrameFiles {
public:
    explicit FrameFiles(const BakeFolder& folder) : folder_(folder) {}

    Status add(const std::string& node, const std::string& path, std::string_view bytes) {
        auto file = folder_.begin(path, bytes);
        if (!file) return file.error();
        begun_.push_back(file.take()), written_.push_back({node, path, {}});
        constexpr size_t kMostOpen = 64;
        return begun_.size() < kMostOpen ? Status() : commit();
    }

    Status commit() {
        const auto stamps = FileWriter::commit(begun_);
        if (!stamps) return stamps.error();
        size_t at = written_.size() - begun_.size();
        for (const FileStamp& stamp : *stamps) written_[at++].stamp = stamp;
        begun_.clear();
        return {};
    }

    /// In the order in which they came.
    const std::vector<ManifestFile>& written() const { return written_; }

private:
    const BakeFolder& folder_;
    std::vector<FileWriter> begun_;
    std::vector<ManifestFile> written_;
};

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
    for (const ManifestSubFrame& sub : std::exchange(between_, {}))
        for (const ManifestFile& file : sub.files)
            if (Status s = folder_.remove_own(file); !s && status_) status_ = s;
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
            frame.done.write_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            if (frame.between) of_between_.write_s += frame.done.write_s;
        } catch (const std::exception& e) {  // out of memory: this thread has no caller who could catch it
            written = Error{ErrorCode::internal,
                            std::string("cannot be written: ") + e.what(),
                            "frame " + frame_text(frame.between.value_or(frame.done.frame)),
                            "go on with --resume",
                            {},
                            {}};
        }
        lock.lock();
        is_writing_ = false;
        if (!written)
            status_ = written, waiting_.clear();
        else if (!frame.between)
            done_.push_back(frame.done);
        changed_.notify_all();
    }
}

// All files of a frame first, then the disk is waited for: once for every few files instead of twice for each.
Status FrameWriter::write(FrameToWrite& io_frame) {
    if (io_frame.between) return write_between(io_frame);
    const int frame = io_frame.done.frame;
    FrameFiles files(folder_);
    for (size_t i = 0; i < io_frame.items.size(); ++i) {
        auto bytes = encode(*io_frame.items[i]);
        if (!bytes) return bytes.error();
        if (Status s = files.add(bake_nodes_[i], io_frame.items[i]->path, bytes->view()); !s) return s;
    }
    for (size_t s = 0; s < solvers_.size(); ++s)
        if (baked_state(s, io_frame) == io_frame.items.size()) {
            const StateValue& state = *io_frame.states[s];
            const ByteBuffer bytes = encode_state(frame, *state.kept, state.scene->rest,
                                                  {static_cast<double>(state.at.grid()), state.at.scale});
            if (Status ok = files.add(solvers_[s], own_path(s, frame, "ply"), bytes.view()); !ok) return ok;
        }
    const size_t n_wanted = files.written().size();  // the log is no work of the graph's
    for (size_t s = 0; s < solvers_.size(); ++s) {
        if (breaks(s, io_frame)) {
            const std::string text = encode_breaks(breaks_of(solvers_[s], *io_frame.states[s]));
            if (Status ok = files.add(solvers_[s], breaks_path(solvers_[s], frame), text); !ok) return ok;
        }
        if (io_frame.loads[s].matter())
            if (Status ok = files.add(solvers_[s], own_path(s, frame, "loads.json"), encode_loads(io_frame.loads[s]));
                !ok)
                return ok;
    }
    if (Status s = files.commit(); !s) return s;
    const BakedFrame before = std::exchange(of_between_, {});
    io_frame.done.n_files = before.n_files + n_wanted, io_frame.done.bytes = before.bytes;
    io_frame.done.write_s = before.write_s;
    for (const ManifestFile& file : std::span(files.written()).first(n_wanted)) io_frame.done.bytes += file.stamp.size;
    return list(io_frame, files.written());
}

Status FrameWriter::write_between(const FrameToWrite& frame) {
    FrameFiles files(folder_);
    for (size_t i = 0; i < frame.items.size(); ++i) {
        if (!frame.items[i]) continue;
        auto bytes = encode(*frame.items[i]);
        if (!bytes) return bytes.error();
        if (Status s = files.add(bake_nodes_[i], frame.items[i]->path, bytes->view()); !s) return s;
    }
    if (Status s = files.commit(); !s) return s;
    between_.push_back({*frame.between, files.written()});
    of_between_.n_files += files.written().size();
    for (const ManifestFile& file : files.written()) of_between_.bytes += file.stamp.size;
    return {};
}

Status FrameWriter::list(const FrameToWrite& frame, const std::vector<ManifestFile>& written) {
    const auto items_end = written.begin() + static_cast<std::ptrdiff_t>(frame.items.size());
    manifest_.frames.push_back({frame.done.frame, {written.begin(), items_end}, std::exchange(between_, {})});
    manifest_.resume.clear();
    auto own = items_end;
    for (size_t s = 0; s < solvers_.size(); ++s) {
        const size_t item = baked_state(s, frame);
        const ManifestFile& file = item < frame.items.size() ? written[item] : *own++;
        manifest_.resume.push_back({solvers_[s], file.path, file.stamp});
    }
    if (!manifest_.log) manifest_.log = {frame.done.frame, {}, {}};
    manifest_.log->loads.clear();
    for (size_t s = 0; s < solvers_.size(); ++s) {
        if (breaks(s, frame)) manifest_.log->breaks.push_back(*own++);
        if (frame.loads[s].matter()) manifest_.log->loads.push_back(*own++);
    }
    if (Status s = folder_.write_manifest(manifest_); !s) return s;
    return folder_.prune_resume_states(manifest_);
}

size_t FrameWriter::baked_state(size_t solver, const FrameToWrite& frame) const {
    const auto same = [&](const auto& item) {
        return item->state == frame.states[solver] && item->state->kept == item->state->state;
    };
    return static_cast<size_t>(std::find_if(frame.items.begin(), frame.items.end(), same) - frame.items.begin());
}

// Two names take turns, so that the file that the manifest on disk speaks of is there until the next manifest is.
std::string FrameWriter::own_path(size_t solver, int frame, const std::string& ending) const {
    return std::string(kResumeFolder) + "/" + file_name_of(solvers_[solver]) + (frame % 2 ? ".odd." : ".even.") +
           ending;
}

}  // namespace sunder
