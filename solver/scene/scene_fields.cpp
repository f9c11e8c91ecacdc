#include "solver/scene/scene_fields.h"

#include <array>

#include "solver/scene/scales.h"

namespace sunder {
namespace {

FieldDescription animatable(FieldDescription field) {
    field.animatable = true;
    return field;
}

}  // namespace

std::span<const Field<Material>> material_fields() {
    using M = Material;
    static const std::array fields = {
        Field<M>{animatable({.name = "youngs_modulus",
                             .label = "Young's Modulus",
                             .unit = "Pa",
                             .sentence = "Stiffness: stress per stretch (rubber 1e6, wood 1e10, steel 2e11)",
                             .min = 0,
                             .max = 1e12,
                             .min_excluded = true}),
                 &M::youngs_modulus},
        Field<M>{animatable({.name = "poisson_ratio",
                             .label = "Poisson's Ratio",
                             .sentence = "Thinning across per stretch along; solids keep their volume better as it "
                                         "nears 0.5",
                             .min = 0,
                             .max = 0.45}),
                 &M::poisson_ratio},
        Field<M>{animatable({.name = "damping_time",
                             .label = "Damping Time",
                             .unit = "s",
                             .sentence = "Damping inside the material, stress by strain rate over stiffness: a free "
                                         "vibration of period T falls by exp(-2 pi^2 x this / T) each time. Where "
                                         "something touches, substeps longer than this damp more by themselves; none "
                                         "in gauss_seidel",
                             .min = 0,
                             .max = kLongestDampingTime}),
                 &M::damping_time},
        // Not animatable: it is where each group's own yield starts, which then lives in the state and hardens.
        Field<M>{{.name = "yield",
                  .label = "Yield",
                  .sentence = "Change of shape (logarithmic strain without its change of volume) from which it stays "
                              "dented; null: never",
                  .min = 0,
                  .min_excluded = true},
                 &M::yield},
        Field<M>{animatable({.name = "flow_rate",
                             .label = "Flow Rate",
                             .unit = "1/s",
                             .sentence = "How fast strain beyond the yield becomes permanent: its share per second",
                             .min = 0,
                             .max = 1e6}),
                 &M::flow_rate},
        Field<M>{animatable({.name = "hardening",
                             .label = "Hardening",
                             .sentence = "Growth of the yield per permanent strain",
                             .min = 0,
                             .max = 1e3}),
                 &M::hardening},
        Field<M>{animatable({.name = "toughness",
                             .label = "Toughness",
                             .sentence = "Stretch (principal logarithmic strain) at which it tears; null: never",
                             .min = 0,
                             .min_excluded = true}),
                 &M::toughness},
        Field<M>{animatable({.name = "compressive_toughness",
                             .label = "Compressive Toughness",
                             .sentence = "Squeeze (principal logarithmic strain) at which it is crushed; null: never",
                             .min = 0,
                             .min_excluded = true}),
                 &M::compressive_toughness},
        Field<M>{
            animatable({.name = "fracture_energy",
                        .label = "Fracture Energy",
                        .unit = "J/m2",
                        .sentence = "Work that parts an area of an interface beyond its toughness: high, cracks run "
                                    "through and leave large pieces, low, things crumble. Of method projective; "
                                    "null: groups of fragments break at once, by their mean stretch",
                        .min = 0,
                        .is_added = true}),
            &M::fracture_energy},
        Field<M>{animatable({.name = "stiffness",
                             .label = "Stiffness",
                             .sentence = "Of the solver's method gauss_seidel alone: share of the way to the goal "
                                         "shape per iteration",
                             .min = 0,
                             .max = 1}),
                 &M::stiffness},
        Field<M>{animatable({.name = "friction",
                             .label = "Friction",
                             .sentence = "Coulomb friction: tangential force per normal force that a contact can bear "
                                         "before it slides",
                             .min = 0,
                             .max = 10}),
                 &M::friction},
        Field<M>{animatable({.name = "restitution",
                             .label = "Restitution",
                             .sentence = "Share of the approach speed with which a contact bounces",
                             .min = 0,
                             .max = 1}),
                 &M::restitution},
        Field<M>{
            {.name = "curvature",
             .label = "Bend by Curvature",
             .sentence = "Sheets and rods that are one fragment thick resist bending, yield and tear as plates and "
                         "beams of their thickness do; off: as stiff as blocks, and they spring back. Methods "
                         "other than projective leave it out",
             .is_added = true},
            &M::curvature},
        Field<M>{{.name = "slender",
                  .label = "Slender",
                  .sentence = "What is a few fragments thick resists bending, yields and tears as beams and plates do, "
                              "at some four times the cost of blocks, which bend too little and spring back. Methods "
                              "other than projective leave it out",
                  .min = 0,
                  .max = 2,
                  .is_added = true},
                 &M::slender}};
    static_assert(fields.size() == n_members<M>(), "a member that is not described is neither checked nor hashed");
    return fields;
}

std::span<const Field<SolverSettings>> settings_fields() {
    using S = SolverSettings;
    static const std::array fields = {
        Field<S>{{.name = "substeps",
                  .label = "Substeps",
                  .sentence = "Steps per frame: more for stiff materials and fast impacts, even numbers are more "
                              "accurate; null: the preset's",
                  .min = 1,
                  .max = 1000},
                 &S::substeps},
        Field<S>{{.name = "iterations",
                  .label = "Iterations",
                  .sentence = "Sweeps per substep: more carry a push further through a body; soft things that lie on "
                              "one another take two at least; null: the preset's",
                  .min = 1,
                  .max = 1000},
                 &S::iterations},
        Field<S>{
            {.name = "hit_substeps",
             .label = "Hit Substeps",
             .sentence = "Of method projective: parts, at most, of a substep in which something is hit so fast "
                         "that it may break: as many as let the hit's waves run from fragment to fragment, so "
                         "that it breaks as much with few substeps as with many; stiff things need more. A substep "
                         "in which edges that fade break takes as many, or none where it would take more than "
                         "this. 1: never divided; null: the preset's",
             .min = 1,
             .max = 256},
            &S::hit_substeps},
        Field<S>{{.name = "crack_passes",
                  .label = "Crack Passes",
                  .sentence = "How often in a substep a hit may break things. With 1, as in the paper, its cracks run "
                              "one ring of fragments a substep; with more it breaks nearly as much with few substeps "
                              "as with many, but what hangs together with the cracks takes the substep again each time",
                  .min = 1,
                  .max = 64},
                 &S::crack_passes},
        Field<S>{{.name = "error_budget",
                  .label = "Error Budget",
                  .sentence = "Above 0, the solver chooses substeps (1 to 64) and iterations frame by frame, so that "
                              "oscillations and the time of breaking are wrong by about this share at most (0.02: 2 %) "
                              "and quiet frames cost little; 0: as preset, substeps and iterations say",
                  .min = 0,
                  .max = 1},
                 &S::error_budget},
        Field<S>{{.name = "over_relaxation",
                  .label = "Over-Relaxation",
                  .sentence = "Of method jacobi: how far each sweep goes beyond its own answer, to arrive sooner; 1: "
                              "not at all. Odd numbers of iterations take only as much as ends near the goal (three: "
                              "1.58)",
                  .min = 0.1,
                  .max = 1.9},
                 &S::over_relaxation},
        Field<S>{{.name = "damping",
                  .label = "Damping",
                  .unit = "1/s",
                  .sentence = "Velocities die away as exp(-damping x time)",
                  .min = 0,
                  .max = 1e4},
                 &S::damping},
        Field<S>{{.name = "depenetration_speed",
                  .label = "Depenetration Speed",
                  .unit = "m/s",
                  .sentence = "Fastest at which parts that overlap already are pushed apart",
                  .min = 0,
                  .max = 1e4,
                  .min_excluded = true},
                 &S::depenetration_speed},
        Field<S>{{.name = "self_collision",
                  .label = "Self-Collision",
                  .sentence = "Particles of one body collide with one another where no edge joins them"},
                 &S::self_collision},
        Field<S>{{.name = "sleeping",
                  .label = "Sleeping",
                  .sentence = "What has not moved for half a second (looked at four times a second) is left out, and "
                              "costs nothing, until something touches it or what acts on it changes; off: everything "
                              "is simulated at all times"},
                 &S::sleeping}};
    static_assert(fields.size() + 1 == n_members<S>(), "a member that is not described is neither checked nor hashed");
    return fields;
}

std::span<const Field<StepReport>> report_fields() {
    using R = StepReport;
    static const std::array fields = {
        Field<R>{{.name = "edges_broken"}, &R::edges_broken}, Field<R>{{.name = "contacts"}, &R::contacts},
        Field<R>{{.name = "n_components"}, &R::n_components}, Field<R>{{.name = "substeps"}, &R::substeps},
        Field<R>{{.name = "iterations"}, &R::iterations},     Field<R>{{.name = "asleep"}, &R::asleep},
        Field<R>{{.name = "simulated"}, &R::simulated},       Field<R>{{.name = "cracks_J"}, &R::cracks_J},
        Field<R>{{.name = "predict_s"}, &R::predict_s},       Field<R>{{.name = "shape_s"}, &R::shape_s},
        Field<R>{{.name = "contact_s"}, &R::contact_s},       Field<R>{{.name = "momentum_s"}, &R::momentum_s},
        Field<R>{{.name = "fracture_s"}, &R::fracture_s}};
    static_assert(fields.size() == n_members<R>(), "a member that is not described is not told");
    return fields;
}

}  // namespace sunder
