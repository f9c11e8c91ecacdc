// The same bar in Bullet: clusters of a soft body, one a one-ring, as an independent yardstick.
#pragma once

#include "tests/benchmarks/bench/measure.h"

namespace sunder::bench {

/// Runs the scene's only body, with its pins and without gravity, as a btSoftBody whose clusters are the groups of the
/// simulation mesh, one step of Bullet for each sweep of Sunder's: substeps times iterations a frame, single precision
/// as the library is built. `ns_group` is the shape matching alone (btSoftBody::updateClusters); the times of frames
/// hold all that Bullet does in a step: prediction, its tree of nodes, matching, velocities.
Measurement measure_bullet(const NamedScene& scene, int frames, int repeats);

/// Whether a scene is one that Bullet can be given: a bar.
bool bullet_knows(const std::string& scene);

}  // namespace sunder::bench
