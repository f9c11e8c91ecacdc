// What a group one fragment thick knows of its rest shape, and what it makes of where its particles are: positions are
// compared with a rest shape that is bent by the curvature which the members' rotations show (docs/theory.md,
// "Sheets and rods"). Rebuilt only where edges broke, material flowed, a pin came or went, or stiffness changed.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "solver/matching/group_shape.h"
#include "solver/matching/shape_matching.h"

namespace sunder {

using Mat9 = Eigen::Matrix<double, 9, 9>;
using Vec9 = Eigen::Matrix<double, 9, 1>;

/// What bends, and how it is bent for good.
struct Bending {
    std::span<const uint8_t> thin;                  // kThin, kSlender, or 0: a block (n_particles)
    std::span<const uint8_t> pinned;                // held by a pin (n_particles)
    std::span<const Mat3> plastic_deformation;      // F_P (n_particles)
    std::span<const Mat3> plastic_curvature;        // K_P in the fragment's axes, rad/m (n_particles), or empty: none
    std::span<const EdgeOffsets> edge_offset = {};  // of members, for good (n_edges), or empty: none
};

/// A member of such a group, in the axes of the group's fragment. Kernels read it as numbers (BentRecords).
struct BendingMember {
    Vec3 q;                // F_P (xbar_j - xbar_g) less the weighted mean, m
    double weight = 0;     // w m, kg
    Vec3 pull;             // w m A^+ q: F = sum p_j pull_j^T
    double mean_part = 0;  // of the weighted mean, -
    Vec3 arm;              // F_P (xbar_j - xbar_g): from the fragment, m
    Vec3 pull_arm;         // w m A'^+ arm: K = sum phi_j pull_arm_j^T
    Vec3 offset;       // of the point that is matched, from a pinned member's centre, at rest in the world, m; else 0
    MemberOffset own;  // what is so for good beside F_P and K_P
    Sym3 shift_block, turn_block;  // of the Hessian at rest, of this member alone, in the axes
};

/// k and E of a group are in its material's units; axes are those of its fragment at rest. Kernels read it as numbers
/// (BentRecords).
struct BendingShape {
    // Directions that are spanned: 1 a rod, 2 a sheet, 3 one of several through a thickness; 0: the group pulls
    // nothing.
    int rank = 0;
    int normal = 2;                               // of a sheet: across it
    int axis = 0;                                 // of a rod: along it
    bool is_pinned = false;                       // holds a pinned member: all is fitted about the cell
    bool thins = false;                           // `thinning` is not 0
    Mat3 axes = Mat3::Zero();                     // E: columns are the fragment's axes at rest, world
    Vec3 extent = Vec3::Zero();                   // t_k = sqrt(12) rho_k, m
    double volume = 0, mu = 0, nu = 0;            // m3, Pa, -
    double k = 0;                                 // 6 mu V over the trace of the whole ring, 1/s2
    double reach2 = 0;                            // d^2: weighted mean square of the neighbours' distances, m2
    Vec3 softness = Vec3::Zero();                 // X: chi across what is not spanned, 1 along it
    Vec3 turn_moment = Vec3::Zero();              // Gamma, m2
    Vec3 shear = Vec3::Zero();                    // c, Pa
    Mat3 spanned = Mat3::Zero();                  // P
    Mat3 A = Mat3::Zero(), A_arm = Mat3::Zero();  // of q and of the arms, kg m2
    Mat9 bending = Mat9::Zero();                  // of K - K_P as a column-major 9-vector, J m2
    Mat9 bending_less_turns = Mat9::Zero();       // less k Gamma A_arm of the turns, which K is the best fit of, J m2
    Mat3 plastic_curvature = Mat3::Zero();
    Vec3 pull_sum = Vec3::Zero();  // sum of pulls: 0 but where pins are
    // Orthonormal columns, as many as `rank`, then 0: P = span span^T, and the same of the arms. Pulls lie in them.
    // Arms that span all directions do so along the axes.
    Mat3 span = Mat3::Zero(), arm_span = Mat3::Zero();
    double lambda = 0;    // pressure(), Pa
    double thinning = 0;  // nu / (1 - nu) of what bends where all directions are spanned, else 0: thinner where drawn

    double youngs_modulus() const { return 2 * mu * (1 + nu); }
    /// Whether what r has along axis i stretches (else it bends), and what sigma has about it.
    bool shift_stretches(int i) const { return rank == 3 || (rank == 2 ? i != normal : i == axis); }
    bool turn_stretches(int i) const { return rank == 3 || (rank == 2 && i == normal); }
    /// lambda' of plane stress, Pa: that of bending, and of a sheet's stretch.
    double plane_pressure() const { return youngs_modulus() * nu / (1 - nu * nu); }
    /// lambda' of the stretch term: plane stress in sheets, the bar's in rods, Pa.
    double pressure() const {
        if (rank == 3) return 2 * mu * nu / (1 - 2 * nu);
        return rank == 2 ? plane_pressure() : 2 * mu * nu;
    }
    /// The C of one-point shear: Pa.
    Vec3 shear_frame() const { return Vec3::Constant(shear.sum() / 2) - shear; }
};

/// A bent group as its particles lie, in its fragment's axes as these are turned.
struct BentMember {
    Vec3 p;              // from the weighted mean, m
    Vec3 turn;           // phi_j: since rest, against the fragment, rad
    Vec3 r, sigma;       // what the bent shape leaves of p and turn
    Mat3 turn_rate;      // J: of phi_j, by a turn of the member
    Mat3 arc_rate;       // W: of the bent shape's place, by K arm
    Vec3 force, torque;  // minus the slope of the energy, world; N, N m
};
struct BentShape {
    Mat3 K, F, R;  // rad/m, -, -
};
struct BentGroup : BentShape {
    Mat3 axes;                               // D_g E
    double bend = 0, stretch = 0, rest = 0;  // energy, J; `rest`: what neither bends nor stretches
    double energy() const { return bend + stretch + rest; }
};

/// What no bent shape explains, as the squares of the uniaxial strains that have as much energy, -.
struct Unexplained {
    double stretch = 0;  // in a sheet, along a rod; the same through the thickness
    double bend = 0;     // of what bends: as a mean through the thickness
};

/// Strain of a section, in the fragment's axes: in its plane or along it, and its curvature, rad/m.
struct SectionStrain {
    Mat3 stretch = Mat3::Zero(), K = Mat3::Zero();
};

/// What of a group flows by the end of a step (section_flow.h).
struct Yielding {
    SectionStrain flowed;
    double hardening = 0;                      // deviator that flows, in the mean; 0: nothing flows
    double stretch_share = 0, bend_share = 0;  // what becomes so for good of what no bent shape explains, -

