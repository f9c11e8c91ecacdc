// What is simulated: bodies of oriented particles, pins, colliders, rigid bodies, and what moves them.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/data/moving_surface.h"
#include "solver/data/result.h"
#include "solver/data/signed_distance_grid.h"
#include "solver/data/simulation_mesh.h"
#include "solver/data/source_pose.h"
#include "solver/data/thin_fragments.h"

namespace sunder {

constexpr double kNever = std::numeric_limits<double>::infinity();  // a yield or toughness that is never reached

/// How a body resists, flows and breaks. Strains are principal logarithmic ones.
struct Material {
    double youngs_modulus = 2e5;            // Pa, > 0
    double poisson_ratio = 0.0;             // 0 .. 0.45
    double damping_time = 2e-3;             // s, 0 .. 1: Kelvin and Voigt's (Rayleigh's beta)
    double yield = kNever;                  // deviatoric strain at which plastic flow starts, > 0
    double flow_rate = 30;                  // 1/s, >= 0: share of the excess strain that flows per second
    double hardening = 0;                   // growth of yield per plastic strain, >= 0
    double toughness = kNever;              // tensile strain at which a group breaks, > 0
    double compressive_toughness = kNever;  // the same for compression; never by default
    double fracture_energy = kNever;        // J/m2, >= 0: edges fade by it; never: groups break at once, as the paper's
    double stiffness = 1.0;                 // k of method gauss_seidel, 0 .. 1 (the paper's)
    double friction = 0.5;                  // Coulomb, >= 0
    double restitution = 0.0;               // 0 .. 1
    bool curvature = true;                  // groups one fragment thick bend by their curvature (bending_shape.h)
    int slender = 0;                        // 1: and those of bars and thick plates, a few fragments through; 2: all

