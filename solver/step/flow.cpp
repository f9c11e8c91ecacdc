#include "solver/step/flow.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/bending_unit.h"
#include "solver/matching/groups_by_size.h"
#include "solver/material/bending_flow.h"
#include "solver/material/group_stretch.h"
#include "solver/material/plasticity.h"
#include "solver/step/loops.h"

namespace sunder {
namespace {

// What flows lasts as at most so many times what lasted of it before, and at first as so much of the yield strain: a
// hit that few Newton steps follow strains far beyond what it comes to, and would feed on itself.
constexpr double kGrowth = 1.5, kFirst = 0.1;

class Flow {
public:
    Flow(const Pass& pass, const LiveModel& model, const Movables& movables, Breaking& io_breaking,
         std::vector<GroupGoal>& io_goals, FrameState& io_state)
        : context_(pass.context),
          kept_(pass.slice.kept),
          measures_(pass.time.measure),
          seconds_(pass.flow_seconds),
          model_(model),
          movables_(movables),
          strains_(io_breaking.strains),
          flowed_(io_breaking.flowed),
          stretch_(io_breaking.stretch),
          goals_(io_goals),
          state_(io_state) {}

    Found run();

private:
    struct GivingWay {  // of four groups those that flow or break
        size_t n = 0;
        std::array<ParticleId, 4> index;
        std::array<FlowingGroup, 4> group;
    };
    const SimulationMesh& rest() const { return context_.scene.rest; }
    LiveGroups groups() const { return {rest(), model_.live, model_.shapes, movables_.moving, state_.edge_bond}; }
    bool is_uneven(ParticleIndex group) const {
        return sunder::is_uneven(rest(), model_.live, state_.edge_bond, group);
    }
    bool follows(ParticleIndex group) const { return follows_strain(context_, state_, group); }
    bool fades(ParticleIndex group) const { return !stretch_.empty() && sunder::fades(context_, state_, group); }
    Material material(ParticleIndex group) const;
    double strain_limit(ParticleIndex group) const;
    bool add_if_it_gives_way(ParticleIndex group, const PrincipalStretch& principal, GivingWay& io_groups) const;
    Found give_way(GivingWay& io_groups, const StretchKernels& kernels);
    Found flow_bent(ParticleIndex group, const BentGroups& four, size_t lane, std::span<const BentRow> rows);
    void let_members_go(ParticleIndex group, const BendingShape& shape, const BentFlow& flow,
                        std::span<const BentMember> members);
    void note_stretch(ParticleIndex group, const GroupStretches& stretches, size_t lane);