    bool flows() const { return hardening > 0; }
    /// Of all of it a part, so that `most` flows at most.
    void hold_to(double most);
    /// The share that is left of what no bent shape explains: of r and of sigma, along and about each axis.
    Vec3 shift_left(const BendingShape& s) const;
    Vec3 turn_left(const BendingShape& s) const;
};

inline void Yielding::hold_to(double most) {
    if (!(hardening > most)) return;
    const double part = most / hardening;
    flowed.stretch *= part, flowed.K *= part;
    hardening = most, stretch_share *= part, bend_share *= part;
}
inline Vec3 Yielding::shift_left(const BendingShape& s) const {
    Vec3 left;
    for (int i = 0; i < 3; ++i) left[i] = 1 - (s.shift_stretches(i) ? stretch_share : bend_share);
    return left;
}
inline Vec3 Yielding::turn_left(const BendingShape& s) const {
    Vec3 left;
    for (int i = 0; i < 3; ++i) left[i] = 1 - (s.turn_stretches(i) ? stretch_share : bend_share);
    return left;
}

/// The rest shapes of all thin groups.
class BendingShapes {
public:
    /// Takes up what changed: to be called before anything else, and wherever something may have.
    void update(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                std::span<const GroupStiffness> stiffness, const Bending& bending, const WorkerPool& workers);

    /// One that was slender and is torn until a direction is unspanned is a block.
    bool is_thin(ParticleIndex g) const { return g < thin_.size() && thin_[g] != 0; }
    /// That pulls: thin, with a neighbour, and not pinned.
    bool pulls(ParticleIndex g) const { return shape_[g].rank > 0; }
    /// Of what is not affine in a group, beside the same of a block: chi; 1 where it is a block.
    double softness(ParticleIndex g) const { return pulls(g) ? shape_[g].softness.minCoeff() : 1; }
    const BendingShape& shape(ParticleIndex g) const { return shape_[g]; }
    const BendingMember& member(size_t slot) const { return member_[slot]; }  // of LiveTopology
    /// Another whenever the shape may be another, as far as particles do not move it.
    uint64_t revision(ParticleIndex g) const { return revision_[g]; }
    std::span<const BendingShape> shapes() const { return shape_; }
    std::span<const BendingMember> members() const { return member_; }

private:
    struct Key {  // what a shape was built from
        uint64_t revision = 0;
        double k = -1, volume_ratio = 0;
        bool operator==(const Key&) const = default;
    };
    struct BlocksKey {  // what a slender group's blocks were found of
        double k = -1, volume_ratio = 0, weights = 0;
        bool operator==(const BlocksKey&) const = default;
    };
    struct Plastic {
        Mat3 F_P = Mat3::Identity(), K_P = Mat3::Zero();
    };
    void build(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
               const GroupStiffness& stiffness, const Bending& bending, const Plastic& plastic, ParticleIndex g);
    void take_up_offsets(const SimulationMesh& rest, const LiveTopology& live, std::span<const EdgeOffsets> offsets,
                         ParticleIndex g);
    void find_blocks(const LiveTopology& live, ParticleIndex g);

    std::vector<uint8_t> given_, thin_;  // as given; and those that bend as they stand (n_particles)
    std::vector<BendingShape> shape_;    // (n_particles)
    std::vector<BendingMember> member_;  // by slot
    std::vector<Key> key_;
    std::vector<BlocksKey> blocks_key_;
    std::vector<uint64_t> revision_;
    std::vector<EdgeOffsets> offset_;  // that members were taken up with
    std::vector<uint8_t> pinned_;
    std::vector<Mat3> curvature_;  // K_P that was built with
    uint64_t version_ = 0;
};

/// Where the particles of a thin group lie; `o_members`: as the group's slots, but for force and torque.
BentGroup bend(const BendingShapes& shapes, const LiveTopology& live, std::span<const MovingParticle> particles,
               ParticleIndex g, std::span<BentMember> o_members);

/// Of a group as `bend` left its members: the last line of E_g in docs/theory.md, "Sheets and rods".
Unexplained unexplained(const BendingShapes& shapes, const LiveTopology& live, ParticleIndex g,
                        std::span<const BentMember> members);

/// Forces and torques on the members: of the energy, without what `yielding` takes of elastic strain.
void pull_back(const BendingShapes& shapes, const LiveTopology& live, ParticleIndex g, const BentGroup& group,
               const Yielding& yielding, std::span<BentMember> io_members);

}  // namespace sunder
