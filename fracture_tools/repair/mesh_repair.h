// Surfaces as they come made into surfaces that bound a solid: the artist's triangles where that can be, else a new
// one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

enum class RepairMode {
    automatic,  // the artist's triangles; where they cannot be made a solid that can be cut, a wrap
    keep,       // the artist's triangles, or an error
    wrap,       // a new surface around the triangles
    refuse,     // a mesh that is no solid as it is is an error
};

struct RepairSettings {
    RepairMode mode = RepairMode::automatic;
    double thickness = 0;       // m, >= 0; open sheets become walls as thick as this; 0: they are refused
    double wrap_detail = 0.02;  // share of the box's diagonal; a wrap bridges what is narrower, 0.002 .. 0.2
    /// How far apart borders may be that are welded, m, >= 0; 0: equal positions alone; nothing: found (seam_gap).
    std::optional<double> weld_distance = {};

    Status check(const std::string& where) const;  // ranges
};

struct RepairedMesh {
    TriMesh mesh;            // bounds a solid
    size_t n_crossings = 0;  // pairs of triangles that cross all the same
    bool is_wrapped = false;
};

/// Makes a mesh a solid. What was done is told in `io_warnings`, with what was lost; a mesh in order passes through as
/// it is.
///
/// Keeping triangles: equal positions and borders closer than the weld distance are welded, duplicate and degenerate
/// triangles dropped, surfaces parted where they touch themselves, open edges split where vertices lie on them, holes
/// closed, sheets within solid matter dropped, others given thickness, shells oriented (arrange_shells), shells that
/// cross one another united. Triangles that stay keep corner attributes and material; those that close a hole have a
/// neighbour's. Crossings stay, and are told.
///
/// Errors, with the place of the fault: no triangles, coordinates that are not finite, no volume; a sheet (a
/// border longer than half its shell's diagonal, with more than 15 % of its area within) without a thickness; faults
/// that are left; cancelled.
Result<RepairedMesh> repair_mesh(const TriMesh& mesh, const RepairSettings& settings, const std::string& where,
                                 std::vector<std::string>& io_warnings, const Progress& progress = {});

/// A new surface around `mesh`, for when keeping its triangles did not do because of `reason`, a sentence.
Result<RepairedMesh> wrap_mesh(const TriMesh& mesh, const RepairSettings& settings, const std::string& reason,
                               const std::string& where, std::vector<std::string>& io_warnings,
                               const Progress& progress = {});

}  // namespace sunder
