// A sheet or a rod whose groups are looked at one by one.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <random>
#include <span>

#include "solver/lanes/instruction_set.h"
#include "solver/matching/bending_unit.h"
#include "solver/matching/section_flow.h"
#include "solver/matching/thin_groups.h"
#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"

namespace sunder::test {

// Fragments along three axes: a sheet, a rod, a plate and a bar of two through the thickness.
struct Cells {
    int x, y, z;
};
inline constexpr Cells kSheets[] = {{4, 3, 1}, {5, 1, 1}, {4, 3, 2}, {5, 2, 2}};

// One layer of fragments, a row of them, or several layers, somewhere askew in space.
struct ThinSheet {
    SimulationMesh rest;
    LiveTopology live;
    GroupShapes shapes;
    BendingShapes bending;
    std::vector<GroupStiffness> stiffness;
    std::vector<uint8_t> pinned;
    std::vector<Mat3> plastic, curvature;
    std::vector<EdgeOffsets> offset;
    WorkerPool workers{1};
    double poisson_ratio;

    ThinSheet(int nx, int ny, double nu, bool with_pin, int nz = 1) : poisson_ratio(nu) {
        rest = lattice_mesh({{nx, ny, nz}, 0.05, 6, 1000, {Vec3(3, -2, 1), rotation_of(Vec3(0.3, -0.8, 0.4))}});
        build_one_rings(rest);
        live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
        plastic.assign(rest.n_particles(), Mat3::Identity());
        curvature.assign(rest.n_particles(), Mat3::Zero());
        pinned.assign(rest.n_particles(), 0);
        if (with_pin) pinned[0] = 1;
        update();
    }
    void update() {
        shapes.reset(rest, live, plastic);
        Material material;
        material.youngs_modulus = 1e6, material.poisson_ratio = poisson_ratio;
        stiffness.clear();
        for (size_t g = 0; g < rest.n_particles(); ++g)
            stiffness.push_back(group_stiffness(shapes.group[g], shapes.rest_trace[g], rest.volume[g], material));
        std::vector<uint8_t> thin = thin_groups(rest);
        for (uint8_t& kind : thin) kind = kind != 0 ? kThin : kSlender;
        bending.update(rest, live, shapes, stiffness, {thin, pinned, plastic, curvature, offset}, workers);
    }
    // What no bent shape explains of where things are becomes their rest.
    void let_go(std::span<const MovingParticle> at) {
        offset.assign(rest.n_edges(), EdgeOffsets());
        for (uint32_t g = 0; g < rest.n_particles(); ++g) {
            if (!bending.pulls(g)) continue;
            std::vector<BentMember> members(live.count(g));
            bend(bending, live, at, g, members);
            offset_members(g, members, 1, 1);
        }
        update();
    }
    // That share of what no bent shape explains of a group's members.
    void offset_members(uint32_t g, std::span<const BentMember> members, double stretch, double bend) {
        const BendingShape& s = bending.shape(g);
        const auto own = live.members().subspan(live.begin(g), members.size());
        const Vec3 cell = members[static_cast<size_t>(std::ranges::find(own, g) - own.begin())].r;
        for (uint32_t k = 0; k < members.size(); ++k) {
            const EdgeId e = live.edge(live.begin(g) + k);
            if (e.is_none()) continue;
            MemberOffset& to = offset[e][rest.edges[e].b == g];
            for (int i = 0; i < 3; ++i) {
                to.shift[i] = (s.shift_stretches(i) ? stretch : bend) * (members[k].r - cell)[i];
                to.turn[i] = (s.turn_stretches(i) ? stretch : bend) * members[k].sigma[i];
            }
        }
    }
    // At rest, moved as a whole and then each by as much.
    std::vector<MovingParticle> moved(double amount) const {
        std::mt19937 random(1);
        std::normal_distribution<double> normal;
        const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
        std::vector<MovingParticle> at(rest.n_particles());
        const Quat turn = rotation_of(Vec3(1, 2, -0.5));
        for (size_t i = 0; i < at.size(); ++i) {
            at[i].x = turn * Vec3(rest.rest_position[i] + amount * 0.05 * 0.05 * vector());
            at[i].d = turn * rotation_of(0.2 * amount * vector());
        }
        return at;
    }
    double energy(std::span<const MovingParticle> at) const {
        double sum = 0;
        for (uint32_t g = 0; g < rest.n_particles(); ++g) {
            std::vector<BentMember> members(live.count(g));
            if (bending.pulls(g)) sum += bend(bending, live, at, g, members).energy();
        }
        return sum;
    }
    // What flows of a group in a step that ends here.
    SectionFlow flow_of(ParticleIndex g, const BentShape& group, std::span<const BentMember> members,
                        const FlowWithin* flow) const {
        if (!flow) return {};
        const BendingShape& s = bending.shape(g);
        return flow_section(s, section_strain(s, group, s.plastic_curvature), flow->layers[g],
                            unexplained(bending, live, g, members), flow->yield[g], flow->share[0]);
    }
    // Minus the slope, by particle: force, then torque.
    Eigen::VectorXd forces(std::span<const MovingParticle> at, const FlowWithin* flow = nullptr) const {
        Eigen::VectorXd all = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * rest.n_particles()));
        for (uint32_t g = 0; g < rest.n_particles(); ++g) {
            if (!bending.pulls(g)) continue;
            std::vector<BentMember> members(live.count(g));
            const BentGroup group = bend(bending, live, at, g, members);
            pull_back(bending, live, g, group, flow_of(g, group, members, flow), members);
            for (uint32_t k = 0; k < members.size(); ++k) {
                const uint32_t j = live.member(live.begin(g) + k);
                all.segment<3>(6 * j) += members[k].force, all.segment<3>(6 * j + 3) += members[k].torque;
            }
        }
        return all;
    }
};

