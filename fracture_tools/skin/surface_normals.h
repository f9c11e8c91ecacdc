// Corner normals of the visual mesh: smooth on the artist's surface, sharp where it broke.
#pragma once

#include <atomic>
#include <optional>
#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/artist_normals.h"
#include "fracture_tools/skin/corner_weights.h"
#include "fracture_tools/skin/normal_parts.h"
#include "fracture_tools/skin/shared_array.h"
#include "fracture_tools/skin/skin_motion.h"
#include "fracture_tools/skin/split_topology.h"
#include "solver/data/fragment_set.h"

namespace sunder {

/// Which corners share a normal is decided at rest, around each vertex: two faces with a common edge are smooth there
/// if their rest normals differ by less than 60 degrees (outer faces), or less than the set's interior smooth angle
/// (break surfaces of one fragment). Outer and interior faces never are: a break has a sharp rim. At run time corners
/// that are smooth and still on one visual vertex get the mean of their faces' normals, weighted by the faces' angles.
///
/// Where the artist brought normals, outer corners have those (artist_normals.h).
class SurfaceNormals {
public:
    /// `rest_vertex`: pool vertices in rest coordinates. `rest_normals`: the artist's, of outer corners, in rest
    /// coordinates; or empty. `interface_normals`: unit, from a to b, in rest coordinates (n_interfaces).
    /// `interior_smooth_angle`: degrees.
    SurfaceNormals(const SplitTopology& topology, std::span<const Vec3> rest_vertex, std::span<const Vec3> rest_normals,
                   std::span<const Vec3> interface_normals, double interior_smooth_angle);

    /// Whether `place_chunk` reads normal maps.
    SkinExtras needs() const { return artist_->size() == 0 ? SkinExtras::none : SkinExtras::normal_maps; }

    /// Finds which corners share a normal, around the pool vertices that changed, and lists normals in one pass. Call
    /// after each update of `topology` that changed something; the next `evaluate` takes all as moved.
    void bind(const SplitTopology& topology, const RangeRunner& run);

    /// For each chunk of vertices that `motion` moves, once they are in place.
    void place_chunk(const SplitTopology& topology, const SkinMotion& motion, size_t chunk,
                     std::span<const NormalMap> normal_map);

    /// Of the vertices as `motion` has just moved them, after all chunks. Gives a unit vector for each corner,
    /// degenerate triangles included: those have their rest normal, turned by the skin. What touches no moved vertex is
    /// left as it was. (3 n_triangles x 3)
    SharedArray<Vec3f> evaluate(const SplitTopology& topology, const SkinBinding& binding, const SkinMotion& motion,
                                const RangeRunner& run);

private:
    static constexpr size_t kTriangles = 512;  // whose corners are written together
    static constexpr size_t kGrain = 1024;     // triangles or normals that are worth a thread

    void find_rest_normals(const FragmentFaces& faces, std::span<const Vec3> rest_vertex,
                           std::span<const Vec3> interface_normals);
    std::vector<uint32_t> find_smooth_corners(const FragmentFaces& faces, double interior_cosine) const;
    void weigh_moved(const SplitTopology& topology, const SkinMotion& motion, size_t begin, size_t end);
    bool touches_moved(size_t normal, const SkinMotion& motion) const;
    void find_moved(const SkinMotion& motion, size_t begin, size_t end);
    size_t normal_of(uint32_t face, uint32_t corner) const;  // index of `normal_`
    bool any_moved(std::span<const uint32_t> faces) const;
    void turn_unsaid(const SplitTopology& topology, const SkinBinding& binding, const SkinMotion& motion, size_t begin,
                     size_t end, Vec3f* out) const;

    uint32_t first_teller_ = 0;      // faces from here on have a say in normals: with the artist's, inner ones alone
    std::vector<Vec3> rest_normal_;  // unit                           (n_faces x 3)
    std::vector<uint8_t> sliver_;    // face too thin to tell a normal (n_faces)
    std::vector<uint8_t> silent_;    // sliver, or hidden: has no say in how its neighbours are shaded   (n_faces)

    std::optional<ArtistNormals> artist_;  // of the faces before it
    std::optional<NormalParts> parts_;     // of tellers' corners
    std::vector<uint32_t> part_angle_;     // of NormalParts::corners(): where weights_ has the angle, in floats

    std::vector<CornerWeights> weights_;    // of faces from first_teller_ on; zero where one is not listed or is silent
    std::vector<uint8_t> teller_moved_;     // as weights_
    std::vector<CornerNormal> normal_;      // the artist's, then others at the number of the part that leads them
    std::vector<uint8_t> normal_moved_;     // the same; not kept up where all moved
    std::atomic<bool> any_unsaid_ = false;  // false: no normal is
    std::vector<uint64_t> chunk_changed_;   // SkinMotion::frame in which a chunk changed last
    ArrayRecycler<Vec3f> recycler_;
};

}  // namespace sunder
