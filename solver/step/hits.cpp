#include "solver/step/hits.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/collision/cell_filter.h"
#include "solver/collision/movable_size.h"
#include "solver/pieces/momentum.h"
#include "solver/scene/scales.h"
#include "solver/step/breaking.h"
#include "solver/step/loops.h"

namespace sunder {
namespace {

// How far the waves of a hit run in a part of a step, in distances between particles.
constexpr double kWaveInPart = 0.7;
// The same where edges fade: with longer parts an implicit step damps what would part them.
constexpr double kWaveWhereEdgesFade = 0.35;
// Where a wave moves part of a piece by v, there or elsewhere particles move by half of v against the whole piece.
constexpr double kOfTheWave = 0.5;
// What rings with more than this of the strain that breaks it takes the parts of any hit: a whole step would damp
// its waves, and what breaks by them after the next hit would hang on the step.
constexpr double kRinging = 0.2;
// Of the way that a piece is long waves run this much in a part, over the error budget: with less an implicit step
// takes more of a bounce than the budget. Half of a bounce lasts pi / 2 ways, in each of which it loses the like.
constexpr double kWaveInBudget = 0.45;
// Of the speed that what is stored would go at. What rings moves faster even where it turns; what bears a load does
// not.
constexpr double kAtTheTurn = 0.05;
// How fast what a hit lets go may fly, over the fastest that is hit.
constexpr double kLetGo = 2;

class HitSearch {
public:
    HitSearch(const Pass& pass, const LiveModel& model, const ContactProblem& problem, const Movables& movables,
              const Pieces& pieces)
        : context_(pass.context),
          state_(pass.state),
          h_(pass.time.h),
          model_(model),
          problem_(problem),
          movables_(movables),
          pieces_(pieces) {}

    Hit run();
    Hit of_cracks(std::span<const ParticleId> weakened);

private:
    double inverse_mass(MovableId i) const { return i < movables_.size() ? movables_.inverse_mass[i] : 0.0; }
    double wave_speed_of(ParticleIndex particle) const;
    int parts_for(ParticleIndex particle, double speed) const;
    double parts_of_waves(ParticleIndex particle) const;
    int parts_for_breaking(ParticleIndex particle, double speed) const;
    int parts_for_budget(ParticleIndex particle, double speed) const;
    int capped(double parts) const;
    bool has_budget() const { return context_.settings.error_budget > 0; }
    void measure_pieces();
    int parts_for_touch(MovableId particle, MovableId other, double closing_speed) const;
    int parts_for_waves(size_t piece, double share) const;
    void ask_where_things_meet(std::vector<int>& io_parts) const;
    void take_in_parts(std::vector<int>& io_parts, Hit& io_hit) const;
    void join_what_is_near(std::vector<int>& io_parts, Hit& io_hit) const;

