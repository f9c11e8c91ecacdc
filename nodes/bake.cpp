#include "nodes/bake.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <span>

#include "nodes/bake_exports.h"
#include "nodes/bake_files/bake_folder.h"
#include "nodes/bake_files/break_log.h"
#include "nodes/files/frame_number.h"
#include "nodes/files/output_pattern.h"
#include "nodes/files/state_file.h"
#include "nodes/frame_writer.h"
#include "nodes/graph/common_parameters.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

const SocketDescription* find_socket(const std::vector<SocketDescription>& sockets, SocketType type) {
    const auto found = std::ranges::find(sockets, type, &SocketDescription::type);
    return found == sockets.end() ? nullptr : &*found;
}
const SocketDescription* find_output(const NodeDescription& node, SocketType type) {
    return find_socket(node.outputs, type);
}
const SocketDescription* find_input(const NodeDescription& node, SocketType type) {
    return find_socket(node.inputs, type);
}

std::span<const std::string> warnings_of(const Value& value) {
    if (const auto* state = std::get_if<std::shared_ptr<const StateValue>>(&value)) return (*state)->warnings;
    if (const auto* collider = std::get_if<std::shared_ptr<const ColliderValue>>(&value)) return (*collider)->warnings;
    if (const auto* cut = std::get_if<std::shared_ptr<const FragmentSet>>(&value)) return (*cut)->warnings;
    return {};
}

// One bake at work.
class Baker {
public:
    Baker(Graph& graph, const BakeSettings& settings, const Progress& progress)
        : graph_(graph), settings_(settings), progress_(progress) {}

    Result<BakeReport> run() {
        for (Status (Baker::*step)() :
             {&Baker::find_nodes, &Baker::choose_frames, &Baker::check_paths, &Baker::prepare_folder})
            if (Status s = (this->*step)(); !s) return s.error();
        const int last = manifest_.frame_range[1];
        report_.frames = manifest_.frame_range;
        report_.first_new_frame = next_frame();
        const double share = exports_.empty() ? 1 : 0.9;  // of the progress, that frames take
        const double n = (last - manifest_.frame_range[0] + 1) / share;
        if (Status s = bake_frames(next_frame(), last, n); !s) return s.error();
        if (report_.n_frames > 0)
            if (Status s = note_warnings(last); !s) return s.error();
        if (!exports_.empty() && (report_.n_frames > 0 || !exports_are_whole(manifest_, *folder_))) {
            auto made = write_exports(exports_, *folder_, graph_.base_folder(), manifest_, progress_.part(share, 1));
            if (!made) return made.error();
            report_.n_files += made->stamps.size();
            for (const FileStamp& stamp : made->stamps) report_.bytes += stamp.size;
            report_.notes.insert(report_.notes.end(), made->notes.begin(), made->notes.end());
        }
        (void)progress_.report(1, "baked");
        return report_;
    }

private:
    int next_frame() const { return manifest_.frame_range[0] + static_cast<int>(manifest_.frames.size()); }

    // What meshes wanted of a cut or a collider, and what solvers' methods leave out.
    Status note_warnings(int frame) {
        for (const SocketReference& at : telling_) {
            const Result<Value> value = graph_.evaluate(at.node, at.socket, frame);
            if (!value) return value.error();
            for (const std::string& warning : warnings_of(*value))
                report_.notes.push_back(warning.starts_with("node '") ? warning : "node '" + at.node + "': " + warning);
        }
        return {};
    }

    Status find_nodes() {
        std::set<std::string> seen;
        for (const std::string& name : graph_.node_names()) {
            const NodeDescription& description = **graph_.describe(name);
            const SocketDescription* item = find_output(description, SocketType::bake_item);
            if (!item) continue;
            bake_nodes_.push_back({name, item->name});
            find_solvers(name, seen);
        }
        if (bake_nodes_.empty())
            return bad_input("graph", "has no node that bakes", "add one of type bake_mesh or bake_state");
        return {};
    }

    void find_solvers(const std::string& node, std::set<std::string>& seen) {
        if (!seen.insert(node).second) return;
        const NodeDescription& description = **graph_.describe(node);
        for (const SocketDescription& input : description.inputs) {
            const auto wires = graph_.wires({node, input.name});
            if (wires)
                for (const SocketReference& w : *wires) find_solvers(w.node, seen);
        }
        if (const SocketDescription* state = find_output(description, SocketType::state))
            solvers_.push_back({node, state->name}), telling_.push_back(solvers_.back());
        else if (const SocketDescription* collider = find_output(description, SocketType::collider))
            telling_.push_back({node, collider->name});
        else if (const SocketDescription* cut = find_output(description, SocketType::fragments);
                 cut && !find_input(description, SocketType::fragments))  // else those of the cut that it passes on
            telling_.push_back({node, cut->name});
    }

