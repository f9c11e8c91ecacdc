// Free vibration of the bar, clamped at its foot: how long its lowest modes take, and what beam theory says.
#pragma once

#include "solver/scene/scene.h"

namespace sunder::test {

enum class Mode { axial, torsion, bending };

struct Oscillation {
    Mode mode = Mode::torsion;
    int n = 4;                    // n x n x 5n particles, 0.2 x 0.2 x 1 m, of which the lowest 0.1 m are held
    int neighbours = 6;           // 6, 18 or 26
    double youngs_modulus = 6e5;  // Pa; nu = 0
    int substeps = 8;             // of 1/24 s, while it vibrates
    int iterations = 2;
};

/// Half the period of the lowest mode, s: between the first two zeros of the upper end's motion after it was let go
/// (axial, torsion: from a held end; bending: from sagging sideways).
double half_period(const Oscillation& setup);

/// The same by theory: axial waves sqrt(E/rho); Saint-Venant torsion of a square, J = 0.1406 a^4; an Euler-Bernoulli
/// cantilever lowered by shear and rotary inertia (Timoshenko, to first order).
double half_period_in_theory(Mode mode, double youngs_modulus);

}  // namespace sunder::test
