#include "nodes/graph/value.h"

namespace sunder {

Result<std::shared_ptr<const SourcePose>> FollowValue::at_frame(int frame) const {
    if (vertices) return vertices->at_frame(frame);
    return pose;
}

Vec3 FollowValue::pivot() const { return vertices ? vertices->center() : center; }

}  // namespace sunder
