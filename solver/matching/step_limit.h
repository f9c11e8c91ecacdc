// A bound on how far one Newton step may go.
#pragma once

#include <cstdint>
#include <vector>

#include "solver/data/ids.h"

namespace sunder {

/// How much of a Newton step each piece of a unit takes: less than all where a particle of it would turn by more than
/// kMostTurn, all of the piece alike. The step's linear system holds goal rotations fixed; a fragment on a hinge,
/// pulled by a stiff group, may be told to turn by radians, where the energy is another one: it then arrives upside
/// down with more energy than all of the scene had. The steps that follow make up for what was left out.
class StepLimit {
public:
    static constexpr double kMostTurn = 0.3;  // rad: sines and angles agree to 1.5 %

    /// Whether a particle may turn by too much, without an arc cosine: cos(t / 2) is 1 - t^2 / 8 and a little more.
    /// `cosine`: of half of its turn.
    static bool may_be_far(double cosine) { return cosine < 1 - 0.12 * kMostTurn * kMostTurn; }
    /// Takes in a particle of a piece.
    void add(PieceId piece, double cosine);
    /// In (0, 1].
    double share(PieceId piece) const;

private:
    struct Piece {
        PieceId piece;
        double share;
    };
    std::vector<Piece> short_;  // few: a unit is a single piece, or some of less than 64 particles
};

}  // namespace sunder
