// Shells within shells: solids, cavities, or neither.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fracture_tools/repair/repair_attributes.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct ShellReport {
    size_t n_shells = 0, turned = 0, cavities = 0, buried = 0, flat = 0;
    Vec3 first_buried = Vec3::Zero(), first_flat = Vec3::Zero();  // m
};

/// Orients the closed shells of a mesh so that they bound a solid, by how the artist wound them (`sense`, of each
/// triangle against the artist's; empty: as it is). Going inward, a shell that faces outward adds one to how often
/// space is filled, one that faces inward takes one away (Jacobson et al. 2013 give the idea); the solid is where that
/// is above 0. Hence a shell in a solid is a cavity if it faces the other way, and a solid in a cavity is one of its
/// own. One that faces the same way is buried: the solid goes through it, it is dropped. A shell that faces into
/// nothing is inside out, with all that is in it: turned. Shells whose triangles face this way and that are taken as
/// solid, cavity, solid, ... from outside inward.
///
/// `crossing`: pairs of triangles that cross. Shells that cross are not within one another, and are buried only all
/// together with those that they cross. Shells without volume are dropped.
ShellReport arrange_shells(TriMesh& io_mesh, std::span<const Sense> sense,
                           std::span<const std::array<uint32_t, 2>> crossing);

/// Of each shell of an arranged mesh (numbered as find_shells() does) those that it is within without crossing them,
/// the smallest first.
std::vector<std::vector<uint32_t>> surrounding_shells(const TriMesh& mesh,
                                                      std::span<const std::array<uint32_t, 2>> crossing);

/// Which sheets among the open shells of a mesh (`is_sheet`, of each shell) lie within the solid that the other shells
/// bound once their holes are closed: their triangles' middles do, as far as the winding tells and for as many as
/// kMostWindings allows. `sense`: as for arrange_shells.
constexpr size_t kMostWindings = 20'000'000;  // pairs of a middle and a triangle of the solid
std::vector<uint8_t> find_buried_sheets(const TriMesh& mesh, std::span<const Sense> sense,
                                        std::span<const uint8_t> is_sheet);

}  // namespace sunder
