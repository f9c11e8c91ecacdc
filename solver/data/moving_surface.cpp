#include "solver/data/moving_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>

#include "solver/data/frame_state.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr uint32_t kLeaf = 4;  // most triangles of a leaf

// Splits triangles by the median of their middles along the longest side, ties by their number: a total order.
class TreeBuilder {
public:
    TreeBuilder(const MeshView& mesh, SurfaceTree& io_tree)
        : mesh_(mesh), tree_(io_tree), order_(mesh.triangles.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
        for (const auto& [a, b, c] : mesh.triangles)
            middle_.push_back((mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3);
        split(0, static_cast<uint32_t>(order_.size()));
        for (const uint32_t t : order_) tree_.triangles.push_back(mesh.triangles[t]);
    }

private:
    void split(uint32_t begin, uint32_t end) {
        const size_t node = tree_.nodes.size();
        tree_.nodes.push_back({begin, end, 0});
        if (end - begin <= kLeaf) return;
        Aabb box;
        for (uint32_t k = begin; k < end; ++k) box.extend(middle_[order_[k]]);
        int axis = 0;
        (box.max - box.min).maxCoeff(&axis);
        const auto at = [&](uint32_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
        const uint32_t half = begin + (end - begin) / 2;
        std::nth_element(at(begin), at(half), at(end), [&](uint32_t s, uint32_t t) {
            return std::pair(middle_[s][axis], s) < std::pair(middle_[t][axis], t);
        });
        std::sort(at(begin), at(half)), std::sort(at(half), at(end));  // what nth_element leaves is not of one order
        split(begin, half);
        tree_.nodes[node].right = static_cast<uint32_t>(tree_.nodes.size());
        split(half, end);
    }

    const MeshView& mesh_;
    SurfaceTree& tree_;
    std::vector<uint32_t> order_;
    std::vector<Vec3> middle_;
};

void join_fans(SurfaceTree& io_tree) {
    io_tree.fan_offset.assign(io_tree.n_vertices + 1, 0);
    for (const Triangle& t : io_tree.triangles)
        for (const uint32_t v : t) ++io_tree.fan_offset[v + 1];
    std::partial_sum(io_tree.fan_offset.begin(), io_tree.fan_offset.end(), io_tree.fan_offset.begin());
    io_tree.fan.resize(3 * io_tree.triangles.size());
    std::vector<uint32_t> next(io_tree.fan_offset);
    for (uint32_t t = 0; t < io_tree.triangles.size(); ++t)
        for (const uint32_t v : io_tree.triangles[t]) io_tree.fan[next[v]++] = t;
}

Vec3 mean_of(std::span<const Vec3> points) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& p : points) sum += p;
    return sum / static_cast<double>(points.size());
}

// Horn 1987: the quaternion of the best rotation is the eigenvector of the largest eigenvalue of a matrix of the
// products' sums.
Quat best_rotation(std::span<const Vec3> from, const Vec3& from_mean, std::span<const Vec3> to, const Vec3& to_mean) {
    Mat3 S = Mat3::Zero();
    for (size_t v = 0; v < from.size(); ++v) S += (from[v] - from_mean) * (to[v] - to_mean).transpose();
    Eigen::Matrix4d N;
    N << S.trace(), S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0),   //
        0, S(0, 0) - S(1, 1) - S(2, 2), S(0, 1) + S(1, 0), S(2, 0) + S(0, 2),  //
        0, 0, S(1, 1) - S(0, 0) - S(2, 2), S(1, 2) + S(2, 1),                  //
        0, 0, 0, S(2, 2) - S(0, 0) - S(1, 1);
    N.triangularView<Eigen::StrictlyLower>() = N.transpose();
    if (!(N.cwiseAbs().maxCoeff() > 0)) return Quat::Identity();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(N);
    const Eigen::Vector4d q = eigen.eigenvectors().col(3);
    return Quat(q[0], q[1], q[2], q[3]).normalized();
}

uint64_t key_of(std::span<const Vec3> points, uint64_t tree) {
    std::vector<double> numbers = {double(tree >> 32), double(tree & 0xffffffffu)};
    for (const Vec3& p : points) numbers.insert(numbers.end(), {p.x(), p.y(), p.z()});
    return hash_of(numbers);
}

// A node comes before its children.
void fit_boxes(const SurfaceTree& tree, std::span<const Vec3> position, std::vector<Aabb>& o_boxes) {
    o_boxes.assign(tree.nodes.size(), Aabb());
    for (size_t n = tree.nodes.size(); n-- > 0;) {
        const SurfaceTree::Node& node = tree.nodes[n];
        Aabb& box = o_boxes[n];
        if (node.right == 0) {
            for (uint32_t t = node.begin; t < node.end; ++t)
                for (const uint32_t v : tree.triangles[t]) box.extend(position[v]);
            continue;
        }
        for (const size_t child : {n + 1, size_t{node.right}})
            box.extend(o_boxes[child].min), box.extend(o_boxes[child].max);
    }
}

}  // namespace

std::shared_ptr<const SurfaceTree> make_surface_tree(const MeshView& mesh, double thickness) {
    SUNDER_ASSERT(!mesh.triangles.empty() && thickness >= 0);
    auto tree = std::make_shared<SurfaceTree>();
    tree->n_vertices = mesh.positions.size(), tree->thickness = thickness;
    TreeBuilder(mesh, *tree);
    join_fans(*tree);
    std::vector<double> numbers = {thickness, double(tree->n_vertices)};
    for (const Triangle& t : tree->triangles)
        for (const uint32_t v : t) numbers.push_back(v);
    tree->key = hash_of(numbers);
    return tree;
}

MovingSurface move_surface(std::shared_ptr<const SurfaceTree> tree, std::span<const Vec3> begin,
                           std::span<const Vec3> end) {
    SUNDER_ASSERT(begin.size() == tree->n_vertices && end.size() == tree->n_vertices);
    MovingSurface s;
    s.tree = std::move(tree);
    s.begin.assign(begin.begin(), begin.end());
    s.way.assign(begin.size(), Vec3::Zero());
    s.begin_key = key_of(begin, s.tree->key), s.end_key = key_of(end, s.tree->key);
    s.pivot = mean_of(begin);
    std::vector<Vec3> last = s.begin;  // within the whole
    if (!std::equal(begin.begin(), begin.end(), end.begin())) {
        const Vec3 mean = mean_of(end);
        s.whole.orientation = best_rotation(begin, s.pivot, end, mean);
        s.whole.position = mean - s.whole.orientation * s.pivot;
        for (size_t v = 0; v < begin.size(); ++v) {
            last[v] = s.whole.inverse_apply(end[v]);
            s.way[v] = last[v] - begin[v];
            s.longest = std::max(s.longest, s.way[v].norm());
        }
    }
    fit_boxes(*s.tree, begin, s.box_begin), fit_boxes(*s.tree, last, s.box_end);
    return s;
}

}  // namespace sunder
