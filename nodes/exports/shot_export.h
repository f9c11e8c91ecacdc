// A baked shot as other programs read it: one file of all frames, or a sequence.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/bake_files/manifest.h"
#include "nodes/exports/shot_looks.h"
#include "nodes/files/file_io.h"
#include "nodes/files/mesh_frame_reader.h"
#include "nodes/graph/frame_rate.h"
#include "solver/data/math.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

/// One mesh of a shot. Frames are read from disk when they are asked for: a shot may be larger than memory.
struct ShotMesh {
    std::string name;                                     // of its body, as artists call it
    std::function<Result<MeshFrame>(size_t frame)> read;  // by index in Shot::frames
    Look look = {};                                       // its materials
    std::vector<Pose> poses = {};  // of a solid, whose mesh is the same in every frame: at each frame, or one for all
    bool is_surface = false;       // of a collider that deforms: there is nothing within it, and it has no poses
};

/// Rigid bodies and colliders.
struct ShotSolids {
    std::vector<ShotMesh> meshes;
    std::vector<std::string> notes;  // sentences: what is not among them, and why
};

struct Shot {
    FrameRate frame_rate;
    std::vector<double> frames;  // numbers, ascending, `subframes` steps from one whole one to the next
    int subframes = 1;
    std::vector<ShotMesh> meshes;
    std::function<Result<ShotSolids>(double extent)> solids;  // for formats that have room for them; may be empty
};

/// Which part of a bake a shot is.
struct ShotChoice {
    std::string node = {};                                   // the mesh of one bake_mesh node; empty: all
    std::optional<std::array<int, 2>> frames = {};           // first and last; all that are baked unless given
    std::optional<std::filesystem::path> graph_folder = {};  // where paths of the graph are seen from; else the bake
    bool has_solids = true;
};

/// The mesh frames of a bake folder. Errors: no bake, no mesh frames in PLY, unknown node, frames that are not baked.
Result<Shot> baked_shot(const Manifest& manifest, const std::filesystem::path& folder, const ShotChoice& choice = {});

/// The same with its solids among the meshes; `out_note` tells what is not.
enum class Deforming { taken, left_out };
Result<Shot> with_solids(const Shot& shot, Deforming colliders, std::string& out_note);

/// Surfaces of a frame's materials: those of the mesh's look, filled up with plain ones. They take the colours of its
/// vertices if there are any, which break surfaces never do.
std::vector<Surface> surfaces_of(const ShotMesh& mesh, const MeshFrame& first);

/// The same names as encode_mesh asks for them.
FragmentSet material_names_of(const ShotMesh& mesh, const MeshFrame& first);

struct ExportSettings {
    std::filesystem::path file;  // its ending tells the format; with #### a sequence
    /// .glb: how far a vertex may be from where its rigid node takes it, in diagonals of its body in the first frame.
    double tolerance = 0.005;
};

struct ExportReport {
    std::array<int, 2> frames = {0, 0};  // first and last
    std::vector<std::pair<std::filesystem::path, FileStamp>> files;
    std::string note;  // what whoever asked should know; may be empty
};

/// Endings of whole-shot files: ".usda", ".glb", ".pc2".
bool is_shot_format(const std::string& extension);
/// The files that an export to `file` writes besides it: the mesh of a point cache.
std::vector<std::filesystem::path> companions(const std::filesystem::path& file);

/// Writes a shot. A pure function of its frames: the same bits whenever it is called. Files appear whole or not at all.
///
///   .usda      every mesh time-sampled, solids that move or deform, Z up, metres; topology constant or by frame
///   .glb       every fragment and solid a node that moves rigidly, Y up, metres; constant topology
///   .pc2       positions of one mesh for Blender's Mesh Cache (Z up, m) and the first frame as .obj; constant topology
///   .ply .obj  one file a frame, #### in the name
///
/// Errors: unknown ending; topology that changes, or fragments that deform, where the format has no room for that
/// (frame and place named); reading or writing failed; cancelled.
Result<ExportReport> export_shot(const Shot& shot, const ExportSettings& settings, const Progress& progress = {});

/// What whoever has a bake folder asks for. A chosen node's mesh comes without solids.
struct BakeExport {
    std::filesystem::path bake;
    ExportSettings settings;
    ShotChoice choice;
    bool overwrite = false;  // else a file that stands in the way is an error
};

/// Exports a bake to anywhere; makes the folder of the file. Before anything is written, every file in the way is an
/// error, and so is, even with `overwrite`, one of the bake itself.
Result<ExportReport> export_bake(const BakeExport& wanted, const Progress& progress = {});

// The formats, each in a file of its own.
Result<ExportReport> export_usda(const Shot& shot, const ExportSettings& settings, const Progress& progress);
Result<ExportReport> export_pc2(const Shot& shot, const ExportSettings& settings, const Progress& progress);
Result<ExportReport> export_glb(const Shot& shot, const ExportSettings& settings, const Progress& progress);

/// bad_input if faces differ from those of the first frame.
Status check_constant_topology(const VisualMesh& first, const VisualMesh& mesh, const std::string& name, double frame,
                               const std::string& format);

}  // namespace sunder