    Status check(const std::string& where) const;
};

/// What a particle makes of its body's material. Its yield is in the state.
inline Material material_of(const SimulationMesh& rest, ParticleIndex particle, const Material& body) {
    Material own = body;
    if (rest.toughness_factor.empty()) return own;
    own.toughness *= rest.toughness_factor[particle];
    own.compressive_toughness *= rest.toughness_factor[particle];
    return own;
}

/// kThin or kSlender where a fragment that lies so (SimulationMesh::thin) bends by its curvature, else 0: as a block.
inline uint8_t bending_kind(uint8_t lies, const Material& body) {
    if (!body.curvature) return 0;
    if (lies == kThin) return kThin;
    return (lies == kSlender && body.slender > 0) || (lies == kThick && body.slender == 2) ? kSlender : 0;
}

struct Body {
    std::string name;
    uint32_t particle_begin = 0, particle_end = 0;  // its range in the scene's SimulationMesh
    uint32_t edge_begin = 0, edge_end = 0;
    Vec3 velocity = Vec3::Zero();          // at the start, m/s
    Vec3 angular_velocity = Vec3::Zero();  // at the start, about the body's centre of mass, rad/s
    bool settles = false;                  // before the start (solver/settling.h)
};

/// Particles held and moved: particle -> pose * (its rest placement), the pose being given per frame, one for all of
/// them or each its own.
struct Pin {
    std::string name;
    std::vector<ParticleId> particles;  // ascending
    bool turns_freely = false;          // their positions alone are held, as by a hinge (method projective)
    bool releases = false;              // at a frame
};

enum class ShapeKind { plane, sphere, box, capsule, mesh };

/// A solid in its own frame: plane z <= 0; sphere of `radius`; box of `half_extents`; capsule along z,
/// `radius` around the segment |z| <= half_height; mesh where `grid` is negative, or, where it deforms, what `surface`
/// bounds at `share` of the frame.
struct Shape {
    ShapeKind kind = ShapeKind::sphere;
    double radius = 0.5;                       // m, > 0
    Vec3 half_extents = Vec3::Constant(0.5);   // m, > 0
    double half_height = 0.5;                  // m, > 0
    const SignedDistanceGrid* grid = nullptr;  // of a mesh: its Collider owns it
    const MovingSurface* surface = nullptr;    // of one that deforms, in place of a grid: its DrivenPose owns it
    double share = 0;                          // of its way
};

/// Moves as it is told, is pushed by nothing.
struct Collider {
    std::string name;
    Shape shape;
    double friction = 0.5, restitution = 0.0;
    std::shared_ptr<const SignedDistanceGrid> grid = {};  // what shape.grid points to
    std::shared_ptr<const SurfaceTree> tree = {};         // of a mesh that deforms, in place of a grid
};

/// Pushes and is pushed with its mass. Sphere or box.
struct RigidBody {
    std::string name;
    Shape shape;
    double mass = 1;  // kg, > 0
    Pose pose;        // at the start
    Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
    double friction = 0.5, restitution = 0.0;
    bool settles = false;  // before the start (solver/settling.h)
};

enum class Keeps : uint8_t {
    held,    // does not move, and is there to be hit
    asleep,  // held, and lets go with all of its piece that is asleep; at a touch in any case
    glued    // edges of it cannot break
};
enum class Until : uint8_t {
    frame,
    object,    // it comes over the fragment
    contact,   // of other pieces, rigid bodies or moving colliders
    neighbour  // an edge of the fragment or of one beside it breaks
};

/// Fragments that are kept from moving, or their edges from breaking, until a condition comes for each. No two that
/// hold (or sleep) have a fragment in common, nor have two that glue.
struct Activation {
    std::string name;
    Keeps keeps = Keeps::held;
    Until until = Until::frame;
    std::vector<ParticleId> particles;  // ascending
    double impulse = 0;                 // that a contact has to exceed, N s; 0: any will do
    double delay = 0;                   // from the object's touch on, s
    double growth = 0;                  // how fast it spreads from what was touched, m/s; 0: it does not
    double falloff = 0;                 // how far beyond the object it reaches, m: there for no fragment, at 0 for all
    Shape object = {};
    std::shared_ptr<const SignedDistanceGrid> grid = {};  // what object.grid points to
    std::shared_ptr<const SurfaceTree> tree = {};         // as Collider::tree
};

/// Edges that are told when to break.
struct Seam {
    std::string name;
    std::vector<EdgeId> edges;  // ascending
};

/// Fragments of a body whose motion is given: they follow it for as long as an activation holds them or lets them
/// sleep.
struct Source {
    std::string name;
    std::vector<ParticleId> particles;             // ascending
    std::shared_ptr<const SourcePose> start = {};  // at the start
};

struct Scene {
    SimulationMesh rest;  // all bodies, one after the other, each as placed at the start
    std::vector<Body> bodies;
    std::vector<Pin> pins;
    std::vector<Collider> colliders;
    std::vector<RigidBody> rigid_bodies;
    std::vector<uint32_t> region_bodies = {};  // whose regions have the materials after those of bodies
    std::vector<Activation> activations = {};
    std::vector<Seam> seams = {};
    std::vector<Source> sources = {};
};

struct LocalForce;  // local_force.h

/// Wind drags particles towards its velocity: acceleration = drag * (velocity - v), drag in 1/s (0: no wind).
/// An acceleration field adds to gravity.
struct Force {
    Vec3 acceleration = Vec3::Zero();              // m/s2
    Vec3 wind = Vec3::Zero();                      // m/s
    double drag = 0;                               // 1/s, >= 0
    std::shared_ptr<const LocalForce> local = {};  // what differs from place to place, or null
};

/// How firmly a pin holds over one frame: 1 rigidly; below, as a spring that slackens until it is gone at 0.
struct Grip {
    double begin = 1, end = 1;  // 0 .. 1
    double time = 0;            // that it takes to let go, s
    bool is_rigid() const { return begin == 1 && end == 1; }
};

/// How the surface of a collider deforms over one frame. The poses are those of the surface's whole.
struct SurfaceDrive {
    std::shared_ptr<const MovingSurface> surface = {};  // or null
    double begin = 0, end = 1;                          // shares of its way
    bool operator==(const SurfaceDrive&) const = default;
};

/// A driven pose over one frame. Between the two the orientation turns steadily (slerp) and the pivot moves along a
/// straight line: what turns about it goes round in circles.
struct DrivenPose {
    Pose begin, end;
    bool active = true;         // an inactive pin lets go, an inactive collider is not there
    Vec3 pivot = Vec3::Zero();  // before the pose is applied, m
    Grip grip = {};             // of an active pin
    SurfaceDrive surface = {};  // of a collider whose mesh deforms
};

/// How far its surface deforms within its whole, at most, m.
inline double deformation_of(const DrivenPose& drive) {
    const SurfaceDrive& s = drive.surface;
    return s.surface ? (s.end - s.begin) * s.surface->longest : 0.0;
}

/// Of a collider that deforms: all of the way of its surface.
inline DrivenPose drive_of(std::shared_ptr<const MovingSurface> surface) {
    DrivenPose drive{{}, surface->whole, true, surface->pivot};
    drive.surface.surface = std::move(surface);
    return drive;
}

/// Everything animated, for the frame that is about to be simulated.
struct FrameInput {
    double duration = 1.0 / 24;        // s, > 0
    Vec3 gravity = Vec3(0, 0, -9.81);  // m/s2
    std::vector<Force> forces;
    std::vector<Material> materials;         // one a body, then one a region of Scene::region_bodies
    std::vector<DrivenPose> pins;            // one a pin; identity leaves it at rest
    std::vector<DrivenPose> colliders;       // one a collider
    std::vector<double> yield_changes = {};  // one a material: what yields are multiplied by; empty: by 1
    struct ActivationDrive {
        bool comes = false;  // the frame until which it keeps
        DrivenPose object = {};
    };
    std::vector<ActivationDrive> activations = {};  // one an activation
    std::vector<double> seams = {};  // one a seam: factor on toughness; 0: it breaks, infinite: it cannot
    struct SourceDrive {
        std::shared_ptr<const SourcePose> begin, end;
        Vec3 pivot = Vec3::Zero();  // of the whole, in its rest placement, m
        bool goes_on = true;        // false: the source stands in this frame, for it tells of no later one
    };
    std::vector<SourceDrive> sources = {};      // one a source
    std::vector<SourceDrive> pin_sources = {};  // one a pin, or none at all; without a begin: all of it moves as one

