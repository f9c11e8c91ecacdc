// An animated mesh as the motion of a body that was cut from it: where the artist's vertices are at each frame, and
// what that makes of fragments.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fracture_tools/skin/fragment_motion.h"
#include "fracture_tools/skin/vertex_frames.h"
#include "solver/data/fragment_set.h"
#include "solver/data/math.h"
#include "solver/data/result.h"
#include "solver/data/simulation_mesh.h"
#include "solver/data/source_pose.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// What of the animation's stretch is taken as the body's rest once it is let go.
enum class SourceStrain { none_is_rest, all_is_rest };

/// A body, as it was cut and placed. Views: all must outlive the call that they are given to.
struct CutBody {
    const FragmentSet& fragments;
    const SimulationMesh& rest;  // as placed: particle i is fragment i
    const Pose& pose;            // fragment coordinates -> scene
};

/// Weighted points, and how they spread.
struct PointCloud {
    double weight = 0;
    Vec3 mean = Vec3::Zero();
    Mat3 spread = Mat3::Zero();  // (1/w) sum w (x - mean)(x - mean)^T, m2
};

/// What fragments and the vertices of their surface do.
///
/// A vertex of the outer surface lies on a triangle of the mesh, or beside it where the surface was meshed anew: it
/// goes where the triangle's corners take it, and turns beside it with its fragment. A fragment goes where the best map
/// of its skin takes its centre, and turns as that map does there: the best of second order, for a skin lies around the
/// centre, and where it bends an affine map goes beside it. Where its own skin is too flat to tell, the skin of its
/// neighbours is asked as well, ring by ring, until it spans the fragment's thickness.
class VertexMotion final : public FragmentMotion {
public:
    /// Of those of the body's fragments that are named, or of all if none is. Errors: those of VertexFrames::check, a
    /// mesh that is not that of the body.
    static Result<std::shared_ptr<const VertexMotion>> make(const CutBody& body, const TriMesh& mesh,
                                                            VertexFrames frames, SourceStrain strain,
                                                            std::span<const uint32_t> fragments = {});

    /// A moment, between two frames or at one.
    struct Moment {
        int frame = 0;     // at or before it
        double share = 0;  // of the way to the next, 0 .. 1
        std::shared_ptr<const SourcePose> begin = {}, end = {};

        SourceWay way(const Vec3& pivot) const { return {*begin, *end, pivot, share}; }
    };
    Result<Moment> moment(double frame) const;

    bool is_on_skin(uint32_t pool_vertex) const { return tie_[pool_vertex].triangle != kNone; }
    /// Where the vertices on the skin are; those within keep what `o_vertex` has. (n_pool_vertices x 3), m
    void place(const Moment& moment, std::vector<Vec3>& o_vertex) const;
    /// How fast they are, by the way to that frame, of the first by the way on; `seconds`: of a frame. m/s
    void velocities(const Moment& moment, double seconds, std::vector<Vec3>& o_velocity) const;

private:
    // A vertex of the pool by the mesh, kNone: it does not lie on the skin.
    struct Tie {
        uint32_t triangle = kNone, fragment = 0;
        Vec3 weight = Vec3::Zero();  // of the triangle's corners
        Vec3 offset = Vec3::Zero();  // beside it at rest, m, in the scene
    };
    // What a vertex p of the skin says of a fragment: its centre lies at sum share p, and the map there is sum p
    // gradient^T.
    struct Sample {
        uint32_t vertex;
        double share;
        Vec3 gradient;  // 1/m
    };

    VertexMotion() = default;
    Status tie(const CutBody& body, const TriMesh& mesh);
    void fit(const CutBody& body);
    // `skin`: of each fragment; `point`: on the mesh at rest, of each pool vertex, m.
    void fit_fragment(const SimulationMesh& rest, std::span<const std::vector<std::pair<uint32_t, double>>> skin,
                      std::span<const Vec3> point, uint32_t fragment);
    void add_samples(const Vec3& center, const std::map<uint32_t, double>& weight, const PointCloud& cloud,
                     std::span<const Vec3> point);
    size_t index_of(int frame) const { return frames_.index_of(frame); }
    Vec3 on_mesh(size_t frame_index, const Tie& tie) const;
    /// An error names the one of its fragments that is turned inside out or squeezed flat, a vertex of it and the
    /// frame.
    Result<SourcePose> pose_at(size_t frame_index) const override;
    std::vector<Mat3> set_of(std::span<const Vec3> position, std::span<const Mat3> turn) const;

    SourceStrain strain_ = SourceStrain::all_is_rest;
    std::vector<uint8_t> is_told_;  // that it must be sound           (n_fragments)
    std::vector<Triangle> triangles_;
    std::vector<Tie> tie_;                // (n_pool_vertices)
    std::vector<uint32_t> sample_begin_;  // (n_fragments + 1)
    std::vector<Sample> sample_;
    std::vector<Vec3> rest_center_;  // of the fragments, placed            (n_fragments), m
    std::vector<double> mass_;       // kg
    std::vector<uint32_t> ring_offset_;
    std::vector<ParticleId> ring_member_;
};

}  // namespace sunder
