#include "solver/step/slice.h"

#include <algorithm>
#include <utility>

#include "solver/step/loops.h"

namespace sunder {

void begin_again(ContactProblem& problem, Pieces& pieces, Slice& slice) {
    std::swap(problem.contacts, slice.former_contacts), std::swap(pieces, slice.former_pieces);
}

void keep_what_is_whole(const StepContext& context, std::span<const ParticleId> weakened, const ContactIslands& islands,
                        const Pieces& pieces, Slice& slice) {
    std::vector<uint8_t> again(pieces.whole.size(), 0);  // by pieces before the cuts, as `pieces` still has them
    for (const ParticleId i : weakened) again[pieces.of[i]] = 1;
    for (IslandId island(0); island < islands.size(); ++island) {
        const auto its = islands.pieces_of(island);
        if (std::ranges::any_of(its, [&](PieceId p) { return again[p] != 0; }))
            for (const PieceId p : its) again[p] = 1;
    }
    for_all(context, slice.kept.size(), [&](size_t i) { slice.kept[i] = !again[pieces.of[i]]; });
}

void take_over_pieces(const StepContext& context, const LiveTopology& live, const Slice& slice, Pieces& pieces) {
    const Pieces& former = slice.former_pieces;
    for_all(context, slice.kept.size(), [&](size_t i) {
        if (!slice.kept[i]) return;
        pieces.held_share[i] = former.held_share[i];
        if (i < context.n_particles() && live.piece_particles(pieces.of[i]).front() != i) return;
        pieces.whole[pieces.of[i]] = former.whole[former.of[i]];
        pieces.change[pieces.of[i]] = former.change[former.of[i]];
    });
}

void take_over_contacts(const Slice& slice, std::vector<ActiveContact>& contacts) {
    const auto pair_of = [](const ActiveContact& c) { return std::pair(c.contact.a, c.contact.b); };
    auto former = slice.former_contacts.begin();
    for (ActiveContact& c : contacts) {
        if (!slice.kept[c.contact.a]) continue;
        while (former != slice.former_contacts.end() && pair_of(*former) < pair_of(c)) ++former;
        if (former != slice.former_contacts.end() && pair_of(*former) == pair_of(c)) c = *former++;
    }
}

bool let_go_of_mixed_islands(const LiveTopology& live, const ContactIslands& islands, Slice& slice) {
    bool any = false;
    for (IslandId island(0); island < islands.size(); ++island) {
        const auto movables = islands.movables_of(island);
        const auto is_kept = [&](MovableId i) { return slice.kept[i] != 0; };
        if (std::ranges::all_of(movables, is_kept) || std::ranges::none_of(movables, is_kept)) continue;
        any = true;
        for (const PieceId piece : islands.pieces_of(island))
            for_movables(live, piece, [&](MovableId i) { slice.kept[i] = 0; });
    }
    return any;
}

}  // namespace sunder
