#include "fracture_tools/skin/fragment_motion.h"

namespace sunder {

Result<std::shared_ptr<const SourcePose>> FragmentMotion::at_frame(int frame) const {
    const size_t k = frames_.index_of(frame);
    const std::lock_guard lock(kept_mutex_);
    std::shared_ptr<const SourcePose>& kept = kept_[k];
    if (kept) return kept;
    Result<SourcePose> pose = pose_at(k);
    if (!pose) return pose.error();
    kept = std::make_shared<const SourcePose>(pose.take());
    return kept;
}

}  // namespace sunder
