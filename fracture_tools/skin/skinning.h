// Linear blend skinning of visual vertices to oriented particles (Choi 2014, section 4; Müller & Chentanez 2011).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/influence_pool.h"
#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/skin_candidates.h"
#include "fracture_tools/skin/skin_weights.h"
#include "fracture_tools/skin/split_topology.h"
#include "solver/data/math.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

/// How far a particle's say reaches.
struct SkinKernel {
    double reach = 1.6;  // support, in mean rest distances to the particle's neighbours
};

/// Vertices of a mesh that are numbered one after the other, and what moves them. Frames share those in which nothing
/// changed.
struct SkinChunk {
    struct Vertex {
        uint32_t pool_vertex;
        uint32_t begin, end;  // of its influences, in `influence`
    };

    std::vector<Vertex> vertex;
    std::vector<uint32_t> nearest;    // particle followed first, connected there   (n_vertices)
    InfluencePool::Memory influence;  // vertex after vertex

    size_t n_vertices() const { return vertex.size(); }
    std::span<const SkinInfluence> influences(size_t v) const {
        return {influence.get() + vertex[v].begin, vertex[v].end - vertex[v].begin};
    }
};

/// Which particles move each visual vertex and how much: all that a renderer needs to skin by itself (Choi 2014,
/// section 4.2). It changes only where edges broke. Influences of one vertex are ascending by particle, their weights
/// sum to one exactly.
struct SkinBinding {
    std::shared_ptr<const std::vector<Vec3>> rest_vertex;  // pool vertices in rest coordinates, m
    std::vector<std::shared_ptr<const SkinChunk>> chunks;  // vertex after vertex
    std::vector<uint32_t> first_vertex = {0};              // of each chunk (n_chunks + 1)

    size_t n_vertices() const { return first_vertex.back(); }
    /// Vertices [first_vertex[i], first_vertex[i + 1]) are those of chunk i; a search, O(log n_chunks).
    size_t chunk_of(size_t vertex) const;
    std::span<const SkinInfluence> influences(size_t vertex) const;
    uint32_t pool_vertex(size_t vertex) const;
    std::vector<uint32_t> pool_vertices() const;  // of all vertices
    uint32_t nearest(size_t vertex) const;
    const Vec3& rest_position(size_t vertex) const { return (*rest_vertex)[pool_vertex(vertex)]; }
    /// Where the influences of each vertex begin when those of all are put one after the other. (n_vertices + 1)
    std::vector<uint32_t> influence_offset() const;
};

/// Weights of the particles at each visual vertex.
///
/// Candidates at a vertex are the particles whose fragments are connected there and all their one-rings through intact
/// edges. The paper takes one nearest particle and its ring: there the set of candidates jumps, and the surface
/// creases, wherever another particle becomes the nearest; here a far particle fades out by its kernel
///
///     w_j = (1 - (d_j / s r_j)^2)^3,  r_j = reach * area-weighted mean rest length of j's edges
///
/// before it leaves the set. (s = 1, or more where a vertex is so far out that it would hardly see any particle.)
/// When a connection is lost, the nearest particle that is still connected locally leads, as in the paper.
///
/// The reach is a measured choice (boxes of 220 k-means fragments, stretched by 20 %, bent, twisted): shorter ones
/// crease at the fragments' borders, with longer ones the set of candidates ends before the kernel does, which creases
/// too. Vertices of a loose fragment have weight 1 for it alone.
///
/// Weights are rounded to multiples of 2^-24, which a float holds, the largest such that all sum to one: a common
/// motion moves a vertex by its own bits, however far away, and what rounding does (3e-8 of the differences between the
/// maps of neighbours) lies below the resolution of the positions that are given out.
class Skin {
public:
    /// `rest_vertex`: pool vertices in rest coordinates, m. `rest`: the body's slice, particle i = fragment i.
    Skin(std::vector<Vec3> rest_vertex, const SimulationMesh& rest, const SkinKernel& kernel = {});

    /// Finds the weights of all vertices of `topology`, a function of it and of `edge_intact` alone. Vertices where
    /// neither has changed since the last call keep what they have: pass each change of either exactly once.
    void bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact,
              const RangeRunner& run = run_serially);

    /// Of the last call of `bind`; it stays as it is when edges break later.
    const std::shared_ptr<const SkinBinding>& binding() const { return binding_; }

private:
    struct Scratch;  // of one thread

    void find_stale(const SplitTopology& topology, size_t chunk, std::vector<uint32_t>& out) const;
    std::shared_ptr<const SkinChunk> bind_chunk(const SplitTopology& topology, size_t chunk, Scratch& io_scratch) const;
    uint32_t bind_vertex(const SplitTopology& topology, uint32_t key, Scratch& io_scratch,
                         InfluencePool& io_pool) const;

    std::vector<Vec3> rest_particle_;   // (n_particles x 3), m
    std::vector<ParticlePlace> place_;  // the same, and one farther away than any support reaches    (n_particles + 1)
    IntactRings rings_;                 // of the last bind
    std::shared_ptr<const SkinBinding> binding_;
};

}  // namespace sunder
