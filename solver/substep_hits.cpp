// Hits: into how many parts a substep is divided for one, and for what; and how it breaks things on within a substep,
// for which what hangs together with the cuts takes it again, while all else is kept.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/awake_reach.h"
#include "solver/momentum.h"
#include "solver/piece_motion.h"
#include "solver/substep.h"

namespace sunder {
namespace {

// How far the waves of a hit run in a part of a substep, in distances between particles.
constexpr double kWaveInPart = 0.7;
// Where a wave moves part of a piece by v, there or elsewhere particles move by half of v against the whole piece.
constexpr double kOfTheWave = 0.5;
// What rings with more than this of the strain that breaks it takes the parts of any hit: a whole substep would damp
// its waves, and what breaks by them after the next hit would hang on the step.
constexpr double kRinging = 0.2;
// How fast what a hit lets go may fly, over the fastest that is hit.
constexpr double kLetGo = 2;

}  // namespace

// What is hit at speed v strains by v / c where the waves of the hit, of speed c, have come; an implicit step spreads
// that over all that they reach in it, so that nothing breaks of a strain that is many times the toughness. Hence where
// something closes fast enough to break what it meets, or such waves run through what is pushed, the substep is
// to be taken in parts in which they go from particle to particle, by all that hangs together with it. Of two particles
// that meet, the lighter one takes most of v. Not by sweeps: what stiffness they leave depends on the step, and what a
// long one bent a short one lets go.
bool Substep::find_hits() {
    work.hit.clear();
    if (context.settings.hit_substeps == 1 || context.settings.method != Method::projective) return false;
    const auto parts_for = [&](ParticleIndex j, double speed) {
        const double c = wave_speed(material(j).youngs_modulus, rest().volume[j], rest().mass[j]);
        if (!(speed > breaking_strain(j) * c)) return 1;
        const double wave = waves_in_step(h * h * work.live.count(j) * work.stiffness[j].k);
        return static_cast<int>(std::min(std::ceil(wave / kWaveInPart), double(context.settings.hit_substeps)));
    };
    const auto inverse_mass = [&](MovableId i) { return i < n_movables() ? work.inverse_mass[i] : 0.0; };
    const auto parts_for_touch = [&](MovableId j, MovableId other, double closing_speed) {
        if (j >= n_particles() || work.held[j] || work.live.count(j.value) == 1) return 1;
        const double own = inverse_mass(j);
        return parts_for(j.value, closing_speed * own / (own + inverse_mass(other)));
    };
    std::vector<int> parts(work.pieces.size(), 0);  // 0: nothing pushes the piece
    const auto ask_for = [&](PieceId piece, int wanted) {
        std::atomic_ref<int> most(parts[piece]);
        for (int now = most; wanted > now && !most.compare_exchange_weak(now, wanted);) {
        }
    };
    for_contacts([&](std::span<const ActiveContact> some) {
        for (const ActiveContact& c : some) {
            const bool closes = c.approach_speed * h > c.contact.gap - c.allowed_gap;
            if (!closes && c.before.normal <= 0) continue;
            const MovableId a = c.contact.a, b = c.contact.b;
            ask_for(work.piece[a], parts_for_touch(a, b, c.approach_speed));
            if (has_movable_b(c.contact)) ask_for(work.piece[b], parts_for_touch(b, a, c.approach_speed));
        }
    });
    const auto parts_for_waves = [&](size_t piece, double share) {
        const auto particles = work.live.piece_particles(piece);
        if (particles.size() == 1) return 1;
        const PieceMomentum p =
            piece_momentum(rest(), work.inertia, particles, work.start_position, work.velocity, work.angular_velocity);
        const Vec3 spin = rigid_spin(p, p.angular);
        int most = 1;
        for (const ParticleId j : particles) {
            const Vec3 own = work.velocity[j] - p.velocity - spin.cross(work.start_position[j] - p.center);
            most = std::max(most, parts_for(j, own.norm() / share));
        }
        return most;
    };
    for_pieces([&](size_t piece) {
        if (parts[piece] > 0) parts[piece] = std::max(parts[piece], parts_for_waves(piece, kOfTheWave));
    });
    work.parts = std::max(1, std::ranges::max(parts));
    if (work.parts == 1) return false;
    for_pieces([&](size_t piece) {
        if (parts[piece] <= 1) parts[piece] = parts_for_waves(piece, kOfTheWave * kRinging) > 1 ? work.parts : 0;
    });
    take_in_parts(parts);
    join_what_is_near_a_hit(parts);
    return true;
}

// Of `io_parts`, by piece: what hangs together with what takes more than one takes them, too. Marks these things.
void Substep::take_in_parts(std::vector<int>& io_parts) {
    for (IslandId island(0); island < work.islands.size(); ++island) {
        const auto pieces = work.islands.pieces_of(island);
        if (std::ranges::any_of(pieces, [&](PieceId p) { return io_parts[p] > 1; }))
            for (const PieceId p : pieces) io_parts[p] = work.parts;
    }
    work.hit.resize(n_movables());
    for_all(n_movables(), [&](size_t i) {
        const bool is_fixed = !context.fixed.empty() && context.fixed[i];
        work.hit[i] = io_parts[work.piece[i]] > 1 && !is_fixed;
    });
}

// What lies about what is hit is likely to be touched by what the hit lets go.
void Substep::join_what_is_near_a_hit(std::vector<int>& io_parts) {
    double fastest = 0;
    for (const ActiveContact& c : work.contacts)
        if (work.hit[c.contact.a]) fastest = std::max(fastest, c.approach_speed);
    for (size_t i = 0; i < n_movables(); ++i)
        if (work.hit[i]) fastest = std::max(fastest, work.velocity[i].norm());
    std::vector<Aabb> boxes(n_movables());
    for_all(n_movables(), [&](size_t i) {
        const double radius = reach_of(context.scene, i) + context.contact_margin;
        boxes[i] = ball(work.start_position[i], radius + (work.hit[i] ? kLetGo * fastest * h : 0));
        if (work.hit[i]) return;
        const Vec3 way = h * work.velocity[i];
        boxes[i].min += way.cwiseMin(0.0), boxes[i].max += way.cwiseMax(0.0);
    });
    std::vector<Aabb> islands;  // that are hit
    for (IslandId island(0); island < work.islands.size(); ++island) {
        const auto pieces = work.islands.pieces_of(island);
        if (io_parts[pieces.front()] <= 1) continue;
        Aabb& box = islands.emplace_back();
        for (const PieceId piece : pieces)
            for_movables(piece, [&](MovableId i) { box.extend(boxes[i].min), box.extend(boxes[i].max); });
    }
    const CellFilter filter(boxes, work.hit, context.workers);
    for_all(n_movables(), [&](size_t i) {
        const auto meets = [&](const Aabb& island) { return overlap(boxes[i], island); };
        if (!work.hit[i] && std::ranges::any_of(islands, meets) && filter.may_meet(boxes[i]))
            std::atomic_ref(io_parts[work.piece[i]]).store(work.parts, std::memory_order_relaxed);
    });
    take_in_parts(io_parts);
}

// Where things push: cuts what is to break, and says whether the substep is to be taken again, by what hangs together
// with the cuts through edges or contacts as they were. So a hit breaks as much with few substeps as with many, where
// it broke one ring a substep; what contacts did to the pieces as they were is forgotten, as fragments that come loose
// must not keep a push that carried a whole body. What breaks in the last pass is cut when the momentum books are
// closed, and let go in the next substep.
bool Substep::break_in_hit(double seconds) {
    Stopwatch watch(report.fracture_s);
    const size_t first_broken = state.broken.size();
    if (!break_edges(flow_and_measure(seconds), 0)) return false;
    keep_what_is_whole(first_broken);
    return work.is_taken_again = true;
}

void Substep::keep_what_is_whole(size_t first_broken) {
    std::vector<uint8_t> again(work.pieces.size(), 0);  // by pieces before the cuts, as `work.piece` still has them
    for (size_t k = first_broken; k < state.broken.size(); ++k)
        again[work.piece[rest().edges[state.broken[k].edge].a]] = 1;
    for (IslandId island(0); island < work.islands.size(); ++island) {
        const auto pieces = work.islands.pieces_of(island);
        if (std::ranges::any_of(pieces, [&](PieceId p) { return again[p] != 0; }))
            for (const PieceId p : pieces) again[p] = 1;
    }
    for_all(n_movables(), [&](size_t i) { work.kept[i] = !again[work.piece[i]]; });
}

// Pieces that are kept are as they were when their contacts were solved.
void Substep::take_over_pieces() {
    for_all(n_movables(), [&](size_t i) {
        if (!work.kept[i] || (i < n_particles() && work.live.piece_particles(work.piece[i]).front() != i)) return;
        work.pieces[work.piece[i]] = work.former_pieces[work.former_piece[i]];
        work.piece_change[work.piece[i]] = work.former_change[work.former_piece[i]];
    });
}

// What is kept has the impulses that were found for it.
void Substep::take_over_contacts() {
    const auto pair_of = [](const ActiveContact& c) { return std::pair(c.contact.a, c.contact.b); };
    auto former = work.former_contacts.begin();
    for (ActiveContact& c : work.contacts) {
        if (!work.kept[c.contact.a]) continue;
        while (former != work.former_contacts.end() && pair_of(*former) < pair_of(c)) ++former;
        if (former != work.former_contacts.end() && pair_of(*former) == pair_of(c)) c = *former++;
    }
}

// Whether an island has both what is kept and what is not, for what flowed may reach farther: none of it is kept then.
bool Substep::let_go_of_mixed_islands() {
    bool any = false;
    for (IslandId island(0); island < work.islands.size(); ++island) {
        const auto movables = work.islands.movables_of(island);
        const auto is_kept = [&](MovableId i) { return work.kept[i] != 0; };
        if (std::ranges::all_of(movables, is_kept) || std::ranges::none_of(movables, is_kept)) continue;
        any = true;
        for (const PieceId piece : work.islands.pieces_of(island))
            for_movables(piece, [&](MovableId i) { work.kept[i] = 0; });
    }
    return any;
}

}  // namespace sunder
