#include "solver/matching/step_limit.h"

#include <algorithm>

#include "solver/data/math_functions.h"

namespace sunder {

void StepLimit::add(PieceId piece, double cosine) {
    const double turn = 2 * math::acos(cosine);
    if (!(turn > kMostTurn)) return;
    const double share = kMostTurn / turn;
    for (Piece& known : short_)
        if (known.piece == piece) {
            known.share = std::min(known.share, share);
            return;
        }
    short_.push_back({piece, share});
}

double StepLimit::share(PieceId piece) const {
    for (const Piece& known : short_)
        if (known.piece == piece) return known.share;
    return 1;
}

}  // namespace sunder
