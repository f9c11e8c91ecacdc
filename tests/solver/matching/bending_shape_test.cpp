#include "solver/matching/bending_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "solver/lanes/instruction_set.h"
#include "solver/matching/bending_unit.h"
#include "solver/matching/thin_groups.h"
#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// One layer of fragments, or a row of them, somewhere askew in space.
struct Sheet {
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

    Sheet(int nx, int ny, double nu, bool with_pin) : poisson_ratio(nu) {
        rest = test::lattice_mesh({{nx, ny, 1}, 0.05, 6, 1000, {Vec3(3, -2, 1), rotation_of(Vec3(0.3, -0.8, 0.4))}});
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
        const std::vector<uint8_t> thin = thin_groups(rest);
        bending.update(rest, live, shapes, stiffness, {thin, pinned, plastic, curvature, offset}, workers);
    }
    // What no bent shape explains of where things are becomes their rest.
    void let_go(std::span<const MovingParticle> at) {
        offset.assign(rest.n_edges(), EdgeOffsets());
        for (uint32_t g = 0; g < rest.n_particles(); ++g) {
            if (!bending.pulls(g)) continue;
            std::vector<BentMember> members(live.count(g));
            bend(bending, live, at, g, members);
            const auto own = live.members().subspan(live.begin(g), members.size());
            const Vec3 cell = members[static_cast<size_t>(std::ranges::find(own, g) - own.begin())].r;
            for (uint32_t k = 0; k < members.size(); ++k)
                if (const EdgeId e = live.edge(live.begin(g) + k); !e.is_none())
                    offset[e][rest.edges[e].b == g] = {members[k].r - cell, members[k].sigma};
        }
        update();
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
    // Minus the slope, by particle: force, then torque.
    Eigen::VectorXd forces(std::span<const MovingParticle> at) const {
        Eigen::VectorXd all = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * rest.n_particles()));
        for (uint32_t g = 0; g < rest.n_particles(); ++g) {
            if (!bending.pulls(g)) continue;
            std::vector<BentMember> members(live.count(g));
            const BentGroup group = bend(bending, live, at, g, members);
            pull_back(bending, live, g, group, members);
            for (uint32_t k = 0; k < members.size(); ++k) {
                const uint32_t j = live.member(live.begin(g) + k);
                all.segment<3>(6 * j) += members[k].force, all.segment<3>(6 * j + 3) += members[k].torque;
            }
        }
        return all;
    }
};

MovingParticle stepped(const MovingParticle& p, int c, double by) {
    MovingParticle to = p;
    const Vec3 e = by * Vec3::Unit(c % 3);
    if (c < 3)
        to.x += e;
    else
        to.d = rotation_of(e) * p.d;
    return to;
}

