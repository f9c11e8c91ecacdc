// The same scenes in Bullet, as an independent yardstick.
#pragma once

#include "tests/benchmarks/bench/measure.h"

namespace sunder::bench {

/// Whether a scene is one that Bullet can be given: a bar, or rubble.
bool bullet_knows(const std::string& scene);

/// Single precision and one thread, as Debian builds the library. Frames 0: as many as the scene says. Throws
/// std::runtime_error where numbers go bad.
Measurement measure_bullet(const NamedScene& scene, int frames, int repeats);

/// The scene's only body, with its pins and without gravity, as a btSoftBody whose clusters are the groups of the
/// simulation mesh, one step of Bullet for each sweep of Sunder's: substeps times iterations a frame. `ns_group` is the
/// shape matching alone (btSoftBody::updateClusters); the times of frames hold all that Bullet does in a step:
/// prediction, its tree of nodes, matching, velocities.
Measurement measure_bullet_bar(const NamedScene& scene, int frames, int repeats);

/// Loose fragments as rigid bodies, convex hulls of the points that Sunder's contacts have, on the scene's floor; a
/// step for each substep of Sunder's, ten iterations of its solver in each (Bullet's default). Nothing sleeps.
Measurement measure_bullet_rubble(const NamedScene& scene, int frames, int repeats);

}  // namespace sunder::bench
