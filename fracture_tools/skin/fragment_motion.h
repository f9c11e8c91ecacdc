// What takes the fragments of a body along, frame after frame.
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "fracture_tools/skin/vertex_frames.h"
#include "solver/data/result.h"
#include "solver/data/source_pose.h"

namespace sunder {

/// By the vertices of an animated mesh.
class FragmentMotion {
public:
    virtual ~FragmentMotion() = default;

    const VertexFrames& frames() const { return frames_; }
    /// Of all fragments of the body; those that do not go with it may be anywhere. Kept. An error names what cannot be
    /// followed, and the frame. To be called from any thread.
    Result<std::shared_ptr<const SourcePose>> at_frame(int frame) const;
    const Vec3& center() const { return center_; }  // of mass at rest, m: the pivot of the whole

protected:
    FragmentMotion() = default;
    virtual Result<SourcePose> pose_at(size_t frame_index) const = 0;

    VertexFrames frames_;
    Vec3 center_ = Vec3::Zero();

private:
    mutable std::mutex kept_mutex_;
    mutable std::map<size_t, std::shared_ptr<const SourcePose>> kept_;  // by frame index
};

}  // namespace sunder
