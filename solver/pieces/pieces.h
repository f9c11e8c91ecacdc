// What moves in a step as wholes: pieces, then rigid bodies.
#pragma once

#include <algorithm>
#include <vector>

#include "solver/contacts/solve/contact_round.h"
#include "solver/pieces/movables.h"
#include "solver/scene/live_topology.h"

namespace sunder {

struct Pieces {
    std::vector<PieceId> of;            // (n_movables)
    std::vector<double> held_share;     // ContactBodies::held_share (n_movables)
    std::vector<ContactPiece> whole;    // as contacts see it   (n_pieces + n_rigid_bodies)
    std::vector<PieceMotion> motion;    // zero between rounds                    (as whole)
    std::vector<PieceVelocity> change;  // what settling contacts gave it         (as whole)
    std::vector<uint8_t> is_touched;    // a contact may push it                  (as whole)
    std::vector<uint8_t> held;          // a particle of it is, or is tied        (n_pieces)
    std::vector<Vec3> angular;          // L that it must have                    (n_pieces)
};

inline ContactBodies bodies_of(const Movables& movables, const Pieces& pieces) {
    return {movables.inverse_mass, pieces.of,    movables.start_position, movables.start_rotation,
            movables.moving,       pieces.whole, pieces.held_share};
}

/// The piece of a movable thing, as edges are now.
inline PieceId piece_of(const LiveTopology& live, MovableIndex movable) {
    const size_t n = live.pieces().size();
    return movable < n ? live.piece(size_t{movable}) : PieceId(live.n_pieces() + (movable - n));
}

/// Calls body(i) for the particles of a piece, or for its rigid body.
template <class Body>
void for_movables(const LiveTopology& live, PieceId piece, const Body& body) {
    if (piece < live.n_pieces())
        std::ranges::for_each(live.piece_particles(piece), body);
    else
        body(MovableId(live.pieces().size() + piece - live.n_pieces()));
}

}  // namespace sunder
