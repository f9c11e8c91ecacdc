// The artist's mesh at run time: skinned to the particles, watertight until it tears (Choi 2014, section 4).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/shared_array.h"
#include "solver/data/fragment_set.h"
#include "solver/data/math.h"
#include "solver/data/result.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

struct SkinBinding;
struct SourceMoment;
class VertexMotion;

/// A layer of a frame, as MeshLayer. Where a break surface meets the outer one its vertices have what that has.
struct VisualLayer : LayerId {
    SharedArray<float> values;  // a row each vertex, corner or triangle

    size_t n_rows() const { return values.size() / width; }
    const float* row(size_t i) const { return values.data() + i * width; }
};

/// Which faces and vertices a visual mesh has.
enum class VisualTopology {
    compact,   // what can be seen: grows as the body tears (Choi 2014, section 4.1)
    constant,  // every face of every fragment, in the same order in every frame (section 4.2)
};

/// A frame of one body. Copies are cheap: frames share what did not change between them.
///
/// Compact: two faces share a vertex exactly when the surface is joined there, so edges balance (each directed edge has
/// its opposite) before and after every break.
///
/// Constant: each fragment is closed by index and shares no vertex with another; the instances of a vertex at several
/// fragments have equal bits as long as they are connected there. Both sides of an interface that holds lie on one
/// another inside of the body and are marked as hidden. They are not collapsed: vertices at the rim serve outer faces
/// too, and a face that grew from nothing within a frame would streak where a renderer or a cache interpolates.
struct VisualMesh {
    SharedArray<Vec3f> positions;             // (n_vertices x 3), m, world
    SharedArray<Triangle> triangles;          // (n_triangles x 3), counter-clockwise from outside
    SharedArray<Vec3f> corner_normals;        // (3 n_triangles x 3), unit; smooth outside, sharp at break surfaces
    SharedArray<Vec2f> corner_uvs;            // (3 n_triangles x 2), or empty
    SharedArray<Color> corner_colors;         // (3 n_triangles), or empty; white on break surfaces
    SharedArray<float> corner_rim;            // (3 n_triangles), or empty: FragmentSet::interface_corner_rim, 0 outside
    std::vector<VisualLayer> layers;          // what else the artist's mesh has: FragmentSet::outer_layers
    SharedArray<int32_t> triangle_interface;  // (n_triangles), into FragmentSet::interfaces; -1 on the outer surface
    SharedArray<int32_t> triangle_material;   // (n_triangles); FragmentSet::interior_material on break surfaces
    SharedArray<uint32_t> triangle_fragment;  // (n_triangles), whose surface it is
    SharedArray<uint8_t> triangle_hidden;     // (n_triangles), 1 until the interface breaks; empty if compact
    SharedArray<uint32_t> vertex_fragment;    // (n_vertices), fragment that the vertex follows first (nearest particle)
    SharedArray<Vec3f> velocities;            // (n_vertices x 3), m/s, d/dt of positions; empty if the frame tells none
    SharedArray<Vec3f> accelerations;         // (n_vertices x 3), m/s2, d/dt of velocities; likewise
    SharedArray<Vec3f> rest_positions;        // (n_vertices x 3), m, before the body was placed; of meshes from files,
                                              // may be empty: others have `skin`, which tells the pool's vertices
    std::shared_ptr<const SkinBinding> skin;  // what moves the vertices (skinning.h); the same until an edge breaks
};

/// How a piece that hangs together moves as a whole, in simulated time: steadily turning about a centre that flies.
/// How it deforms besides is left out, for what a state tells of that is velocities of half a substep before, which
/// would count twice over (Coriolis).
struct PieceMotion {
    Vec3 centre = Vec3::Zero(), velocity = Vec3::Zero(), acceleration = Vec3::Zero();  // m, m/s, m/s2
    Vec3 spin = Vec3::Zero();                                                          // rad/s
    double velocity_lag = 0;  // how long before the frame a state's velocities are those of, s

    Vec3 velocity_at(const Vec3& position) const { return velocity + spin.cross(position - centre); }
    Vec3 acceleration_at(const Vec3& position) const {
        return acceleration + spin.cross(spin.cross(position - centre));
    }
};

/// How fast simulated time runs in a frame.
struct ShownTime {
    double scale = 1;
    double scale_rate = 0;  // 1/s
};

/// What the skinning reads of one body at one frame; arrays are the body's slice of a FrameState.
struct BodyFrame {
    std::span<const Vec3> position;               // (n_fragments x 3), m
    std::span<const Quat> orientation;            // (n_fragments x 4)
    std::span<const Mat3> plastic_deformation;    // (n_fragments x 3 x 3), in the rest axes that `rest` has
    std::span<const uint8_t> edge_intact;         // (n_edges of the body)
    std::span<const Vec3> velocity = {};          // (n_fragments x 3), m/s; may be left out together with the next
    std::span<const Vec3> angular_velocity = {};  // (n_fragments x 3), rad/s, world
    const SourceMoment* source = nullptr;         // of a body that follows a mesh
    std::span<const PieceMotion> piece = {};      // (n_fragments), of each one's piece; empty: no accelerations
    ShownTime time = {};                          // by which velocities were scaled; they catch up if there are pieces
};

/// Keeps the split topology of one body between frames. Frames may be asked for in any order: topology is a function
/// of `edge_intact` alone, and is rebuilt only where that differs from the frame before. Vertices and normals are
/// worked out again only where particles moved; a body at rest gives the arrays of the frame before. A frame's arrays
/// stay as they are for as long as someone holds them; memory of those that nobody holds is written over.
class VisualMeshBuilder {
public:
    /// `rest` is the body's simulation mesh as placed in the scene (its slice alone, particle i = fragment i);
    /// `pose` is where the body was placed (fragment coordinates -> `rest` coordinates).
    /// `motion`: of a body that follows a mesh (source_skin.h), each frame of which then tells until when it did.
    VisualMeshBuilder(std::shared_ptr<const FragmentSet> fragments, const SimulationMesh& rest, const Pose& pose,
                      VisualTopology topology = VisualTopology::compact,
                      std::shared_ptr<const VertexMotion> motion = nullptr);
    ~VisualMeshBuilder();

    /// `run` may use threads; it changes no bit.
    Result<VisualMesh> build(const BodyFrame& frame, const RangeRunner& run = run_serially);

    /// Vertices that the mesh will have once all is torn: what a frame costs grows with it.
    size_t size() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A body of a scene at a frame.
struct MovingBody {
    VisualMeshBuilder* builder;  // no other body's
    BodyFrame frame;
    VisualMesh* mesh;  // replaced as soon as it is made; what the one before held alone serves bodies that follow
};

/// Makes the meshes of the bodies of a scene. Bit for bit what `build` gives each; sooner on several threads, for they
/// go from body to body instead of through each one together. Gives a status for each body: one that fails (as `build`
/// does, or out of memory) keeps the mesh it had, and the others are made.
std::vector<Status> build_meshes(std::span<const MovingBody> bodies, const RangeRunner& run);

}  // namespace sunder
