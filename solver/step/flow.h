// Plastic flow, and how near groups are to breaking.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/live_model.h"
#include "solver/pieces/movables.h"
#include "solver/step/breaking.h"
#include "solver/step/matching.h"
#include "solver/step/slice.h"

namespace sunder {

struct Found {
    bool changed = false, overloaded = false;  // a rest shape flowed; a group is to break
};

/// Optimal stretch of every group that takes the pass, where things came to lie; flow above the yield strain; and
/// the load towards breaking, or, where edges fade, the stretch of groups.
Found flow_and_measure(const Pass& pass, const LiveModel& model, const Movables& movables, Breaking& io_breaking,
                       std::vector<GroupGoal>& io_goals, FrameState& io_state);

/// What flow changes of a state, as it was. Of what does not yield that is its strain alone.
class BeforeFlow {
public:
    void keep(const FrameState& state);
    void give_back(FrameState& o_state) const;

private:
    bool may_flow_ = false;
    std::vector<Mat3> plastic_deformation_, plastic_curvature_;
    std::vector<LayerStrain> layer_strain_;
    std::vector<double> yield_, strain_;
    std::vector<EdgeOffsets> edge_offset_;
    std::vector<double> yielding_rate_;
};

}  // namespace sunder