    Status choose_frames() {
        frames_ = settings_.frames.value_or(graph_.frame_range());
        const std::string range = std::to_string(frames_[0]) + ":" + std::to_string(frames_[1]);
        if (frames_[0] > frames_[1]) return bad_input("frames", range + " is reversed", "the first frame stands first");
        if (frames_[0] < graph_.frame_range()[0])
            return bad_input("frames", range + " begins before the simulation does",
                             "it begins at frame " + std::to_string(graph_.frame_range()[0]));
        if (frames_[1] > 1'000'000) return bad_input("frames", range + " is out of range", "permitted: up to 1000000");
        return {};
    }

    // No two files of one name, and known formats, before any work is done.
    Status check_paths() {
        std::map<std::string, std::string> owner;
        for (const SocketReference& bake : bake_nodes_) {
            const auto fault = [&](std::string what, std::string mend) -> Status {
                return node_error(bake.node, "path", std::move(what), std::move(mend));
            };
            const auto pattern = graph_.parameter(bake.node, "path");
            if (!pattern || !pattern->is_string()) return fault("is not a path", "give a path below the output folder");
            const std::string text = pattern->get<std::string>();
            if (Status s = check_output_pattern(text); !s) return fault(s.error().what, s.error().mend);
            const bool is_state = !graph_.wires({bake.node, "mesh"});
            const std::string extension = fs::path(text).extension().string();
            if (extension != ".ply" && (is_state || extension != ".obj"))
                return fault(
                    (is_state ? "states are not written as '" : "meshes are not written as '") + extension + "'",
                    is_state ? "end the path in .ply" : "end the path in .ply or .obj");
            if (text.starts_with(std::string(kResumeFolder) + "/"))
                return fault("the folder " + std::string(kResumeFolder) + " is kept for resuming",
                             "choose another one");
            const auto compression = graph_.parameter(bake.node, "compression");
            const std::string suffix = compressed_suffix(compression ? compression->get<std::string>() : "none");
            const auto steps = graph_.parameter(bake.node, "subframes");
            const int n_steps = steps ? steps->get<int>() : 1;
            std::vector<std::string> files;
            for (int frame = frames_[0]; frame <= frames_[1]; ++frame)
                for (int step = 0; step < (frame < frames_[1] ? n_steps : 1); ++step)
                    files.push_back(output_path(text, sub_frame(frame, step, n_steps)) + suffix);
            for (int step = 1; step < n_steps; ++step) between_[sub_frame(0, step, n_steps)].push_back(bake);
            auto wanted = wanted_export(graph_, bake.node, text);
            if (!wanted) return wanted.error();
            if (*wanted) {
                for (const std::string& path : files_of(**wanted)) files.push_back(path);
                exports_.push_back(std::move(**wanted));
            }
            for (const std::string& path : files) {
                const auto [other, is_new] = owner.try_emplace(path, bake.node);
                if (!is_new)
                    return fault("writes the same file as node '" + other->second + "': " + other->first,
                                 "give each its own path");
            }
        }
        // No other file ends as the log's do.
        for (const SocketReference& solver : solvers_)
            for (int frame = frames_[0]; frame <= frames_[1]; ++frame)
                owner.try_emplace(breaks_path(solver.node, frame), solver.node);
        for (const auto& [path, node] : owner)
            for (fs::path folder = fs::path(path).parent_path(); !folder.empty(); folder = folder.parent_path())
                if (const auto file = owner.find(folder.string()); file != owner.end())
                    return node_error(node, "path",
                                      "lies in a folder that is a file of node '" + file->second + "': " + file->first,
                                      "give each its own path");
        paths_ = std::move(owner);
        return {};
    }

    Status check_free(const std::set<std::string>& listed) const {
        for (const auto& [path, node] : paths_)
            if (Status s = folder_->check_writable(path, listed); !s) {
                Error error = s.error();
                error.node = node, error.parameter = "path";
                return error;
            }
        return {};
    }