    const StepContext& context_;
    const FrameState& state_;
    const double h_;
    const LiveModel& model_;
    const ContactProblem& problem_;
    const Movables& movables_;
    const Pieces& pieces_;
    std::vector<double> size_;  // of pieces, m
};

double HitSearch::wave_speed_of(ParticleIndex j) const {
    const SimulationMesh& rest = context_.scene.rest;
    return wave_speed(context_.material(j).youngs_modulus, rest.volume[j], rest.mass[j]);
}

int HitSearch::capped(double parts) const {
    return static_cast<int>(std::min(std::ceil(parts), double(context_.settings.hit_substeps)));
}

// In which waves go from particle to particle.
double HitSearch::parts_of_waves(ParticleIndex j) const {
    const double in_part = fades(context_, state_, j) ? kWaveWhereEdgesFade : kWaveInPart;
    return waves_in_step(h_ * h_ * model_.live.count(j) * model_.stiffness[j].k) / in_part;
}

int HitSearch::parts_for_breaking(ParticleIndex j, double speed) const {
    if (!(speed > breaking_strain(context_, state_, model_.live, j) * wave_speed_of(j))) return 1;
    return capped(parts_of_waves(j));
}

int HitSearch::parts_for_budget(ParticleIndex j, double speed) const {
    if (!has_budget()) return 1;
    const double size = size_[model_.live.piece(j)];
    if (!(speed > calm_speed(context_.input, size))) return 1;
    return capped(wave_speed_of(j) * h_ / (kWaveInBudget * context_.settings.error_budget * size));
}

int HitSearch::parts_for(ParticleIndex j, double speed) const {
    return std::max(parts_for_breaking(j, speed), parts_for_budget(j, speed));
}

// Longest sides of the boxes about pieces' particles, which an error budget asks for.
void HitSearch::measure_pieces() {
    if (!has_budget()) return;
    size_.resize(model_.live.n_pieces());
    for_pieces(model_.live, kParticleGrain, context_.workers, [&](size_t piece) {
        Aabb box;
        for (const ParticleId j : model_.live.piece_particles(piece)) box.extend(movables_.start_position[j]);
        size_[piece] = (box.max - box.min).maxCoeff();
    });
}

int HitSearch::parts_for_touch(MovableId j, MovableId other, double closing_speed) const {
    if (j >= context_.n_particles() || movables_.role[j] != Role::free || model_.live.count(j.value) == 1) return 1;
    const double own = inverse_mass(j);
    return parts_for(j.value, closing_speed * own / (own + inverse_mass(other)));
}

int HitSearch::parts_for_waves(size_t piece, double share) const {
    const auto particles = model_.live.piece_particles(piece);
    if (particles.size() == 1) return 1;
    const PieceMomentum p = piece_momentum(context_.scene.rest, movables_.inertia, particles, movables_.start_position,
                                           movables_.velocity, movables_.angular_velocity);
    const Vec3 spin = rigid_spin(p, p.angular);
    int most = 1;
    double fastest = 0;
    for (const ParticleId j : particles) {
        const Vec3 own = movables_.velocity[j] - p.velocity - spin.cross(movables_.start_position[j] - p.center);
        most = std::max(most, parts_for(j, own.norm() / share));
        fastest = std::max(fastest, own.norm());
    }
    for (const ParticleId j : particles) {
        if (!follows_strain(context_, state_, j)) continue;
        const double stored = state_.strain[j] * wave_speed_of(j);
        if (fastest > kAtTheTurn * stored) most = std::max(most, parts_for(j, stored / share));
    }
    return most;
}

void HitSearch::ask_where_things_meet(std::vector<int>& io_parts) const {
    const auto ask_for = [&](PieceId piece, int wanted) {
        std::atomic_ref<int> most(io_parts[piece]);
        for (int now = most; wanted > now && !most.compare_exchange_weak(now, wanted);) {
        }
    };
    for_contacts(context_, problem_.contacts, [&](std::span<const ActiveContact> some) {
        for (const ActiveContact& c : some) {
            const bool closes = c.approach_speed * h_ > c.contact.gap - c.allowed_gap;
            if (!closes && c.before.normal <= 0) continue;
            const MovableId a = c.contact.a, b = c.contact.b;
            ask_for(pieces_.of[a], parts_for_touch(a, b, c.approach_speed));
            if (has_movable_b(c.contact)) ask_for(pieces_.of[b], parts_for_touch(b, a, c.approach_speed));
        }
    });
}

Hit HitSearch::run() {
    Hit hit;
    std::vector<int> parts(pieces_.whole.size(), 0);  // 0: nothing pushes the piece
    const auto for_all_pieces = [&](const auto& body) {
        for_pieces(model_.live, kParticleGrain, context_.workers, body);
    };
    measure_pieces();
    ask_where_things_meet(parts);
    for_all_pieces([&](size_t piece) {
        if (parts[piece] > 0) parts[piece] = std::max(parts[piece], parts_for_waves(piece, kOfTheWave));
    });
    hit.parts = std::max(1, std::ranges::max(parts));
    if (hit.parts == 1) return hit;
    for_all_pieces([&](size_t piece) {
        if (parts[piece] <= 1) parts[piece] = parts_for_waves(piece, kOfTheWave * kRinging) > 1 ? hit.parts : 0;
    });
    take_in_parts(parts, hit);
    join_what_is_near(parts, hit);
    return hit;
}

Hit HitSearch::of_cracks(std::span<const ParticleId> weakened) {
    Hit hit;
    std::vector<int> parts(pieces_.whole.size(), 0);
    for (const ParticleId j : weakened) {
        const double wanted = fades(context_, state_, j) ? parts_of_waves(j) : 1;
        if (wanted > context_.settings.hit_substeps) continue;
        int& most = parts[pieces_.of[j]];
        most = std::max(most, capped(wanted));
    }
    hit.parts = std::max(1, std::ranges::max(parts));
    if (hit.parts == 1) return hit;
    take_in_parts(parts, hit);
    join_what_is_near(parts, hit);
    return hit;
}

// Of `io_parts`, by piece: what hangs together with what takes more than one takes them, too. Marks these things.
void HitSearch::take_in_parts(std::vector<int>& io_parts, Hit& io_hit) const {
    const ContactIslands& islands = problem_.islands;
    for (IslandId island(0); island < islands.size(); ++island) {
        const auto pieces = islands.pieces_of(island);
        if (std::ranges::any_of(pieces, [&](PieceId p) { return io_parts[p] > 1; }))
            for (const PieceId p : pieces) io_parts[p] = io_hit.parts;
    }
    io_hit.what.resize(movables_.size());
    for_all(context_, movables_.size(), [&](size_t i) {
        const bool is_fixed = !context_.fixed.empty() && context_.fixed[i];
        io_hit.what[i] = io_parts[pieces_.of[i]] > 1 && !is_fixed;
    });
}

// What lies about what is hit is likely to be touched by what the hit lets go.
void HitSearch::join_what_is_near(std::vector<int>& io_parts, Hit& io_hit) const {
    const ContactIslands& islands = problem_.islands;
    const size_t n = movables_.size();
    double fastest = 0;
    for (const ActiveContact& c : problem_.contacts)
        if (io_hit.what[c.contact.a]) fastest = std::max(fastest, c.approach_speed);
    for (size_t i = 0; i < n; ++i)
        if (io_hit.what[i]) fastest = std::max(fastest, movables_.velocity[i].norm());
    std::vector<Aabb> boxes(n);
    for_all(context_, n, [&](size_t i) {
        const double radius = reach_of(context_.scene, i) + context_.contact_margin;
        boxes[i] = ball(movables_.start_position[i], radius + (io_hit.what[i] ? kLetGo * fastest * h_ : 0));
        if (io_hit.what[i]) return;
        const Vec3 way = h_ * movables_.velocity[i];
        boxes[i].min += way.cwiseMin(0.0), boxes[i].max += way.cwiseMax(0.0);
    });
    std::vector<Aabb> hit_islands;
    for (IslandId island(0); island < islands.size(); ++island) {
        const auto pieces = islands.pieces_of(island);
        if (io_parts[pieces.front()] <= 1) continue;
        Aabb& box = hit_islands.emplace_back();
        for (const PieceId piece : pieces)
            for_movables(model_.live, piece, [&](MovableId i) { box.extend(boxes[i].min), box.extend(boxes[i].max); });
    }
    const CellFilter filter(boxes, io_hit.what, context_.workers);
    for_all(context_, n, [&](size_t i) {
        const auto meets = [&](const Aabb& island) { return overlap(boxes[i], island); };
        if (!io_hit.what[i] && std::ranges::any_of(hit_islands, meets) && filter.may_meet(boxes[i]))
            std::atomic_ref(io_parts[pieces_.of[i]]).store(io_hit.parts, std::memory_order_relaxed);
    });
    take_in_parts(io_parts, io_hit);
}

}  // namespace

bool divides_hits(const SolverSettings& settings) {
    return settings.hit_substeps > 1 && settings.method == Method::projective;
}

Hit find_cracks(const Pass& pass, const LiveModel& model, const ContactProblem& problem, const Movables& movables,
                const Pieces& pieces, std::span<const ParticleId> weakened) {
    return HitSearch(pass, model, problem, movables, pieces).of_cracks(weakened);
}

Hit find_hits(const Pass& pass, const LiveModel& model, const ContactProblem& problem, const Movables& movables,
              const Pieces& pieces) {
    if (!divides_hits(pass.context.settings)) return {};
    return HitSearch(pass, model, problem, movables, pieces).run();
}

}  // namespace sunder
