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
                              std::span<const Vec3> angular_velocity, const SkinBinding& binding,
                              const RangeRunner& run) {
    const size_t n = rest_position_.size();
    let_go_.resize(n), turned_.resize(n);
    std::vector<Quat> turn(n);
    bool any_follows = false;
    for (size_t f = 0; f < n; ++f) {
        if (moment.until[f] == HUGE_VAL) {
            let_go_[f] = nullptr, any_follows = true;
            continue;
        }
        const auto left = left_at(moment.until[f]);
        if (!left) return left.error();
        let_go_[f] = *left;
        turn[f] = orientation[f].normalized() * rest_orientation_[f].conjugate();
        turned_[f] = (turn[f] * (*left)->turn[f].conjugate()).normalized().toRotationMatrix();
    }
    spin_.assign(angular_velocity.begin(), angular_velocity.end());
    frame_seconds_ = moment.frame_seconds;
    const bool was_leaving = !leaves_.empty();
    leaves_.clear(), former_.clear();
    if (moment.leaving)
        if (Status ok = take_leaving(*moment.leaving, turn, binding, run); !ok) return ok.error();
    if (any_follows) {
        const Result<VertexMotion::Moment> at = motion_->moment(moment.now);
        if (!at) return at.error();
        motion_->place(*at, artist_);
        if (!spin_.empty()) motion_->velocities(*at, moment.frame_seconds, artist_velocity_);
    }
    const bool is_new = any_follows || was_leaving || moment.leaving || moment.until != until_;
    until_ = moment.until;
    return is_new;
}

Status SourceSkin::take_leaving(const Leaving& leaving, std::span<const Quat> turn, const SkinBinding& binding,
                                const RangeRunner& run) {
    const Result<VertexMotion::Moment> at = motion_->moment(leaving.begin);
    if (!at) return at.error();
    std::vector<Vec3> artist;
    motion_->place(*at, artist);
    ParticleMaps maps;
    transforms_.evaluate(leaving.position, leaving.orientation, leaving.plastic_deformation, leaving.edge_intact, maps,
                         run);
    SkinMotion skin(SkinExtras::none, binding.n_vertices());
    skin.take(true, maps, {});
    skin.move(binding, run);
    for (size_t v = 0; v < binding.n_vertices(); ++v)
        former_.push_back(artist[binding.pool_vertex(v)] - skin.positions()[v]);
    share_ = leaving.share, leaves_ = leaving.fragments, turned_on_way_.resize(turn.size());
    for (size_t f = 0; f < turn.size(); ++f) {
        if (!leaves_[f]) continue;
        const Quat former = leaving.orientation[f].normalized() * rest_orientation_[f].conjugate();
        turned_on_way_[f] = (turn[f] * former.conjugate()).normalized().toRotationMatrix();
    }
    return {};
}

SourceSkin::Carried SourceSkin::carried(uint32_t j, uint32_t p, size_t v) const {
    Carried left = {turned_[j] * let_go_[j]->residual[p].cast<double>(), Vec3::Zero()};
    if (!leaves_.empty() && leaves_[j]) {
        const Vec3 former = turned_on_way_[j] * former_[v], change = left.shift - former;
        left = {former + share_ * change, change / frame_seconds_};
    }
    if (!spin_.empty()) left.rate += spin_[j].cross(left.shift);
    return left;
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
            const Carried left = carried(j, p, binding.first_vertex[chunk] + v);
            shift += double{weight} * left.shift, rate += double{weight} * left.rate;
        }
        if (following > 0) shift += following * (artist_[p] - position[v]);
        position[v] += shift;
        if (velocity.empty()) continue;
        if (following > 0) rate += following * (artist_velocity_[p] - velocity[v]);
        velocity[v] += rate;
    }
}

}  // namespace sunder
