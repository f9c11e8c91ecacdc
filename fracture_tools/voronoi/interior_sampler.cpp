#include "fracture_tools/voronoi/interior_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// A solid with less than this share of its box is not found by points anywhere in that.
constexpr double kFilled = 1e-5;
/// Lines that may find no inside before a point of the surface is taken.
constexpr int kMostLines = 1000;

double volume_of(const MeshView& mesh, const Vec3& origin) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles)
        sum += (mesh.positions[a] - origin).dot((mesh.positions[b] - origin).cross(mesh.positions[c] - origin)) / 6;
    return sum;
}

}  // namespace

Vec3 RandomShares::direction() {
    const double z = 2 * share() - 1, angle = 2 * std::numbers::pi * share(), r = std::sqrt(std::max(0.0, 1 - z * z));
    const auto [sine, cosine] = math::sincos(angle);
    return {r * cosine, r * sine, z};
}

InteriorSampler::InteriorSampler(MeshView mesh) : mesh_(mesh) {
    for (const Vec3& p : mesh.positions) box_.extend(p);
    side_ = std::clamp(int(2 * std::sqrt(double(mesh.triangles.size()))), 1, 1024);
    const Vec3 size = box_.max - box_.min;
    is_sparse_ = !(volume_of(mesh, 0.5 * (box_.min + box_.max)) > kFilled * size.prod());
    auto range = [&](const Triangle& t, int axis) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (uint32_t v : t)
            low = std::min(low, mesh.positions[v][axis]), high = std::max(high, mesh.positions[v][axis]);
        auto at = [&](double x) { return std::clamp(int((x - box_.min[axis]) / size[axis] * side_), 0, side_ - 1); };
        return std::pair(at(low), at(high));
    };
    auto visit = [&](auto add) {
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto [x0, x1] = range(mesh.triangles[t], 0);
            const auto [y0, y1] = range(mesh.triangles[t], 1);
            for (int y = y0; y <= y1; ++y)
                for (int x = x0; x <= x1; ++x) add(size_t(y) * side_ + x, t);
        }
    };
    offset_.assign(size_t(side_) * side_ + 1, 0);
    visit([&](size_t c, uint32_t) { ++offset_[c + 1]; });
    std::partial_sum(offset_.begin(), offset_.end(), offset_.begin());
    triangle_.resize(offset_.back());
    std::vector<uint32_t> next(offset_.begin(), offset_.end() - 1);
    visit([&](size_t c, uint32_t t) { triangle_[next[c]++] = t; });
}

size_t InteriorSampler::column(double x, double y) const {
    auto at = [&](double v, int axis) {
        return std::clamp(int((v - box_.min[axis]) / (box_.max[axis] - box_.min[axis]) * side_), 0, side_ - 1);
    };
    return size_t(at(y, 1)) * side_ + at(x, 0);
}

template <class Visit>
void InteriorSampler::visit_crossings(const Vec3& p, Visit visit) const {
    const size_t c = column(p.x(), p.y());
    for (uint32_t s = offset_[c]; s < offset_[c + 1]; ++s) {
        const auto& [i, j, k] = mesh_.triangles[triangle_[s]];
        const Vec3 a = mesh_.positions[i] - p, b = mesh_.positions[j] - p, d = mesh_.positions[k] - p;
        // Areas that the line through p parts the projected triangle into.
        const double u = b.x() * d.y() - b.y() * d.x(), v = d.x() * a.y() - d.y() * a.x(),
                     w = a.x() * b.y() - a.y() * b.x();
        const bool up = u >= 0 && v >= 0 && w >= 0, down = u < 0 && v < 0 && w < 0;
        if ((!up && !down) || u + v + w == 0) continue;
        visit(Crossing{(u * a.z() + v * b.z() + w * d.z()) / (u + v + w), up ? 1 : -1});
    }
}

bool InteriorSampler::is_inside(const Vec3& p) const {
    if ((p.array() < box_.min.array()).any() || (p.array() > box_.max.array()).any()) return false;
    int winding = 0;
    visit_crossings(p, [&](const Crossing& c) {
        if (c.above > 0) winding += c.turn;
    });
    return winding > 0;
}

Vec3 InteriorSampler::draw(RandomShares& io_random) const {
    while (!is_sparse_) {
        const Vec3 p = box_.min + io_random.in_unit_box().cwiseProduct(box_.max - box_.min);
        if (is_inside(p)) return p;
    }
    return draw_on_line(io_random);
}

Vec3 InteriorSampler::draw_on_line(RandomShares& io_random) const {
    Vec3 p = box_.min;
    std::vector<Crossing> crossings;
    for (int line = 0; line < kMostLines; ++line) {
        const auto& [a, b, c] = mesh_.triangles[size_t(io_random.share() * double(mesh_.triangles.size()))];
        const double root = std::sqrt(io_random.share()), along = io_random.share();
        p = (1 - root) * mesh_.positions[a] + root * (1 - along) * mesh_.positions[b] +
            root * along * mesh_.positions[c];
        crossings.clear();
        visit_crossings(p, [&](const Crossing& crossing) { crossings.push_back(crossing); });
        std::sort(crossings.begin(), crossings.end(), [](const Crossing& x, const Crossing& y) {
            return std::pair(x.above, x.turn) > std::pair(y.above, y.turn);
        });
        // From above: inside as long as more sides were left than entered.
        std::vector<std::array<double, 2>> inside;
        double length = 0;
        int depth = 0;
        for (size_t k = 0; k + 1 < crossings.size(); ++k) {
            depth += crossings[k].turn;
            if (depth <= 0 || crossings[k].above == crossings[k + 1].above) continue;
            inside.push_back({crossings[k + 1].above, crossings[k].above});
            length += inside.back()[1] - inside.back()[0];
        }
        double at = io_random.share() * length;
        for (const auto& [low, high] : inside) {
            if (at < high - low) return p + (low + at) * Vec3::UnitZ();
            at -= high - low;
        }
    }
    return p;
}

}  // namespace sunder