    const StepContext& context_;
    const std::vector<uint8_t>& kept_;
    const bool measures_;
    const double seconds_;
    const LiveModel& model_;
    const Movables& movables_;
    std::vector<GroupStrain>& strains_;
    std::vector<uint8_t>& flowed_;
    std::vector<GroupStretch>& stretch_;
    std::vector<GroupGoal>& goals_;
    FrameState& state_;
};

Found Flow::run() {
    if (context_.n_particles() == 0) return {};
    const bool any_fades = !state_.edge_damage.empty() && context_.settings.method == Method::projective;
    stretch_.resize(any_fades ? context_.n_particles() : 0);
    std::atomic<bool> changed{false}, overloaded{false};
    const auto note = [&](const Found& found) {
        if (found.changed) changed = true;
        if (found.overloaded) overloaded = true;
    };
    const GroupStretcher stretcher(model_.live, model_.shapes, movables_.moving, goals_);
    const auto four = [&](const uint32_t(&groups)[4], uint32_t n) {
        GroupStretches stretches;
        stretcher.measure(groups, stretches);
        // |log lambda| <= limit wherever |S - I| is below this: no need for the eigenvalues.
        std::array<bool, 4> is_strained;
        for (uint32_t i = 0; i < 4; ++i)
            is_strained[i] = !(stretches.deviation[i] < -math::expm1(-strain_limit(groups[i])));
        for (uint32_t i = 0; i < n; ++i) {
            const auto& q = stretches.rotation;
            goals_[groups[i]].rotation = Quat(q[3][i], q[0][i], q[1][i], q[2][i]);
            if (follows(groups[i])) note_stretch(groups[i], stretches, i);
        }
        if (!measures_ && std::ranges::find(is_strained, true) == is_strained.end()) return;
        PrincipalLanes principal;
        stretcher.decompose(stretches, principal);
        GivingWay giving_way;
        for (uint32_t i = 0; i < n; ++i) {
            if (is_strained[i] && add_if_it_gives_way(groups[i], principal_stretch(principal, i), giving_way)) continue;
            if (measures_) state_.strain[groups[i]] = largest_strain(principal, i);
        }
        if (giving_way.n == 0) return;
        note(give_way(giving_way, stretcher.kernels()));
    };
    const BentRecords bent_as_they_are = bent_records(model_.bending, model_.live, movables_.moving);
    for_groups(context_, [&](size_t first, size_t last) {
        GroupsBySize waiting, bending;
        std::vector<BentRow> rows;
        const auto four_bent = [&](const uint32_t(&groups)[4], uint32_t n) {
            uint32_t most = 0;
            for (const uint32_t g : groups) most = std::max(most, model_.live.count(g));
            rows.resize(most);
            BentGroups bent;
            bent_kernels().bend(bent_as_they_are, groups, most, false, bent, rows.data());
            for (uint32_t i = 0; i < n; ++i) note(flow_bent(groups[i], bent, i, rows));
        };
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            strains_[g].load = 0;
            if (kept_[g]) continue;
            if (!stretch_.empty()) stretch_[g] = {};  // of what is neither stretched nor bent it stays so
            const bool is_thin = model_.is_thin(g);
            const bool bends = model_.bends(g);
            if (model_.live.count(g) == 1 || (is_thin && !bends))
                state_.strain[g] = 0;
            else if (measures_ || (bends ? fades(g) : follows(g)) || strain_limit(g) < kNever)
                bends ? bending.add(g, model_.live.count(g), four_bent) : waiting.add(g, model_.live.count(g), four);
        }
        waiting.finish(four);
        bending.finish(four_bent);
    });
    return {changed, overloaded};
}

// Where edges fade a group does not tear as a whole.
Material Flow::material(ParticleIndex g) const {
    Material own = material_of(rest(), g, context_.material(g));
    if (fades(g)) own.toughness = kNever;
    return own;
}

// Below it none flows or breaks.
double Flow::strain_limit(ParticleIndex g) const {
    return std::min(state_.yield[g], breaking_strain(rest(), model_.live, material(g), g, state_.edge_bond));
}

// Whether it flows or breaks.
bool Flow::add_if_it_gives_way(ParticleIndex g, const PrincipalStretch& principal, GivingWay& io_groups) const {
    const Vec3& e = principal.log_strain;
    const double mean = e.mean(), deviator = std::max(e(2) - mean, mean - e(0));
    const Material m = material(g);
    const auto breaking = [&](Strained how) {
        return sunder::breaking_strain(rest(), model_.live, m, g, how, state_.edge_bond);
    };
    const bool may_break = e(2) > breaking(Strained::pulled) || -e(0) > breaking(Strained::pressed);
    if (!(deviator > state_.yield[g] || may_break)) return false;
    io_groups.index[io_groups.n] = ParticleId(size_t{g});
    io_groups.group[io_groups.n++] = {principal, m, {state_.plastic_deformation[g], state_.yield[g]}};
    return true;
}

Found Flow::give_way(GivingWay& io_groups, const StretchKernels& kernels) {
    Found found;
    std::array<FlowResult, 4> results;
    flow({io_groups.group.data(), io_groups.n}, seconds_, kernels, results);
    for (size_t i = 0; i < io_groups.n; ++i) {
        const ParticleId g = io_groups.index[i];
        const FlowingGroup& group = io_groups.group[i];
        const FlowResult& result = results[i];
        Quat& R = goals_[g].rotation;
        state_.strain[g] = result.elastic_log_strain.cwiseAbs().maxCoeff();
        if (group.stretch.reliable)
            strains_[g] = is_uneven(g)
                              ? uneven_group_strain(result.elastic_log_strain, group.stretch.directions, R,
                                                    group.material, groups(), g)
                              : group_strain(result.elastic_log_strain, group.stretch.directions, R, group.material);
        if (result.flowed) {
            state_.plastic_deformation[g] = group.plastic.F_P;
            state_.yield[g] = group.plastic.yield;
            R = (R * result.spin).normalized();
            flowed_[g] = 1;
            if (fades(g)) {
                const Vec3 stretch = result.elastic_log_strain.unaryExpr([](double e) { return math::exp(e) - 1; });
                const Mat3& axes = group.stretch.directions;
                stretch_[g].mean = axes * stretch.asDiagonal() * axes.transpose();
            }
        }
        found.changed |= result.flowed, found.overloaded |= strains_[g].load > 1;
    }
    return found;
}

// What is strained so asks hits for parts of a step, too.
void Flow::note_stretch(ParticleIndex g, const GroupStretches& stretches, size_t lane) {
    Sym3 S;
    for (size_t n = 0; n < S.size(); ++n) S[n] = stretches.S[n][lane];
    if (fades(g)) stretch_[g] = {.mean = to_matrix(S) - Mat3::Identity()};
    state_.strain[g] = std::min(stretches.deviation[lane], 1.0);
}

// A thin group, by the strain at its faces.
Found Flow::flow_bent(ParticleIndex g, const BentGroups& four, size_t lane, std::span<const BentRow> rows) {
    const BendingShape& shape = model_.bending.shape(g);
    const auto& q = four.rotation;
    goals_[g].rotation = Quat(q[3][lane], q[0][lane], q[1][lane], q[2][lane]);
    const Material own = material(g);
    BendingPlasticity plastic = {state_.plastic_deformation[g], state_.plastic_curvature[g], state_.layer_strain[g],
                                 state_.yield[g]};
    Found found;
    // What was rigid in a clamp that lets go bends, but not for good: what is bent beside it eases into it.
    const BentFlow flow = flow_bending(shape, bent_shape(four, lane), unexplained(shape, four, lane), own,
                                       movables_.tethers.hold(g) ? 0 : seconds_, plastic);
    const FaceStrains& faces = flow.faces;
    found.changed = flow.flows();
    if (seconds_ > 0) {
        const double lasts = std::max(kGrowth * state_.yielding_rate[g] * seconds_, kFirst * state_.yield[g]);
        state_.yielding_rate[g] = flow.is_taken ? std::min(flow.hardening, lasts) / seconds_ : 0.0;
    }
    state_.strain[g] = 0;
    const bool may_break = shape.rank < 3 || breaking_strain(rest(), model_.live, own, g, state_.edge_bond) < kNever;
    for (size_t face = 0; face < faces.n; ++face) {
        // No principal strain is above the norm.
        if (!may_break && faces.strain[face].norm() <= state_.strain[g]) continue;
        const auto& [strain, directions] = principal_of(shape, faces.strain[face]);
        state_.strain[g] = std::max(state_.strain[g], strain.cwiseAbs().maxCoeff());
        const Quat& R = goals_[g].rotation;
        const GroupStrain load = is_uneven(g) ? uneven_group_strain(strain, directions, R, own, groups(), g)
                                              : group_strain(strain, directions, R, own);
        if (load.load > strains_[g].load) strains_[g] = load;
    }
    if (fades(g)) {
        const auto at_rest = [&](const Mat3& strain) -> Mat3 { return shape.axes * strain * shape.axes.transpose(); };
        if (shape.rank == 3) {  // edges know how it is bent
            Mat3 sum = Mat3::Zero();
            for (size_t face = 0; face < faces.n; ++face) sum += faces.strain[face];
            stretch_[g] = {.mean = at_rest(sum / static_cast<double>(faces.n))};
        } else {
            const Mat3 one = at_rest(faces.strain[0]), other = at_rest(faces.strain[faces.n - 1]);
            stretch_[g] = {0.5 * (one + other), 0.5 * (one - other), shape.axes, shape.extent};
        }
    }
    found.overloaded = strains_[g].load > 1;
    if (found.changed) {
        flowed_[g] = plastic.F_P != state_.plastic_deformation[g];
        state_.plastic_deformation[g] = plastic.F_P, state_.plastic_curvature[g] = plastic.K_P;
        state_.layer_strain[g] = plastic.remainder, state_.yield[g] = plastic.yield;
        std::vector<BentMember> members(model_.live.count(g));
        bent_members(rows, lane, members);
        let_members_go(g, shape, flow, members);
    }
    return found;
}

// What no bent shape explains of the members of a thin group stays so, as far as it flows. What is the same for all
// members is of no account: the fragment's own share is taken off them.
void Flow::let_members_go(ParticleIndex g, const BendingShape& shape, const BentFlow& flow,
                          std::span<const BentMember> members) {
    const Vec3 shift_share = Vec3::Ones() - flow.shift_left(shape), turn_share = Vec3::Ones() - flow.turn_left(shape);
    const uint32_t begin = model_.live.begin(g);
    Vec3 cell = Vec3::Zero();
    for (size_t j = 0; j < members.size(); ++j)
        if (model_.live.member(begin + j) == g) cell = members[j].r;
    for (size_t j = 0; j < members.size(); ++j) {
        const EdgeId e = model_.live.edge(begin + j);
        if (e.is_none()) continue;
        MemberOffset& own = state_.edge_offset[e][rest().edges[e].b == g];
        own.shift += shift_share.cwiseProduct(members[j].r - cell);
        own.turn += turn_share.cwiseProduct(members[j].sigma);
    }
}

}  // namespace

Found flow_and_measure(const Pass& pass, const LiveModel& model, const Movables& movables, Breaking& breaking,
                       std::vector<GroupGoal>& goals, FrameState& state) {
    return Flow(pass, model, movables, breaking, goals, state).run();
}

void BeforeFlow::keep(const FrameState& s) {
    strain_ = s.strain;
    may_flow_ = std::ranges::any_of(s.yield, [](double yield) { return yield < kNever; });
    if (!may_flow_) return;
    plastic_deformation_ = s.plastic_deformation, plastic_curvature_ = s.plastic_curvature;
    layer_strain_ = s.layer_strain, edge_offset_ = s.edge_offset;
    yielding_rate_ = s.yielding_rate, yield_ = s.yield;
}

void BeforeFlow::give_back(FrameState& s) const {
    s.strain = strain_;
    if (!may_flow_) return;
    s.plastic_deformation = plastic_deformation_, s.plastic_curvature = plastic_curvature_;
    s.layer_strain = layer_strain_, s.edge_offset = edge_offset_;
    s.yielding_rate = yielding_rate_, s.yield = yield_;
}

}  // namespace sunder