// That of a material for a step of any length; it flowed as fast as may be in the last one.
struct SheetFlow {
    std::vector<double> yield;
    std::vector<LayerStrain> layers;
    std::vector<double> rate;
    FlowWithin within;

    SheetFlow(const ThinSheet& sheet, double yields, double share)
        : yield(sheet.rest.n_particles(), yields),
          layers(yield.size()),
          rate(yield.size(), kNever),
          within{yield, layers, rate, 1, {share}} {}
};

inline MovingParticle stepped(const MovingParticle& p, int c, double by) {
    MovingParticle to = p;
    const Vec3 e = by * Vec3::Unit(c % 3);
    if (c < 3)
        to.x += e;
    else
        to.d = rotation_of(e) * p.d;
    return to;
}

// H z by the kernel.
inline void multiply(const ThinSheet& sheet, const LaneLayout& layout, const BendingArrays<double>& a,
                     const Eigen::VectorXd& z, Eigen::VectorXd& o_product) {
    const auto lane_of = [&](size_t j) { return layout.lane(j); };
    for (size_t j = 0; j < sheet.rest.n_particles(); ++j)
        for (size_t i = 0; i < 6; ++i) a.motion[8 * lane_of(j) + i + i / 3] = z[static_cast<Eigen::Index>(6 * j + i)];
    multiply_bending<Double4>(a, layout.row_begin(0), layout.neighbours(0), 0, layout.n_blocks());
    for (size_t block = 0; block < layout.n_blocks(); ++block)
        for (size_t lane = 0; lane < 8; lane += 4) {
            Double4 force[3], torque[3];
            gather_bending(a, layout.row_begin(0), block, lane, force, torque);
            double numbers[6][4];
            for (int i = 0; i < 3; ++i) store(numbers[i], force[i]), store(numbers[i + 3], torque[i]);
            for (size_t l = 0; l < 4; ++l)
                if (const uint32_t j = layout.particle(8 * block + lane + l); j != kNone)
                    for (Eigen::Index i = 0; i < 6; ++i) o_product[6 * j + i] = numbers[i][l];
        }
}

// What forces and torques on particles add up to, about the first.
struct Sums {
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};
inline Sums sums_of(const Eigen::VectorXd& forces, std::span<const MovingParticle> at) {
    Sums sums;
    for (size_t j = 0; j < at.size(); ++j) {
        const auto first = static_cast<Eigen::Index>(6 * j);
        const Vec3 f = forces.segment<3>(first);
        sums.force += f, sums.moment += (at[j].x - at[0].x).cross(f) + forces.segment<3>(first + 3);
    }
    return sums;
}

}  // namespace sunder::test
