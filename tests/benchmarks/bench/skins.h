// The deformers of a scene's bodies.
#pragma once

#include <memory>
#include <vector>

#include "fracture_tools/skin/visual_mesh.h"
#include "solver/threads/parallel.h"
#include "tests/benchmarks/bench/scenes.h"

namespace sunder::bench {

class Skins {
public:
    /// Of `scene` as the solver has it, with its one-rings.
    explicit Skins(const BenchScene& scene);

    /// Makes the meshes of all bodies. `scene` is the one of the constructor. Throws std::runtime_error with the core's
    /// text.
    void build(const BenchScene& scene, const FrameState& state, const WorkerPool& workers);

    /// Of the last frame, held as a host holds the frame that it shows. (n_bodies)
    const std::vector<VisualMesh>& meshes() const { return last_; }
    size_t vertices() const { return vertices_; }
    size_t triangles() const { return triangles_; }
    /// Hash of every bit of the last frame's meshes.
    uint64_t hash() const;

private:
    std::vector<std::unique_ptr<VisualMeshBuilder>> builders_;
    std::vector<VisualMesh> last_;
    size_t vertices_ = 0, triangles_ = 0;
};

}  // namespace sunder::bench
