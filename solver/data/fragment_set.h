// The pieces that a mesh was cut into, and the interfaces between them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "solver/data/ids.h"
#include "solver/data/math.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// One closed piece. Moments are exact polyhedral integrals.
struct Fragment {
    double volume = 0;                        // m3
    Vec3 centroid = Vec3::Zero();             // m
    Mat3 covariance = Mat3::Zero();           // (1/V) int (x - centroid)(x - centroid)^T dV, m2
    Quat orientation = Quat::Identity();      // principal frame of the covariance, right-handed
    Vec3 radii = Vec3::Zero();                // half extents of the oriented bounding box in that frame, m
    int32_t cluster = 0;                      // group of fragments that holds together more strongly
    double toughness_factor = 1;              // on the body's, > 0
    double yield_factor = 1;                  // on the body's, > 0
    double density_factor = 1;                // on the body's, > 0
    uint32_t outer_begin = 0, outer_end = 0;  // its range in FragmentSet::outer_triangles
};

/// The surface two fragments share. Its triangles are stored once, outward from `a`; `b` sees them reversed.
struct Interface {
    FragmentId a, b;                                // a < b
    double area = 0;                                // m2; 0 for neighbours joined across a lattice edge or corner
    Vec3 normal = Vec3::Zero();                     // area-weighted mean, unit, from a to b
    Vec3 centroid = Vec3::Zero();                   // m
    uint32_t triangle_begin = 0, triangle_end = 0;  // range in FragmentSet::interface_triangles
    double toughness_factor = 1;                    // below 1: weak; infinite: glued, it never breaks
    bool joins = true;                              // false: too small to hold its fragments together by itself
};

/// All fragments index one pool of vertices: what two fragments share has the same index, hence the same bits.
struct FragmentSet {
    std::vector<Vec3> vertices;  // (n_vertices x 3), m

    std::vector<Fragment> fragments;    // (n_fragments)
    std::vector<Interface> interfaces;  // (n_interfaces), ascending by (a, b); one at most a pair

    std::vector<Triangle> outer_triangles;    // fragment after fragment, counter-clockwise from outside
    std::vector<int32_t> outer_material;      // (n_outer), 0 and up
    std::vector<Vec2f> outer_corner_uvs;      // (3 n_outer x 2), or empty
    std::vector<Vec3f> outer_corner_normals;  // (3 n_outer x 3), the artist's, or empty
    std::vector<Color> outer_corner_colors;   // (3 n_outer), or empty
    std::vector<MeshLayer> outer_layers;  // a row each outer triangle (face), or each of its corners (corner, point)

    std::vector<Triangle> interface_triangles;  // interface after interface, outward from Interface::a
    std::vector<Vec2f> interface_corner_uvs;    // (3 n_interface_triangles x 2), in metres on the cut
    std::vector<float> interface_corner_rim;    // (3 n_interface_triangles), or empty: 1 on the outer surface, 0 away
    double interior_smooth_angle = 20;  // break surfaces are shaded smooth across edges flatter than this, degrees
    int32_t interior_material = 1;      // material id of break surfaces: number of outer materials
    std::vector<std::string> material_names;  // outer ones; may be empty

    std::map<std::string, std::vector<FragmentId>> vertex_groups;  // fragments that own a named group's vertices
    double source_volume = 0, source_area = 0;                     // of the mesh that was cut, m3, m2
    std::string source_path;                                       // may be empty
    std::vector<std::string> warnings;                             // what an artist should know about this cut
};

}  // namespace sunder