    Status prepare_folder() {
        auto wanted = new_manifest(graph_, frames_);
        if (!wanted) return wanted.error();
        manifest_ = wanted.take();
        manifest_.log = {frames_[0], {}, {}};
        loads_.resize(solvers_.size());
        for (size_t i = 0; i < solvers_.size(); ++i) loads_[i].node = solvers_[i].node;
        auto folder = BakeFolder::open(settings_.folder);
        if (!folder) return folder.error();
        folder_.emplace(folder.take());
        if (!folder_->has_manifest()) {
            std::error_code code;
            const auto hidden = folder_->path() / kResumeFolder;
            if (fs::exists(fs::symlink_status(hidden, code)))
                return bad_input(hidden.string(), "is there already and is not part of this bake",
                                 "choose another folder, or move it away");
            if (Status s = check_free({}); !s) return s;
            return folder_->write_manifest(manifest_);
        }
        auto text = read_file(folder_->path() / kManifestName);
        if (!text) return text.error();
        if (!is_own_manifest(*text))
            return bad_input((folder_->path() / kManifestName).string(),
                             "is there already and is not the manifest of a bake",
                             "choose another folder, or move it away");
        switch (settings_.start) {
            case BakeStart::fresh:
                // A bake that failed before its first frame leaves nothing that could be lost.
                if (const auto old = parse_manifest(*text, settings_.folder); old && old->frames.empty())
                    return restart(*text);
                return bad_input(settings_.folder, "holds a bake already",
                                 "--resume goes on with it, --restart bakes it anew");
            case BakeStart::restart:
                return restart(*text);
            case BakeStart::resume:
                return resume(*text);
        }
        return {};
    }

    // What is there goes when the first frame is to be written, so that a graph that cannot be evaluated costs nothing.
    Status restart(const std::string& text) {
        std::set<std::string> own;
        replaced_.emplace();
        if (const auto old = parse_manifest(text, settings_.folder)) {
            for (const ManifestFrame& frame : old->frames)
                frame.for_each_file([&](double, const ManifestFile& f) { replaced_->push_back(f); });
            if (old->log)
                for (const auto* files : {&old->log->breaks, &old->log->loads})
                    replaced_->insert(replaced_->end(), files->begin(), files->end());
            std::ranges::copy(begun_files(*old), std::back_inserter(*replaced_));
            for (const ManifestFile& f : *replaced_)
                if (folder_->is_own(f)) own.insert(f.path);
            for (const ManifestFile& f : old->exports) own.insert(f.path), replaced_->push_back(f);
        }
        return check_free(own);  // exports may be there without a stamp
    }

    Status remove_replaced() {
        if (!replaced_) return {};
        for (const ManifestFile& f : *replaced_)
            if (Status s = folder_->remove_own(f); !s) return s;
        replaced_.reset();
        if (Status s = folder_->write_manifest(manifest_); !s) return s;
        return folder_->prune_resume_states(manifest_);
    }

    Status resume(const std::string& text) {
        const std::string where = (folder_->path() / kManifestName).string();
        auto old = parse_manifest(text, where);
        if (!old) return old.error();
        if (const auto differing = differences(*old, manifest_); !differing.empty()) {
            constexpr size_t kNamed = 5;
            std::string list;
            for (size_t i = 0; i < std::min(differing.size(), kNamed); ++i) list += (i ? "; " : "") + differing[i];
            if (differing.size() > kNamed) list += "; and " + std::to_string(differing.size() - kNamed) + " more";
            return bad_input(where, "this is another bake: " + list, "change it back, or bake anew with --restart");
        }
        auto check = verify_files(*old, folder_->path(), progress_.part(0, 0));
        if (!check) return check.error();
        const size_t n_faults = check->faults.size() - (check->missing_frames.empty() ? 0 : 1);
        if (n_faults > 0)
            return bad_input(where,
                             "does not tell the truth: " + check->faults.front() +
                                 (n_faults > 1 ? ", and " + std::to_string(n_faults - 1) + " more" : ""),
                             "put the files back, or bake anew with --restart");
        const std::set<std::string> listed = listed_paths(*old);
        if (Status s = check_free(listed); !s) return s;
        manifest_.frames = old->frames;
        manifest_.resume = old->resume;
        manifest_.exports = old->exports;
        manifest_.log = old->log.value_or(ManifestLog{next_frame(), {}, {}});
        // A shorter range than what is there leaves it as it is.
        const int last_whole = next_frame() - 1;
        manifest_.frame_range[1] = std::max(manifest_.frame_range[1], last_whole);
        manifest_.graph["frame_range"][1] = std::max(graph_.frame_range()[1], manifest_.frame_range[1]);
        if (last_whole >= manifest_.frame_range[0] && last_whole < manifest_.frame_range[1])
            if (Status s = seed_solvers(last_whole); !s) return s;
        return folder_->write_manifest(manifest_);
    }

