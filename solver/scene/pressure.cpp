#include "solver/scene/pressure.h"

#include <Eigen/LU>

#include "solver/data/disjoint_sets.h"

namespace sunder {
namespace {

constexpr double kClosed = 1e-9;  // of a shell's area, what is rounding of its opening at rest; and of moments

// What hangs together, and what of the lining it has.
struct Shell {
    Vec3 at_rest = Vec3::Zero(),
         opening = Vec3::Zero();  // sums of vectors of areas, at rest and as fragments turned, m2
    double area = 0;              // m2
    bool is_whole = true;
    Vec3 center = Vec3::Zero();  // of areas, from the lowest particle, m
    // Of what fragments are pushed by, and of a turn of all: over the pressure, m3 and m4.
    Vec3 torque = Vec3::Zero();
    Mat3 moment = Mat3::Zero();

    Vec3 turn = Vec3::Zero();  // that would take the torque off, 1/m

    bool is_closed() const { return area > 0 && is_whole && at_rest.norm() <= kClosed * area; }
    void find_turn() {
        const double size = moment.trace() / 3;
        if (moment.determinant() > kClosed * size * size * size) turn = moment.inverse() * torque;
    }
};

}  // namespace

Gas gas_in(const Pressure& gas, const SimulationMesh& rest, const FrameState& state, std::span<const uint8_t> asleep,
           uint32_t body) {
    const std::vector<Vec3>& lining = *gas.lining;
    const auto stands_by = [&](uint32_t i) { return rest.body[i] != body || (!asleep.empty() && asleep[i]); };
    std::vector<uint32_t> pieces = disjoint_sets(rest.n_particles());
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (state.edge_intact[e]) unite(pieces, rest.edges[e].a, rest.edges[e].b);
    // By the fragment of the lowest particle: sums are the same to the bit whichever sleepers are in this part of the
    // scene. Shells of fragments that lead no piece stay empty.
    std::vector<Shell> shells(lining.size());
    const auto shell_of = [&](uint32_t i) -> Shell& { return shells[rest.fragment[lowest(pieces, i)]]; };
    const auto turned = [&](uint32_t i) -> Vec3 {
        return state.orientation[i] * (rest.rest_orientation[i].conjugate() * lining[rest.fragment[i]]);
    };
    const auto place = [&](uint32_t i) -> Vec3 { return state.position[i] - state.position[lowest(pieces, i)]; };
    const auto for_all = [&](const auto& take) {
        for (uint32_t i = 0; i < rest.n_particles(); ++i)
            if (!stands_by(i)) take(i, shell_of(i), lining[rest.fragment[i]].norm());
    };
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (const Edge& edge = rest.edges[e]; !state.edge_intact[e] && !stands_by(edge.a) && !stands_by(edge.b))
            shell_of(edge.a).is_whole = shell_of(edge.b).is_whole = false;
    std::vector<Vec3> openings = lining;
    for_all([&](uint32_t i, Shell& shell, double area) {
        openings[rest.fragment[i]] = Vec3::Zero();
        shell.at_rest += lining[rest.fragment[i]], shell.opening += turned(i);
        shell.area += area, shell.center += area * place(i);
    });
    Gas now;
    for_all([&](uint32_t i, Shell& shell, double area) {
        if (!shell.is_closed()) return;
        const Vec3 r = place(i) - shell.center / shell.area;
        shell.torque += r.cross(turned(i) - area / shell.area * shell.opening);
        shell.moment += area * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
    });
    for (Shell& shell : shells) shell.find_turn();
    for_all([&](uint32_t i, const Shell& shell, double area) {
        if (!shell.is_closed()) return;
        now.beyond.resize(lining.size(), Vec3::Zero());
        const Vec3 r = place(i) - shell.center / shell.area;
        now.beyond[rest.fragment[i]] = area * (shell.opening / shell.area + shell.turn.cross(r));
    });
    for (size_t f = 0; f < shells.size(); ++f)
        if (!shells[f].is_closed()) openings[f] += shells[f].opening;
    double open = 0;  // m2
    for (const Vec3& of_piece : openings) open += of_piece.norm() / 2;
    const double share = open / (gas.vent * gas.area);
    now.left = 1 / (1 + share * share);
    return now;
}

}  // namespace sunder
