// What the scenes are put together from.
#pragma once

#include <stdexcept>

#include "tests/benchmarks/bench/scenes.h"

namespace sunder::bench {

template <class T>
T must(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().text());
    return result.take();
}

SimulationMesh simulation_mesh(const FragmentSet& fragments);
void add_body(BenchScene& io, const SimulationMesh& mesh, const Pose& pose, const Vec3& velocity,
              const Vec3& angular_velocity, const Material& material);
void add_floor(BenchScene& io);
void add_weight(BenchScene& io, const Vec3& position, double mass, const Vec3& velocity);

// Of lattices.
BenchScene twisted_bar(int across, int along);
BenchScene hit_plate();
BenchScene hanging_sheet(bool curvature, double yield);
BenchScene pile();
BenchScene resting(bool sleeping);
BenchScene cubes(int count);

// Of cut bunnies.
BenchScene two_bunnies();
BenchScene paper_scene();
BenchScene rubble();

}  // namespace sunder::bench
