// The skin of a body that follows a mesh: the artist's vertices while it does, and what they leave beside the skin's
// own afterwards.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/skin_motion.h"
#include "fracture_tools/skin/skinning.h"
#include "fracture_tools/skin/vertex_motion.h"
#include "solver/data/result.h"

namespace sunder {

/// Of a frame that is shown between two states, as some fragments follow in the first and are free in the second.
/// Views of the first state's slice of the body.
struct Leaving {
    std::vector<uint8_t> fragments;  // 1: these              (n_fragments)
    double begin = 0;                // frame of the first
    double share = 0;                // of the way to the second
    std::span<const Vec3> position;  // m
    std::span<const Quat> orientation;
    std::span<const Mat3> plastic_deformation;
    std::span<const uint8_t> edge_intact;
};

/// Until when each fragment followed, and when it is, in frames of the motion.
struct SourceMoment {
    double now = 0;
    std::vector<double> until;  // (n_fragments), infinite: it follows
    double frame_seconds = 1;   // s
    std::optional<Leaving> leaving = {};
};

/// Moves vertices from where the skin has them, s, to
///
///     x_v = s_v + sum over j that follow w_j (a_v - s_v) + sum over the others w_j R_j R_j(t_j)^T r_v(t_j),
///     r_v(t) = a_v(t) - s_v(t),
///
/// with a_v the artist's vertex and t_j the moment at which j was let go. So a vertex of which all that moves it
/// follows is the artist's; at t_j nothing jumps, and from then on what the skin leaves of a vertex is carried by the
/// fragments' turns. Vertices within have no a_v, and r_v = 0.
///
/// What is let go between two states is shown as all else between them, blended from the one to the other: at share u
/// of the way, R_j R_j(t_j)^T r_v(t_j) gives way to
///
///     R_j ((1 - u) R_j(t)^T (a_v(t) - s_v(t)) + u R_j(t_j)^T r_v(t_j)),
///
/// t being the first state's time, and s_v(t) where the skin has the vertex in that state: whatever was free by then.
class SourceSkin {
public:
    /// `intact`: the skin's weights of the whole body.
    SourceSkin(std::shared_ptr<const VertexMotion> motion, const SimulationMesh& rest,
               std::shared_ptr<const SkinBinding> intact);

    /// To be called before a frame is moved. Whether vertices move that no fragment does. Errors: as
    /// VertexMotion::at_frame.
    Result<bool> take(const SourceMoment& moment, std::span<const Quat> orientation,
                      std::span<const Vec3> angular_velocity, const SkinBinding& binding, const RangeRunner& run);

    /// Of some vertices of a chunk, just placed by the skin; velocities may be empty.
    void correct(const SkinBinding& binding, size_t chunk, std::span<const uint8_t> moved, std::span<Vec3> io_position,
                 std::span<Vec3> io_velocity) const;

private:
    struct Left {                     // of the moment at which some fragments were let go
        std::vector<Quat> turn;       // R_j                                  (n_fragments)
        std::vector<Vec3f> residual;  // r_v                                  (n_pool_vertices), m
    };
    Result<std::shared_ptr<const Left>> left_at(double frame);
    Status take_leaving(const Leaving& leaving, std::span<const Quat> turn, const SkinBinding& binding,
                        const RangeRunner& run);
    struct Carried {
        Vec3 shift, rate;  // m, m/s
    };
    Carried carried(uint32_t fragment, uint32_t pool_vertex, size_t vertex) const;

    std::shared_ptr<const VertexMotion> motion_;
    std::vector<Vec3> rest_position_;
    std::vector<Quat> rest_orientation_;
    ParticleTransforms transforms_;
    std::shared_ptr<const SkinBinding> intact_;
    size_t n_edges_;
    std::map<double, std::shared_ptr<const Left>> left_;

    std::vector<double> until_;                        // of the last call
    std::vector<Vec3> artist_, artist_velocity_;       // now                 (n_pool_vertices), m, m/s
    std::vector<std::shared_ptr<const Left>> let_go_;  // of each fragment; null: it follows
    std::vector<Mat3> turned_;                         // R_j R_j(t_j)^T      (n_fragments)
    std::vector<Vec3> spin_;                           // rad/s               (n_fragments), or empty
    double frame_seconds_ = 1;                         // s
    // Of fragments that are let go on the way that is shown; where none is, empty:
    std::vector<uint8_t> leaves_;      // which these are                     (n_fragments)
    std::vector<Mat3> turned_on_way_;  // R_j R_j(t)^T, of these              (n_fragments)
    std::vector<Vec3> former_;         // a_v(t) - s_v(t)                     (n_vertices of the binding), m
    double share_ = 0;
};

}  // namespace sunder
