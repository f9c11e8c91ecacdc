// Where the pieces of a Voronoi cut have their middles: what an artist directs the cut with.
#pragma once

#include <string>
#include <vector>

#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

enum class SiteKind {
    uniform,  // anywhere in the solid with equal chance: large and small pieces
    poisson,  // no two closer than a distance that is as large as possible (Cook 1986)
    impact,   // the smaller the nearer to where something hits
    grid,     // a cubic grid, disturbed
    points,   // as given
    density,  // denser near a group of vertices, or where an attribute is painted
    kmeans,   // moved to the middles of their cells (Lloyd 1982): pieces of like size
};

/// Shape that `points` are an impact's.
enum class ImpactShape { points, curve };

struct SiteSettings {
    SiteKind kind = SiteKind::kmeans;
    int count = 300;  // wanted, >= 1; `points` has as many as are given, a grid about as many
    uint32_t seed = 0;
    std::vector<Vec3> points;  // m; sites for `points`, where it hits for `impact`
    ImpactShape shape = ImpactShape::points;
    double impact_radius = 0.1;  // m, > 0; up to there pieces are alike, beyond their size grows with the distance
    double grid_jitter = 0.3;    // share of half a grid cell, 0 .. 1
    std::string density_group;  // of the mesh's vertex groups, or of its attributes: 1 counts as in the group, 0 as out
    double density_factor = 8;  // how many times more sites a volume has at the group, 1 .. 1000
    bool sheets = true;  // sites lie on the middle surface where the solid is thinner than pieces are large; not `grid`
                         // and `points`

    Status check(const std::string& where, const TriMesh& mesh) const;
};

/// Sites for a solid, at least one. None lies closer to another than 1e-5 of the mesh's diagonal (the later one goes).
/// Deterministic: same mesh and settings, same bits for any number of threads (0: all cores). Errors: settings out of
/// range or missing, cancelled.
Result<std::vector<Vec3>> choose_sites(const TriMesh& solid, const SiteSettings& settings, int threads,
                                       const std::string& where, const Progress& progress = {});

}  // namespace sunder
