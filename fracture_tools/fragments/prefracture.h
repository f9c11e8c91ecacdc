// A surface mesh becomes fragments: the one door to the cutters.
#pragma once

#include <string>
#include <vector>

#include "fracture_tools/fragments/fragment_factors.h"
#include "fracture_tools/fragments/interior.h"
#include "fracture_tools/repair/mesh_repair.h"
#include "fracture_tools/voronoi/sites.h"
#include "solver/data/fragment_set.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

enum class CutMethod {
    voronoi,  // along Voronoi cells of sites: flat break surfaces, the artist's own surface kept
    kmeans,   // small cells gathered into pieces of like size: rough break surfaces
};

/// Small cells that method kmeans gathers into pieces.
enum class CellSource {
    tets,     // tetrahedra: the paper's way
    voronoi,  // Voronoi cells: the artist's surface is kept
};

struct PrefractureSettings {
    CutMethod method = CutMethod::voronoi;
    int pieces = 300;           // wanted number of fragments, 1 .. 100000
    uint32_t seed = 0;          // of everything that is drawn at random
    int threads = 0;            // 0: all cores; any number gives the same bits
    SiteSettings sites;         // voronoi: where the pieces are; `count` and `seed` are taken from above
    int roughness = 1;          // voronoi: cells per piece, 1 .. 64; 1: flat break surfaces
    double least_piece = 0.05;  // voronoi: share of its neighbours' volume below which a piece joins one, 0 .. 1
    CellSource source = CellSource::tets;  // kmeans
    double cells_per_piece = 30;           // kmeans: cells per fragment aimed at, 4 .. 1000
    double sharp_angle = 0;           // kmeans: degrees; edges sharper than this are kept as features; 0: automatic
    RepairSettings repair;            // of the input, before it is cut
    InteriorSettings interior;        // looks of break surfaces
    PaintedMaps maps;                 // factors painted on the mesh
    int clusters = 0;                 // that fragments are gathered into, 0 .. pieces; 0: none
    double cluster_toughness = 4;     // factor on interfaces within a cluster, 1 .. kMostFactor
    double weak_interface_share = 0;  // interfaces below it join no fragments (leave_out_weak_interfaces), 0 .. 1

    Status check(const std::string& where) const;  // ranges
};

/// Fragments whose volumes sum to something farther from the source's than this share are refused.
constexpr double kMaxVolumeError = 0.05;
/// A fragment's volume, measured in two ways, may differ by this share.
constexpr double kMeasureError = 1e-9;

/// Cuts a solid mesh, repaired first; where the repaired one cannot be cut because its surface crosses itself, a wrap
/// of it (RepairMode::automatic). `where` names the mesh in errors. Errors: open / self-intersecting / zero-volume
/// mesh, more pieces than cells, a fragment that could not be closed or measured. Deterministic: same mesh and
/// settings, same bits.
Result<FragmentSet> prefracture(const TriMesh& mesh, const PrefractureSettings& settings, const std::string& where,
                                const Progress& progress = {});

/// Fills volume, centroid, covariance, orientation and radii of every fragment, and area, normal and centroid of
/// every interface, from the triangles; cutters call it last. Exact polyhedral integrals.
void measure_fragments(FragmentSet& io_set);

/// One fragment as a closed 2-manifold mesh of its own: vertices where the fragment only touches itself (pinches) are
/// duplicated, one for each fan. Material: outer ids, `interior_material` on break surfaces. UVs where the set has
/// them.
TriMesh fragment_mesh(const FragmentSet& set, FragmentId fragment);

/// The same for many fragments: the interfaces of each are looked up once for all. The set must outlive it.
class FragmentMeshes {
public:
    explicit FragmentMeshes(const FragmentSet& set);
    TriMesh mesh(FragmentId fragment) const;

private:
    const FragmentSet& set_;
    std::vector<uint32_t> begin_, interface_;  // CSR: ascending interfaces of each fragment
};

/// The fragments' own invariants: each closed, positive volume, volumes sum to the source. Errors name the fragment,
/// the first one of those that have any. `threads`: 0 all cores.
Status check_fragments(const FragmentSet& set, int threads = 1);

}  // namespace sunder
