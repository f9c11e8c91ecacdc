// Forces that differ from place to place.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "solver/scene/scene.h"

namespace sunder {

/// How strong something is at a distance: it grows evenly to 1 at `radius`, and from there goes as (radius /
/// r)^exponent.
struct Falloff {
    double radius = 1;      // m, > 0
    double exponent = 2;    // >= 0
    double reach = kNever;  // nothing beyond, m
    double at(double distance) const;
};

/// What keeps a blast off: nothing; colliders and rigid bodies; fragments, too.
enum class Shadow { none, solids, all };

/// Velocities that everything is given at once, at the start of a frame, away from the centre. `Falloff` is a factor on
/// `speed`; what pins hold is given none.
struct Blast {
    Vec3 center = Vec3::Zero();
    Falloff falloff = {};
    double speed = 0;                // at the falloff's radius, m/s
    double energy = 0;               // above 0: speed is such that at rest all would have this, J
    Vec3 direction = Vec3::UnitZ();  // of its cone, unit
    double least_cosine = -2;        // of the angle to it; below -1: all around
    Shadow shadow = Shadow::none;
};

/// Away from the centre, or towards it where `strength` is negative.
struct PointField {
    Vec3 center = Vec3::Zero();
    Falloff falloff = {};
    double strength = 0;  // at the falloff's radius, m/s2
};

/// Round an axis, right-handed; the falloff goes by the distance from it.
struct VortexField {
    Vec3 center = Vec3::Zero(), axis = Vec3::UnitZ();  // unit
    Falloff falloff = {};
    double swirl = 0, inflow = 0,
           lift = 0;  // round it, towards it and along it at the radius; in it the lift is as large
};

/// Eddies without divergence (curl_noise.h).
struct TurbulenceField {
    double strength = 0;  // root mean square
    double size = 1;      // of the largest eddies, m, > 0
    double time = 0;      // at whole numbers they are others
    int octaves = 1;      // >= 1
    uint32_t seed = 0;
    Vec3 center = Vec3::Zero();  // there are none farther away than
    double reach = kNever;       // m
};

/// Draws the fragments of a body to a pose, each as a spring does that neither swings nor creeps.
struct Guide {
    DrivenPose pose = {};                                   // takes them there from the targets, over the frame
    double rate = 0;                                        // of the spring: it is there in a few times 1 / rate, 1/s
    std::shared_ptr<const std::vector<Pose>> targets = {};  // place and turn since rest, by fragment; null: at rest
};

/// Vectors at the nodes of a box.
struct VectorGrid {
    std::array<uint32_t, 3> nodes = {2, 2, 2};     // along x, y, z; >= 2
    Vec3 low = Vec3::Zero(), high = Vec3::Ones();  // its corners, m; high is above low
    std::vector<Vec3> values;                      // (nx, ny, nz), z fastest
};

/// Trilinear between the nodes, and nothing outside of the box.
struct GridField {
    std::shared_ptr<const VectorGrid> grid;
    uint64_t key = 0;  // equal for equal grids
};

/// Gas in the hollows of a body (pressure.h).
struct Pressure {
    std::shared_ptr<const std::vector<Vec3>>
        lining;           // area that each fragment has inside, as it rests in the scene, m2
    double area = 0;      // of all, m2
    double pressure = 0;  // of what is closed, Pa
    double vent = 1;      // share of the area
    uint64_t key = 0;     // equal for equal linings
};

struct Nothing {                          // in this frame
    std::optional<int> blast_frame = {};  // of a blast: the frame after which it goes off
};

struct LocalForce {
    using Kind = std::variant<Nothing, Blast, PointField, VortexField, TurbulenceField, Guide, GridField, Pressure>;
    std::string name;  // of its node
    uint64_t key = 0;  // equal for equal kinds
    Kind kind;
    double drag = 0;        // 1/s; above 0 a field is the velocity of a wind that drags so, else an acceleration
    std::string body = {};  // that it acts on; empty: on all, rigid bodies too
};

/// Whether it does anything in this frame.
bool acts(const Force& force);

}  // namespace sunder