// H z by the kernel.
void multiply(const Sheet& sheet, const LaneLayout& layout, const BendingArrays<double>& a, const Eigen::VectorXd& z,
              Eigen::VectorXd& o_product) {
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

TEST(bending_shape, sheets_and_rods_are_thin_and_blocks_are_not) {
    const auto count = [](int x, int y, int z) {
        SimulationMesh rest = test::lattice_mesh({{x, y, z}, 0.05, 6, 1000, {}});
        build_one_rings(rest);
        const std::vector<uint8_t> thin = thin_groups(rest);
        return std::accumulate(thin.begin(), thin.end(), size_t{0});
    };
    EXPECT_EQ(count(5, 4, 1), 20u);
    EXPECT_EQ(count(6, 1, 1), 6u);
    EXPECT_EQ(count(4, 4, 2), 0u);
    EXPECT_EQ(count(1, 1, 1), 0u);
}

TEST(bending_shape, forces_are_the_slope_of_the_energy) {
    for (const auto& [nx, ny] : {std::pair(4, 3), std::pair(5, 1)})
        for (const int kind : {0, 1, 2}) {
            const bool with_pin = kind == 1;
            Sheet sheet(nx, ny, 0.0, with_pin);
            if (kind == 2) sheet.let_go(sheet.moved(0.5));
            std::vector<MovingParticle> at = sheet.moved(1);
            const Eigen::VectorXd forces = sheet.forces(at);
            const double most = forces.cwiseAbs().maxCoeff();
            double worst = 0;
            for (size_t j = 0; j < at.size(); ++j)
                for (int c = 0; c < 6; ++c) {
                    if (sheet.pinned[j]) continue;
                    const MovingParticle was = at[j];
                    const double by = c < 3 ? 1e-7 : 1e-6;
                    at[j] = stepped(was, c, by);
                    const double after = sheet.energy(at);
                    at[j] = stepped(was, c, -by);
                    const double before = sheet.energy(at);
                    at[j] = was;
                    const double force = forces[static_cast<Eigen::Index>(6 * j) + c];
                    worst = std::max(worst, std::abs((before - after) / (2 * by) - force));
                }
            EXPECT_LT(worst, 1e-6 * most) << nx << " by " << ny << (with_pin ? " with a pin" : "");
        }
}

TEST(bending_shape, what_no_bent_shape_explains_bears_nothing_when_it_is_let_go) {
    for (const auto& [nx, ny] : {std::pair(4, 3), std::pair(5, 1)})
        for (const bool with_pin : {false, true}) {
            Sheet sheet(nx, ny, 0.3, with_pin);
            const std::vector<MovingParticle> at = sheet.moved(1);
            const auto groups = [&] {
                std::vector<BentGroup> all;
                std::vector<BentMember> members;
                for (uint32_t g = 0; g < at.size(); ++g) {
                    if (!sheet.bending.pulls(g)) continue;
                    members.resize(sheet.live.count(g));
                    all.push_back(bend(sheet.bending, sheet.live, at, g, members));
                    const Unexplained rest = unexplained(sheet.bending, sheet.live, g, members);
                    const BendingShape& s = sheet.bending.shape(g);
                    EXPECT_NEAR(0.5 * s.youngs_modulus() * s.volume * (rest.stretch + rest.bend), all.back().rest,
                                1e-12 * all.back().energy());
                }
                return all;
            };
            const std::vector<BentGroup> before = groups();
            sheet.let_go(at);
            const std::vector<BentGroup> after = groups();
            ASSERT_EQ(after.size(), before.size());
            for (size_t g = 0; g < after.size(); ++g) {
                const double whole = before[g].energy();
                EXPECT_LT(after[g].rest, 1e-12 * whole);
                EXPECT_NEAR(after[g].bend, before[g].bend, 1e-12 * whole);
                EXPECT_NEAR(after[g].stretch, before[g].stretch, 1e-12 * whole);
            }
        }
}

TEST(bending_shape, forces_have_no_sum_and_no_moment) {
    const Sheet sheet(4, 3, 0.3, false);
    const std::vector<MovingParticle> at = sheet.moved(1);
    const Eigen::VectorXd forces = sheet.forces(at);
    Vec3 force = Vec3::Zero(), moment = force;
    for (size_t j = 0; j < at.size(); ++j) {
        const Vec3 f = forces.segment<3>(static_cast<Eigen::Index>(6 * j));
        force += f, moment += (at[j].x - at[0].x).cross(f) + forces.segment<3>(static_cast<Eigen::Index>(6 * j + 3));
    }
    EXPECT_LT(force.norm(), 1e-12 * forces.norm());
    EXPECT_LT(moment.norm(), 1e-12 * forces.norm());
}

// Where nothing is strained the Hessian is all there is: the change of the forces.
TEST(bending_shape, products_are_what_a_small_motion_changes) {
    for (const auto& [nx, ny] : {std::pair(4, 3), std::pair(5, 1)})
        for (const bool with_pin : {false, true}) {
            const Sheet sheet(nx, ny, 0.3, with_pin);
            const std::vector<MovingParticle> at = sheet.moved(0);
            EXPECT_LT(sheet.energy(at), 1e-20);
            LaneLayout layout;
            layout.update(sheet.live, sheet.workers);
            ASSERT_EQ(layout.units().size(), 1u);
            const std::vector<double> span(at.size(), 1.0);
            std::vector<Role> role(at.size(), Role::free);
            if (with_pin) role[0] = Role::held;
            const SweepInput in{sheet.rest, sheet.live, sheet.shapes, sheet.stiffness, role,
                                span,       {},         {},           &sheet.bending};
            BendingUnit<double> unit;
            ASSERT_TRUE(unit.open(in, layout, 0));
            const UnitBlocks blocks(layout.n_blocks(), nullptr);
            unit.linearise(in, at, blocks, {});
            std::mt19937 random(2);
            std::normal_distribution<double> normal;
            const auto n = static_cast<Eigen::Index>(6 * at.size());
            Eigen::VectorXd z(n);
            for (Eigen::Index i = 0; i < n; ++i) z[i] = (i % 6 < 3 ? 0.05 : 1.0) * normal(random);
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) z.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            std::vector<MovingParticle> ahead = at, back = at;
            const double by = 1e-6;
            for (size_t j = 0; j < at.size(); ++j)
                for (int c = 0; c < 6; ++c) {
                    ahead[j] = stepped(ahead[j], c, by * z[static_cast<Eigen::Index>(6 * j) + c]);
                    back[j] = stepped(back[j], c, -by * z[static_cast<Eigen::Index>(6 * j) + c]);
                }
            const Eigen::VectorXd wanted = (sheet.forces(back) - sheet.forces(ahead)) / (2 * by);
            Eigen::VectorXd found = Eigen::VectorXd::Zero(n);
            multiply(sheet, layout, unit.arrays(), z, found);
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) found.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            Eigen::VectorXd compared = wanted;
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) compared.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            EXPECT_LT((found - compared).norm(), 1e-5 * compared.norm()) << nx << " by " << ny << with_pin;
        }
}

}  // namespace
}  // namespace sunder