    /// Of a pin whose particles move each for itself, or null.
    const SourceDrive* pin_source(size_t pin) const {
        return pin < pin_sources.size() && pin_sources[pin].begin ? &pin_sources[pin] : nullptr;
    }
};

enum class Method {
    projective,  // implicit Euler by Newton steps over all groups at once; stiffness in Pa (docs/theory.md)
    jacobi,      // the same equations by over-relaxed averaging sweeps: cheap for soft bodies, too soft for stiff ones
    gauss_seidel,  // the paper's: sequential projection with k in [0, 1]; for comparison
};

struct SolverSettings {
    Method method = Method::projective;
    int substeps = 8;                  // per frame, 1 .. 1000
    int iterations = 2;                // sweeps per substep, 1 .. 1000
    int crack_passes = 4;              // how often in a substep a hit may break things, 1 .. 64 (Substep::break_in_hit)
    int hit_substeps = 16;             // most parts of a substep with a hit that may break, 1 .. 256 (projective)
    double error_budget = 0;           // 0 .. 1; above 0 the solver chooses substeps and iterations (error_budget.h)
    double over_relaxation = 1.5;      // 0.1 .. 1.9; at most 1 with one iteration, 1.58 with three
    double damping = 0;                // 1/s, >= 0: velocities decay as exp(-damping t)
    double depenetration_speed = 1.0;  // m/s, > 0: fastest push apart of what overlapped already
    bool self_collision = true;        // particles of one body against one another
    bool sleeping = true;              // what rests is left out until something wakes it (sleeping.h)

    Status check(const std::string& where) const;
};

/// What happened in a frame; times are wall seconds of each stage.
struct StepReport {
    size_t edges_broken = 0, contacts = 0, n_components = 0;
    int substeps = 0, iterations = 0;  // that the frame took
    size_t asleep = 0;                 // particles and rigid bodies that sleep at the end of the frame
    size_t simulated = 0;              // particles and rigid bodies, summed over substeps: the work that was done
    double cracks_J = 0;               // elastic energy that edges that fade took
    double predict_s = 0, shape_s = 0, contact_s = 0, momentum_s = 0, fracture_s = 0;
};

}  // namespace sunder
