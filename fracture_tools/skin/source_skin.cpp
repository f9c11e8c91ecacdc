#include "fracture_tools/skin/source_skin.h"

#include <algorithm>
#include <cmath>

namespace sunder {

SourceSkin::SourceSkin(std::shared_ptr<const VertexMotion> motion, const SimulationMesh& rest,
                       std::shared_ptr<const SkinBinding> intact)
    : motion_(std::move(motion)),
      rest_position_(rest.rest_position),
      transforms_(rest),
      intact_(std::move(intact)),
      n_edges_(rest.n_edges()) {
    for (const Quat& q : rest.rest_orientation) rest_orientation_.push_back(q.normalized());
}

// As the skin has the whole body where the motion has all of its fragments.
Result<std::shared_ptr<const SourceSkin::Left>> SourceSkin::left_at(double frame) {
    std::shared_ptr<const Left>& kept = left_[frame];
    if (kept) return kept;
    const Result<VertexMotion::Moment> at = motion_->moment(frame);
    if (!at) return at.error();
    const size_t n = rest_position_.size();
    const SourceWay way = at->way(motion_->center());
    auto left = std::make_shared<Left>();
    std::vector<Vec3> position;
    std::vector<Quat> orientation;
    for (uint32_t f = 0; f < n; ++f) {
        const Pose pose = way.pose(f, rest_position_[f]);
        position.push_back(pose.apply(rest_position_[f])), left->turn.push_back(pose.orientation);
        orientation.push_back((pose.orientation * rest_orientation_[f]).normalized());
    }
    const std::vector<Mat3>& set = at->begin->set;
    const std::vector<Mat3> plain(set.empty() ? n : 0, Mat3::Identity());
    const std::vector<uint8_t> intact(n_edges_, 1);
    ParticleMaps maps;
    transforms_.evaluate(position, orientation, set.empty() ? plain : set, intact, maps);
    SkinMotion skin(SkinExtras::none, intact_->n_vertices());
    skin.take(true, maps, {});
    skin.move(*intact_, run_serially);
    std::vector<Vec3> artist;
    motion_->place(*at, artist);
    left->residual.assign(artist.size(), Vec3f::Zero());
    for (size_t v = 0; v < intact_->n_vertices(); ++v) {
        const uint32_t p = intact_->pool_vertex(v);
        if (motion_->is_on_skin(p)) left->residual[p] = (artist[p] - skin.positions()[v]).cast<float>();
    }
    kept = std::move(left);
    return kept;
}

Result<bool> SourceSkin::take(const SourceMoment& moment, std::span<const Quat> orientation,
                              std::span<const Vec3> angular_velocity) {
    const size_t n = rest_position_.size();
    let_go_.resize(n), turned_.resize(n);
    bool any_follows = false;
    for (size_t f = 0; f < n; ++f) {
        if (moment.until[f] == HUGE_VAL) {
            let_go_[f] = nullptr, any_follows = true;
            continue;
        }
        const auto left = left_at(moment.until[f]);
        if (!left) return left.error();
        let_go_[f] = *left;
        const Quat turn = orientation[f].normalized() * rest_orientation_[f].conjugate();
        turned_[f] = (turn * (*left)->turn[f].conjugate()).normalized().toRotationMatrix();
    }
    spin_.assign(angular_velocity.begin(), angular_velocity.end());
    if (any_follows) {
        const Result<VertexMotion::Moment> at = motion_->moment(moment.now);
        if (!at) return at.error();
        motion_->place(*at, artist_);
        if (!spin_.empty()) motion_->velocities(*at, moment.frame_seconds, artist_velocity_);
    }
    const bool is_new = any_follows || moment.until != until_;
    until_ = moment.until;
    return is_new;
}

void SourceSkin::correct(const SkinBinding& binding, size_t chunk, std::span<const uint8_t> moved,
                         std::span<Vec3> position, std::span<Vec3> velocity) const {
    const SkinChunk& of = *binding.chunks[chunk];
    for (size_t v = 0; v < of.n_vertices(); ++v) {
        const uint32_t p = of.vertex[v].pool_vertex;
        if (!moved[v] || !motion_->is_on_skin(p)) continue;
        double following = 0;
        Vec3 shift = Vec3::Zero(), rate = shift;
        for (const auto& [j, weight] : of.influences(v)) {
            if (!let_go_[j]) {
                following += weight;
                continue;
            }
            const Vec3 carried = double{weight} * (turned_[j] * let_go_[j]->residual[p].cast<double>());
            shift += carried;
            if (!velocity.empty()) rate += spin_[j].cross(carried);
        }
        if (following > 0) shift += following * (artist_[p] - position[v]);
        position[v] += shift;
        if (velocity.empty()) continue;
        if (following > 0) rate += following * (artist_velocity_[p] - velocity[v]);
        velocity[v] += rate;
    }
}

}  // namespace sunder