    Status seed_solvers(int frame) {
        if (Status s = take_up_loads(); !s) return s;
        for (const SocketReference& solver : solvers_) {
            const auto saved = std::find_if(manifest_.resume.begin(), manifest_.resume.end(),
                                            [&](const ManifestFile& f) { return f.node == solver.node; });
            if (saved == manifest_.resume.end())
                return bad_input((folder_->path() / kManifestName).string(),
                                 "names no state of node '" + solver.node + "' to resume from",
                                 "bake anew with --restart");
            const std::string path = (folder_->path() / saved->path).string();
            auto file = read_state_file(path);
            if (!file) return file.error();
            if (file->frame != frame)
                return bad_input(path, "is frame " + frame_text(file->frame) + " instead of " + frame_text(frame),
                                 "bake anew with --restart");
            const int grid = file->at.grid();
            if (Status s = graph_.seed_state(solver.node, grid, file->state, progress_.part(0, 0)); !s) return s;
            const auto value = graph_.evaluate(solver.node, solver.socket, frame);
            if (!value) return value.error();
            const auto& state = std::get<std::shared_ptr<const StateValue>>(*value);
            if (state->at.grid() != grid)
                return bad_input(
                    path,
                    "is simulated frame " + std::to_string(grid) + " instead of " + std::to_string(state->at.grid()),
                    "bake anew with --restart");
            if (Status s = require_same_scene(*file, state->scene->rest, path); !s) return s;
        }
        return {};
    }

    // What fragments bore before: of an earlier Sunder's frames nothing.
    Status take_up_loads() {
        for (const ManifestFile& file : manifest_.log->loads)
            for (FragmentLoads& loads : loads_) {
                if (loads.node != file.node) continue;
                const std::string path = (folder_->path() / file.path).string();
                auto text = read_file(path);
                if (!text) return text.error();
                auto known = decode_loads(*text, path);
                if (!known) return known.error();
                loads = known.take();
            }
        // The log has no loads of a solver of which nothing could break so far.
        for (FragmentLoads& loads : loads_) {
            loads.goes_on = loads.of.empty() && manifest_.log->from < next_frame();
            if (loads.goes_on && manifest_.log->from > graph_.frame_range()[0]) loads.cracks_from = manifest_.log->from;
        }
        return {};
    }

    // Frames are written while the next ones are simulated. However this ends, what was put is whole, or absent.
    Status bake_frames(int first, int last, double n) {
        std::vector<std::string> bake_names, solver_names;
        for (const SocketReference& o : bake_nodes_) bake_names.push_back(o.node);
        for (const SocketReference& o : solvers_) solver_names.push_back(o.node);
        FrameWriter writer(*folder_, manifest_, bake_names, solver_names);
        Status status;
        for (int frame = first; frame <= last && status; ++frame) {
            const double done = frame - report_.frames[0];
            status = bake_frame(frame, writer, progress_.part(done / n, (done + 1) / n));
            tell_done(writer);
        }
        const Status written = writer.finish();
        tell_done(writer);
        return written ? status : written;
    }

    void tell_done(FrameWriter& writer) {
        for (const BakedFrame& done : writer.take_done()) {
            ++report_.n_frames;
            report_.n_files += done.n_files;
            report_.bytes += done.bytes;
            if (settings_.frame_done) settings_.frame_done(done);
        }
    }

    Status bake_frame(int frame, FrameWriter& writer, const Progress& progress) {
        BakedFrame done;
        done.frame = frame, done.last_frame = report_.frames[1];
        const std::string text = "frame " + std::to_string(frame);
        if (!progress.report(0, text)) return cancelled();
        if (frame > report_.frames[0] && !between_.empty()) {
            constexpr double kShare = 0.8;  // what lies before it simulates the frame
            if (Status s = bake_between(frame, writer, done, progress.part(0, kShare)); !s) return s;
            return bake_whole(done, writer, progress.part(kShare, 1));
        }
        return bake_whole(done, writer, progress);
    }

