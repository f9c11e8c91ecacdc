// What takes the fragments of a body along, frame after frame.
#pragma once

#include <memory>

#include "solver/data/result.h"
#include "solver/data/source_pose.h"

namespace sunder {

class FragmentMotion {
public:
    virtual ~FragmentMotion() = default;

    /// Of all fragments of the body; those that do not go with it may be anywhere. To be called from any thread.
    virtual Result<std::shared_ptr<const SourcePose>> at_frame(int frame) const = 0;
    virtual const Vec3& center() const = 0;  // of mass at rest, m: the pivot of the whole
};

}  // namespace sunder
