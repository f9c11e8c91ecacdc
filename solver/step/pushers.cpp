#include "solver/step/pushers.h"

#include <vector>

#include "solver/pieces/pieces.h"

namespace sunder {
namespace {

Pusher named(size_t n_particles, MovableId thing) {
    if (thing.is_none()) return {};
    if (thing & Contact::kStatic) return {Pusher::Kind::collider, thing & ~Contact::kStatic};
    if (thing < n_particles) return {Pusher::Kind::particle, thing};
    return {Pusher::Kind::rigid_body, static_cast<uint32_t>(thing - n_particles)};
}

}  // namespace

void name_pushers(const SimulationMesh& rest, const LiveTopology& live, std::span<const ActiveContact> contacts,
                  std::span<BrokenEdge> io_cuts) {
    if (io_cuts.empty() || contacts.empty()) return;
    struct Pressing {
        double impulse = 0;  // kg m
        MovableId by;
    };
    std::vector<Pressing> hardest(live.n_pieces());
    const auto press = [&](PieceId piece, MovableId by, double impulse) {
        if (piece < hardest.size() && impulse > hardest[piece].impulse) hardest[piece] = {impulse, by};
    };
    for (const ActiveContact& c : contacts) {
        if (!(c.impulse.normal > 0)) continue;
        const MovableId a = c.contact.a, b = c.contact.b;
        const bool is_static = (b & Contact::kStatic) != 0;
        const PieceId piece_a = piece_of(live, a), piece_b = is_static ? PieceId::none() : piece_of(live, b);
        if (piece_a == piece_b) continue;  // within a piece
        press(piece_a, b, c.impulse.normal);
        press(piece_b, a, c.impulse.normal);
    }
    for (BrokenEdge& cut : io_cuts) cut.by = named(rest.n_particles(), hardest[live.piece(rest.edges[cut.edge].a)].by);
}

}  // namespace sunder
