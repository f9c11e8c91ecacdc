#include "solver/pieces/push_division.h"

#include <algorithm>
#include <cmath>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/data/thin_fragments.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// What a particle gives, over what it would between neighbours that are held: 1.5 inside a lattice, about 3 at a face,
// more at edges and corners.
constexpr double kGive = 3;
// What a load stands on gives way to the last round by so much more, where pins hold it: what is pushed together gives
// more than alone, and what does not give is the load, which stays lifted by it.
constexpr double kUnderLoads = 3;
// The share of a push across a sheet, which is held chi times softer than along it: what bends gives way as far as
// bending waves run, b^(-1/2); a push deeper than the sheet is thick meets it as a membrane, and takes the share of a
// block. By the first alone hits create energy (a sheet flew apart at 60 m/s), by the second sheets tremble at rest.
double share_across(const BendingShape& sheet, double pulls, double give, double membrane, double way) {
    const double chi = sheet.softness.minCoeff(), deep = way * way / sheet.reach2;
    return (chi * std::min(1.0, give / std::sqrt(1 + pulls)) + deep * membrane) / (chi + deep);
}

}  // namespace

void divide_pushes(const StepContext& context, double h, bool last, const LiveModel& model,
                   const ContactProblem& problem, IslandId island, Pieces& pieces) {
    SUNDER_ASSERT(h > 0 && island < problem.islands.size());
    for (const PieceId piece : problem.islands.pieces_of(island)) pieces.whole[piece].own_share = last ? 1 : 0;
    double approach = 0;  // of the fastest that meets a sheet, m/s
    for (size_t k = 0; !model.thin.empty() && k < problem.islands.contacts_of(island).size(); ++k)
        approach = std::max(approach, problem.contacts[problem.islands.contacts_of(island)[k]].approach_speed);
    for (const MovableId i : problem.islands.movables_of(island)) {
        double share = 1;
        ContactPiece& p = pieces.whole[pieces.of[i]];
        const bool bends = model.bends(i.value), is_thin = bends && model.thin[i.value] == kThin;
        const bool gives_freely = !last && !is_unbroken(p.kind) && (is_thin || !p.is_held());
        if (!p.rigid && context.settings.method != Method::gauss_seidel && !gives_freely) {
            const double pulls = sum_of_pulls(model, h, i.value),
                         b = bends ? pulls / model.bending.softness(i.value) : pulls;
            const double n = last ? 1 : static_cast<double>(model.live.piece_particles(pieces.of[i]).size());
            const double reach = std::max(1.0, std::min(waves_in_step(1 + b), math::cbrt(n)));
            const double give = last && p.is_held() && problem.loads.how[island] == StandingLoads::How::together
                                    ? kUnderLoads * kGive
                                    : kGive;
            share = std::min(1.0, give * reach / (1 + b));
            if (is_thin) share = share_across(model.bending.shape(i.value), pulls, give, share, approach * h);
        }
        pieces.held_share[i] = share;
        p.own_share = last ? std::min(p.own_share, share) : std::max(p.own_share, share);
    }
    // Nothing moves what is held as a whole: before a sweep each particle of a torn one gives by itself.
    for (const MovableId i : problem.islands.movables_of(island)) {
        const ContactPiece& p = pieces.whole[pieces.of[i]];
        if (last || is_unbroken(p.kind)) pieces.held_share[i] = p.own_share;
    }
}

}  // namespace sunder
