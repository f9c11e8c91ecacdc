#include "solver/step_limit.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

constexpr double kMostTurn = 0.3;  // rad: sines and angles agree to 1.5 %

}  // namespace

void limit_step(const LiveTopology& live, std::span<const StepStart> before, std::span<const double> cosine,
                size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles) {
    for (size_t piece = begin_piece; piece < end_piece; ++piece) {
        double least = 1;
        for (uint32_t j : live.piece_particles(piece)) least = std::min(least, cosine[j]);
        const double turn = 2 * std::acos(least);
        if (!(turn > kMostTurn)) continue;
        const double share = kMostTurn / turn;
        for (uint32_t j : live.piece_particles(piece)) {
            MovingParticle& p = io_particles[j];
            p.x = before[j].x + share * (p.x - before[j].x);
            p.d = before[j].d.slerp(share, p.d);
        }
    }
}

}  // namespace sunder
