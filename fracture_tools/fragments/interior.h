// Break surfaces as an artist wants to see them: finer, uneven, marked where they meet the outer surface.
#pragma once

#include <string>

#include "solver/data/fragment_set.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

/// Lengths are shares of a piece's size, the cube root of the mean volume.
struct InteriorSettings {
    double detail = 0;         // longest edge of break surfaces, 0 .. 10; 0: as cut, or as fine as the noise needs
    double noise = 0;          // how far break surfaces leave their planes, 0 .. 0.5; 0: not at all
    double noise_scale = 0.5;  // distance between bumps, 0.05 .. 10
    uint32_t noise_seed = 0;
    double rim_width = 0;      // m, >= 0; within it the rim falls from 1 to 0
    double smooth_angle = 20;  // degrees, 0 .. 180; flatter edges of break surfaces are shaded smooth

    Status check(const std::string& where) const;
};

/// Refines, displaces and marks the break surfaces of a set that is measured and has UVs; both are brought up to date.
/// Fragments stay closed and share what they shared. Deterministic with any number of threads. Errors: more triangles
/// than fit into memory; cancelled.
Status shape_interior(const InteriorSettings& settings, int threads, const Progress& progress, FragmentSet& io_set);

/// Splits edges of interface triangles at their middles until none is longer than `longest`, m, and turns edges in flat
/// places so that triangles come near to Delaunay's. The outer surface keeps its shape: triangles that meet a long edge
/// of an interface get a vertex on it, with attributes between those of its ends. Error: cancelled.
Status refine_interfaces(double longest, const Progress& progress, FragmentSet& io_set);

/// Moves the vertices of interfaces that are not on the outer surface by up to `amplitude`, along the interfaces'
/// normals, after a solid noise with bumps `scale` apart, m. Both sides of an interface are the same triangles and move
/// as one. Near the outer surface vertices move less than they are away from it. What would make a fragment intersect
/// itself is moved half as far until it does not, in the end not at all. So every fragment is a closed surface without
/// self-intersections, if it was before; and since a point is in as many fragments as their surfaces wind around it,
/// which sums to how often the outer surface does, fragments cannot overlap one another either.
Status displace_interfaces(double amplitude, double scale, uint32_t seed, int threads, const Progress& progress,
                           FragmentSet& io_set);

/// Sets interface_corner_rim: 1 on the outer surface, falling to 0 at a distance of `width` from it, m; with 0 it is 0
/// on all other vertices.
void mark_rim(double width, FragmentSet& io_set);

}  // namespace sunder
