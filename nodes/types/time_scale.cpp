#include "nodes/types/time_scale.h"

namespace sunder {

ParameterDescription time_scale_parameter() {
    return {
        .name = "time_scale",
        .label = "Time Scale",
        .type = ParameterType::number,
        .min = 0,
        .max = 1000,
        .default_value = 1.0,
        .sentence =
            "How fast time runs: 0.1 shows a frame in ten, 0 stands still. Its keys are in frames of the output, those "
            "of all else in simulated frames. Changes nothing of what happens: frames between simulated ones are "
            "blended",
        .animatable = true};
}

ParameterDescription accelerations_parameter() {
    return {.name = "accelerations",
            .label = "Accelerations",
            .type = ParameterType::boolean,
            .default_value = false,
            .sentence =
                "Meshes tell accelerations beside velocities, for curved motion blur. The frame after the one "
                "that is asked for is simulated for them"};
}

SceneTime scene_time(int start, double passed, double scale) {
    constexpr double kOnGrid = 1e-6;  // frames
    const double nearest = std::round(passed);
    return {start + (std::abs(passed - nearest) <= kOnGrid ? nearest : passed), scale};
}

}  // namespace sunder
