// Shots with everything drawn at random: rabbits in needles, slabs, crumbs and pieces of like size above a floor and
// under weights, of any stiffness, toughness and size, at any step; and some far beyond what an artist asks for.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "solver/solver.h"

namespace sunder::test {

class Draw {
public:
    explicit Draw(uint64_t seed) : rng_(seed) {}
    double uniform(double low, double high) { return low + (high - low) * 0x1p-53 * static_cast<double>(rng_() >> 11); }
    double logarithmic(double low, double high) { return low * std::pow(high / low, uniform(0, 1)); }
    bool one_in(int n) { return index(static_cast<uint64_t>(n)) == 0; }
    uint64_t index(uint64_t n) { return rng_() % n; }
    template <class T>
    T of(std::initializer_list<T> some) {
        return some.begin()[index(some.size())];
    }
    Vec3 vector(double most) {
        const double x = uniform(-most, most), y = uniform(-most, most);
        return {x, y, uniform(-most, most)};
    }

private:
    std::mt19937_64 rng_;
};

/// A body of 1 m and 1000 kg/m3 of another size (m) and density (kg/m3).
SimulationMesh scaled(SimulationMesh mesh, double size, double density);

/// One or two bodies, all of one material, and a weight or none.
struct Shot {
    Scene scene;  // collider 0: the floor
    Material material;
    SolverSettings settings;
    double gravity = 9.81;                           // m/s2
    std::vector<Force> forces;                       // in all frames
    std::vector<Force> blasts;                       // in frames 2, 4, 6, ...
    std::array<double, 2> factors = {1, 1};          // of `add_factors`, at the start and from frame 10 on
    Material of_region;                              // of `keep`
    DrivenPose sweep;                                // of the object of `keep`, in all frames
    std::function<SourcePose(size_t frame)> motion;  // of what follows, or of what pins hold
    std::shared_ptr<const SurfaceTree> tree;         // of what deforms, or null
    std::function<std::vector<Vec3>(size_t frame)> skin;

    explicit Shot(uint64_t seed);
    /// Takes one parameter from anywhere in its range instead; which one, and its value.
    std::string go_far(uint64_t seed);
    /// Makes panels of the bodies, one fragment thick, that bend by their curvature.
    void beat_flat(uint64_t seed);
    /// Has pins hold the first body, at rest, on one side of a plane drawn at random.
    void hold(uint64_t seed);
    /// Adds forces that differ from place to place.
    void blow(uint64_t seed);
    /// Has activations of all kinds keep parts of the first body, at rest, until something touches or breaks them, or
    /// their frame or an object comes; a seam through it weaken and break, and a region have factors.
    void keep(uint64_t seed);
    /// Has the first body follow a motion with turns and strains, until frame kLetGo or a contact before.
    void follow(uint64_t seed);
    static constexpr size_t kLetGo = 10;
    /// Has a ball (collider 1) that swells, bends and wanders come upon the bodies, and pins hold part of the first
    /// one, at rest, to what shears and turns, until frame kLetGo.
    void deform(uint64_t seed);
    /// Seams across the first body whose factor changes from one to another number, or that hold without end.
    void add_factors(Draw& draw);
    std::vector<Material> materials() const;
    FrameInput input(size_t frame = 0) const;

private:
    void draw_motion(Draw& draw);
};

}  // namespace sunder::test
