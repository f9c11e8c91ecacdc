// Contacts of a step: what touches at its start, and what will before its end.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/collision/contact.h"
#include "solver/collision/pairs_between_pieces.h"
#include "solver/collision/piece_pairs.h"
#include "solver/collision/shape_distance.h"
#include "solver/data/role.h"

namespace sunder {

/// A shape that is moved from one pose to another during the step.
struct MovingShape {
    Shape shape;
    Pose begin, end;
    bool active = true;    // an inactive one is not there
    double end_share = 0;  // of a mesh that deforms: Shape::share at the end
};

/// Everything as it stands at the start of the step. Movables are particles, then rigid bodies. Velocities are what
/// things would do alone during the step (forces included).
struct DetectionInput {
    ParticleEllipsoids particles;               // (n_particles)
    std::span<const double> corners;            // by which they reach planes before their ellipsoids (n_particles), m
    std::span<const uint32_t> body;             // (n_particles), or empty: one body
    std::span<const Role> role;                 // (n_movables), or fewer; two that are not free give no contact
    std::span<const PieceId> piece;             // by first particle (n_particles), or empty: not known
    LiveRings rings;                            // particles near one another in it give no contact
    bool self_collision = true;                 // particles of one body against one another
    std::span<const PlacedShape> rigid_bodies;  // spheres or boxes (n_rigid_bodies)
    std::span<const Vec3> velocity;             // (n_movables), m/s
    std::span<const Vec3> angular_velocity;     // (n_movables), rad/s, world; or empty: nothing turns
    std::span<const MovingShape> colliders;     // (n_colliders)
    double duration = 0;                        // h, s
    double margin = 1e-3;                       // m, > 0: what is nearer counts as touching
    const WorkerPool* workers = nullptr;        // null: the calling thread alone
    // Contacts of a movable that is `fixed` with one that is not are found first; where `ends` says so of them, the
    // search ends, and what it gives are these.
    std::span<const uint8_t> fixed = {};  // (n_movables), or empty: the search never ends early
    std::function<bool(std::span<const Contact>)> ends = {};
    // What find_contacts works out once for all stages; or empty: each time that it is asked for.
    std::span<const double> turning;     // how far turning may carry the surface (n_movables), m
    std::span<const Sym3> support = {};  // support matrices (n_particles), m2
};

/// Memory of find_contacts. It never changes the result, only its cost.
struct ContactScratch {
    OverlapScratch overlaps;  // where pieces are not known,
    std::vector<Pair> pairs;  // that may touch
    PairsBetweenPieces between;
    PiecePairs within;
    std::vector<Aabb> boxes;      // (n_movables)
    std::vector<double> turning;  // (n_movables)
    std::vector<double> radius;   // (n_particles)
    std::vector<Sym3> support;    // (n_particles)
    std::vector<std::vector<Contact>> chunks;
    std::vector<Contact> found;
    std::vector<ContactId> order;  // of `found`
    std::vector<uint32_t> begin;   // where those of each movable begin in it

    /// Call when a state was set from outside.
    void reset() { between.reset(), within.reset(); }
    /// Call when particles were numbered anew (PiecePairs::renumber).
    void renumber(std::span<const ParticleId> former) { between.renumber(former), within.renumber(former); }
    /// Call when edges broke.
    void edges_broke() { between.edges_broke(), within.edges_broke(); }
};

/// All contacts, ascending by (a, b), points of one pair in the order of their features.
///
/// A pair gives a contact when it comes within reach (the margin, and what turning may add) before the step ends, the
/// relative motion taken as a straight line. A pair that is already within reach has the normal of its best
/// separating direction now; a pair that is not is advanced along that line to its first touch by planes that still
/// separate it (conservative advancement, Mirtich 1996), and gets the normal of that moment and the gap that the pair
/// has now along it: the side touched first, however far the step would carry it, and no contact for what passes by. A
/// point is given when its gap < approach speed * h + reach.
///
/// Independent of what `scratch` remembers: each candidate is decided from the present boxes and shapes alone.
void find_contacts(const DetectionInput& input, ContactScratch& scratch, std::vector<Contact>& out);

// The stages of find_contacts, each over a range that its caller chooses; ranges put together in order give the same.

/// Boxes that hold movables [begin, end) through the whole step, with half of the reach, as seen by who moves at
/// `frame` (m/s); writes io_boxes[begin, end).
void sweep_boxes(const DetectionInput& input, const Vec3& frame, size_t begin, size_t end, std::span<Aabb> io_boxes);

/// Appends the contacts of pairs of movables, each (lower, higher): a particle stands before a rigid body. `boxes` from
/// sweep_boxes.
void contacts_of_pairs(const DetectionInput& input, std::span<const Aabb> boxes, std::span<const Pair> pairs,
                       std::vector<Contact>& out);

/// Appends the contacts of movables [begin, end) with all active colliders.
void contacts_with_colliders(const DetectionInput& input, size_t begin, size_t end, std::vector<Contact>& out);

}  // namespace sunder