    // What is blended since the frame before.
    Status bake_between(int frame, FrameWriter& writer, BakedFrame& io_done, const Progress& progress) {
        double n_done = 0;
        for (const auto& [share, nodes] : between_) {
            const double at = frame - 1 + share, n = static_cast<double>(between_.size());
            const Progress part = progress.part(n_done / n, (n_done + 1) / n);
            n_done += 1;
            auto begin = Clock::now();
            for (const SocketReference& solver : solvers_) {
                const auto state = graph_.evaluate(solver.node, solver.socket, at, part.part(0, 0.8));
                if (!state) return state.error();
            }
            io_done.simulate_s += seconds_since(begin);
            begin = Clock::now();
            FrameToWrite sub{.items = {}, .states = {}, .loads = {}, .done = {}, .between = at};
            const std::vector<Result<Value>> values = graph_.evaluate_all(nodes, at, part.part(0.8, 1));
            size_t next = 0;
            for (const SocketReference& bake : bake_nodes_) {
                sub.items.emplace_back();
                if (next == nodes.size() || nodes[next] != bake) continue;
                const Result<Value>& value = values[next++];
                if (!value) return value.error();
                sub.items.back() = std::get<std::shared_ptr<const BakeItem>>(*value);
            }
            io_done.other_nodes_s += seconds_since(begin);
            if (!part.report(1, "frame " + frame_text(at))) return cancelled();
            if (Status s = remove_replaced(); !s) return s;
            if (Status s = writer.put(std::move(sub)); !s) return s;
        }
        return {};
    }

    Status bake_whole(BakedFrame done, FrameWriter& writer, const Progress& progress) {
        const int frame = done.frame;
        const std::string text = "frame " + std::to_string(frame);

        // Solvers first: they take the time, and this is where cancelling is looked for.
        constexpr double kSolverShare = 0.8;  // of a frame's progress
        auto begin = Clock::now();
        std::vector<std::shared_ptr<const StateValue>> states;
        for (size_t i = 0; i < solvers_.size(); ++i) {
            const double n = static_cast<double>(solvers_.size());
            auto value = graph_.evaluate(solvers_[i].node, solvers_[i].socket, frame,
                                         progress.part(kSolverShare * static_cast<double>(i) / n,
                                                       kSolverShare * static_cast<double>(i + 1) / n));
            if (!value) return value.error();
            states.push_back(std::get<std::shared_ptr<const StateValue>>(*value));
            add(states.back()->report, done.step);
            add_loads(*states.back(), loads_[i]);
        }
        done.simulate_s += seconds_since(begin);

        begin = Clock::now();
        std::vector<std::shared_ptr<const BakeItem>> items;
        for (const Result<Value>& value : graph_.evaluate_all(bake_nodes_, frame, progress.part(kSolverShare, 1))) {
            if (!value) return value.error();
            items.push_back(std::get<std::shared_ptr<const BakeItem>>(*value));
        }
        done.other_nodes_s += seconds_since(begin);
        if (!progress.report(1, text)) return cancelled();

        if (Status s = remove_replaced(); !s) return s;
        return writer.put({std::move(items), std::move(states), loads_, done});
    }

    static void add(const StepReport& from, StepReport& to) {
        to.edges_broken += from.edges_broken, to.contacts += from.contacts, to.n_components += from.n_components;
        to.predict_s += from.predict_s, to.shape_s += from.shape_s, to.contact_s += from.contact_s;
        to.momentum_s += from.momentum_s, to.fracture_s += from.fracture_s;
    }

    Graph& graph_;
    const BakeSettings& settings_;
    const Progress& progress_;
    std::optional<BakeFolder> folder_;                        // once nothing else can be refused
    std::vector<SocketReference> bake_nodes_, solvers_;       // solvers in the order in which bake nodes need them
    std::map<double, std::vector<SocketReference>> between_;  // shares of a frame -> the bake nodes that have them
    std::vector<SocketReference> telling_;  // outputs whose values have warnings, in the order of wires
    std::vector<WantedExport> exports_;
    std::array<int, 2> frames_ = {0, 0};
    std::map<std::string, std::string> paths_;           // every file of the bake -> its node
    std::vector<FragmentLoads> loads_;                   // as solvers_
    Manifest manifest_;                                  // as on disk, once nothing is to be replaced
    std::optional<std::vector<ManifestFile>> replaced_;  // of an earlier bake, until they go
    BakeReport report_;
};

}  // namespace

Result<BakeReport> bake(Graph& graph, const BakeSettings& settings, const Progress& progress) {
    if (settings.folder.empty()) return bad_usage("no output folder is given", "-o DIR");
    if (Status s = graph.check(); !s) return s.error();
    return Baker(graph, settings, progress).run();
}

}  // namespace sunder
