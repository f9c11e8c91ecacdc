// What runs through wires: finished, shared, const.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "fracture_tools/skin/surface_motion.h"
#include "fracture_tools/skin/vertex_motion.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "nodes/files/content_key.h"
#include "nodes/files/scene_time.h"
#include "nodes/graph/description.h"
#include "solver/data/fragment_set.h"
#include "solver/data/tri_mesh.h"
#include "solver/scene/scene.h"

namespace sunder {

/// What keeps some of a body's fragments, by their numbers in it, and whether its condition comes by the frame asked
/// for.
struct ActivationValue {
    ContentKey key = 0;  // of the activation
    Activation activation;
    bool comes = false;
    Pose object;                                               // at the frame
    std::shared_ptr<const SurfaceMotion> object_surface = {};  // of one that deforms
};

/// Some of a body's edges, by their numbers in it, and the factor on their toughness at the frame asked for.
struct SeamValue {
    ContentKey key = 0;  // of the seam
    Seam seam;
    double factor = 1;  // 0: they break, infinite: they cannot
};

/// An animation that carries a body along.
struct FollowValue {
    std::string name;
    ContentKey key = 0;                                 // of the motion of vertices
    std::shared_ptr<const VertexMotion> vertices = {};  // null: it moves as one
    std::shared_ptr<const SourcePose> pose = {};        // of what moves as one, at the frame asked for
    Vec3 center = Vec3::Zero();                         // of its mass at rest, m

    /// Of its fragments at a frame, which is that asked for where it moves as one.
    Result<std::shared_ptr<const SourcePose>> at_frame(int frame) const;
    Vec3 pivot() const;
};

/// What the fragments of a region have in place of their body's material, at the frame asked for.
struct RegionValue {
    Material material;
    double yield_factor = 1;  // of the yield in it, that groups start with
};

/// Fragments with a place, a start and, at the frame asked for, a material.
struct BodyValue {
    std::string name;    // of the body node; tells bodies of one scene apart
    ContentKey key = 0;  // of all below but `material`
    std::shared_ptr<const FragmentSet> fragments;
    std::shared_ptr<const SimulationMesh> rest;  // as placed: particle i is fragment i
    Pose pose;                                   // fragment coordinates -> scene, at the start
    Vec3 velocity = Vec3::Zero();                // m/s, at the start
    Vec3 angular_velocity = Vec3::Zero();        // rad/s, at the start, about the centre of mass
    bool settles = false;                        // before the start
    Material material;                           // at the frame
    bool energy_is_automatic = false;            // its fracture energy goes with toughness and stiffness
    std::vector<ActivationValue> activations;    // of `activate` nodes, in their order
    std::vector<SeamValue> seams;                // of `seam` nodes, in their order
    std::shared_ptr<const FollowValue> follows;  // or null
    std::vector<uint32_t> region;                // of each fragment, which of `regions` from 1 on, or 0; empty: all 0
    std::vector<RegionValue> regions;            // of `body_region` nodes
    std::vector<std::string> warnings;           // of these
};

/// Those of bodies, then those of their regions: as FrameInput::materials.
inline std::vector<Material> materials_of(std::span<const std::shared_ptr<const BodyValue>> bodies) {
    std::vector<Material> materials;
    for (const auto& body : bodies) materials.push_back(body->material);
    for (const auto& body : bodies)
        for (const RegionValue& region : body->regions) materials.push_back(region.material);
    return materials;
}

/// A collider and where it is at the frame asked for.
struct ColliderValue {
    Collider collider;
    Pose pose;
    std::vector<std::string> warnings = {};             // of what was done to its mesh
    std::shared_ptr<const SurfaceMotion> surface = {};  // of a mesh that deforms: it is where this says
};

/// Particles of one body that are held, and where they are held at the frame asked for.
struct PinValue {
    std::string name;
    std::string body;                                        // BodyValue::name
    ContentKey body_key = 0;                                 // BodyValue::key
    std::shared_ptr<const std::vector<uint32_t>> particles;  // of that body, ascending
    Pose pose;                                               // rest placement in the scene -> where it is held
    Vec3 pivot = Vec3::Zero();                               // of its turns, in the rest placement, m
    bool active = true;                                      // false once it has let go
    bool turns_freely = false;                               // their positions alone are held
    bool releases = false;                                   // at a frame
    double grip = 1, release_time = 0;                       // as Grip
    std::shared_ptr<const FragmentMotion> motion = {};       // of what goes with a mesh, in place of `pose`
};

/// The factors of their seams: as FrameInput::seams.
inline std::vector<double> seams_of(std::span<const std::shared_ptr<const BodyValue>> bodies) {
    std::vector<double> factors;
    for (const auto& body : bodies)
        for (const SeamValue& seam : body->seams) factors.push_back(seam.factor);
    return factors;
}

/// A frame of a simulation with the scene that its arrays index: scene->rest tells body and fragment of each particle
/// and the particles of each edge, scene->bodies the ranges of each body.
struct StateValue {
    double frame = 0;
    SceneTime at;  // in simulated time
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<const FrameState> state;
    std::vector<ContentKey> body_keys = {};                     // BodyValue::key of each of scene->bodies
    std::vector<std::shared_ptr<const BodyValue>> bodies = {};  // scene->bodies as they are then; of a file none
    StepReport report = {};                  // of the step that ended in this frame; zeros at the start
    std::vector<std::string> warnings = {};  // of what the method leaves out, of settling, of blasts
    std::vector<std::shared_ptr<const VertexMotion>> motions = {};  // of scene->bodies that follow a mesh; else null
    // Where accelerations are asked for, else null and 0: of each particle's piece, and how fast the time scale grows,
    // 1/s
    std::shared_ptr<const std::vector<PieceMotion>> pieces = {};
    double scale_rate = 0;
    std::vector<BrokenEdge> broken = {};  // of a solver: since the frame before, in all simulated frames that end here
    std::shared_ptr<const FrameState> kept = {};  // of a solver: its latest grid point up to here; most often `state`
};

/// The visual mesh of one body at one frame.
struct BodyMesh {
    std::string body;                              // BodyValue::name
    std::shared_ptr<const FragmentSet> fragments;  // material names, interior material
    VisualMesh mesh;
};

/// One file to write: what a bake node asks of the bake runner, which alone writes.
struct BakeItem {
    std::string path;                         // relative to the output folder, the frame filled in; ends in
                                              // kCompressedSuffix where the file is to be compressed
    std::shared_ptr<const BodyMesh> mesh;     // either this
    std::shared_ptr<const StateValue> state;  // or this
};

/// In the order of SocketType.
using Value =
    std::variant<std::shared_ptr<const TriMesh>, std::shared_ptr<const FragmentSet>, std::shared_ptr<const BodyValue>,
                 std::shared_ptr<const RigidBody>, std::shared_ptr<const ColliderValue>,
                 std::shared_ptr<const PinValue>, std::shared_ptr<const Force>, std::shared_ptr<const StateValue>,
                 std::shared_ptr<const BodyMesh>, std::shared_ptr<const BakeItem>>;

template <class T>
Value make_value(T content) {
    return std::make_shared<const T>(std::move(content));
}

inline SocketType type_of(const Value& value) { return static_cast<SocketType>(value.index()); }

}  // namespace sunder
