#include "fracture_tools/voronoi/sites.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "fracture_tools/cells/kmeans.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/parallel_chunks.h"
#include "fracture_tools/mesh/point_grid.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "fracture_tools/voronoi/interior_sampler.h"
#include "fracture_tools/voronoi/middle_surface.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// Sites closer than this share of the diagonal are one: two pieces there would be parted by rounding.
constexpr double kSamePlace = 1e-5;
/// Samples of the solid for each site that is moved to the middle of its cell; measured on the bunny, 300 sites: with
/// 40 the smallest piece has 0.5 of the mean volume, more gain little. In sheets 100 make cells' areas vary by 0.13.
constexpr int kSamplesPerSite = 40, kSheetSamplesPerSite = 100;
/// Samples for each piece of a grid, by which cells that have some of the solid are counted.
constexpr size_t kGridSamples = 30;
/// Tries for each wanted site before the distance that sites keep is made smaller, by this.
constexpr int kPoissonTries = 6;
constexpr double kPoissonShrink = 0.93;
/// Tries for each site of an impact; where the solid is too far from it the rest is spread evenly.
constexpr int kImpactTries = 1000;
/// A mesh has sheets where this share of it, or of so many points, lies in ones thinner than a piece is large.
constexpr double kSheetShare = 0.1;
constexpr size_t kSheetSamples = 1000;
/// Samples for each site by which the size of its piece is known to a tenth.
constexpr size_t kSizeSamples = 10;

class SiteChooser {
public:
    SiteChooser(const TriMesh& solid, const SiteSettings& settings, int threads)
        : solid_(solid),
          settings_(settings),
          threads_(threads),
          random_(settings.seed),
          sampler_(solid),
          n_(size_t(settings.count)),
          size_(math::cbrt(mesh_volume(solid) / double(n_))) {}

    Result<std::vector<Vec3>> choose(const Progress& progress) {
        const SiteKind kind = settings_.kind;
        const bool are_even = kind == SiteKind::kmeans || kind == SiteKind::poisson;
        // Sites that an artist places stay where they are.
        const bool may_move = settings_.sheets && kind != SiteKind::points && kind != SiteKind::grid;
        if (may_move && are_even) look_for_sheets();
        Result<std::vector<Vec3>> sites = choose_kind(progress);
        if (!sites || !may_move) return sites;
        if (!are_even) return uneven_in_the_middle(sites.take());
        if (middle_)
            for (Vec3& p : *sites) p = in_the_middle(p, size_);
        return sites;
    }

private:
    Result<std::vector<Vec3>> choose_kind(const Progress& progress) {
        switch (settings_.kind) {
            case SiteKind::uniform:
                return uniform(n_);
            case SiteKind::poisson:
                return poisson();
            case SiteKind::impact:
                return impact();
            case SiteKind::grid:
                return grid();
            case SiteKind::points:
                return settings_.points;
            case SiteKind::density:
                return dense_near_group();
            case SiteKind::kmeans:
                return middles(progress);
        }
        return uniform(n_);
    }

    void look_for_sheets() {
        middle_.emplace(solid_);
        RandomShares random(~uint64_t(settings_.seed));
        size_t n_in_sheets = 0;
        double sum = 0;  // of the thicknesses' inverses
        for (size_t i = 0; i < kSheetSamples; ++i)
            if (const auto place = middle_->at(sampler_.draw(random), size_))
                ++n_in_sheets, sum += 1 / place->thickness;
        if (double(n_in_sheets) < kSheetShare * kSheetSamples) return middle_.reset();
        middle_area_ = sum / kSheetSamples * mesh_volume(solid_);
    }

    /// In the middle of the sheet where one is thinner than `size`, else where it is.
    Vec3 in_the_middle(const Vec3& p, double size) const {
        const auto place = middle_->at(p, size);
        return place ? place->position : p;
    }

    /// Sites in sheets that are thinner than their own pieces are large.
    std::vector<Vec3> uneven_in_the_middle(std::vector<Vec3> sites) {
        middle_.emplace(solid_);
        const PointGrid grid(sites);
        std::vector<uint32_t> members(sites.size(), 0);
        const std::vector<Vec3> samples = uniform(kSizeSamples * sites.size());
        for (const Vec3& p : samples) ++members[grid.nearest(p)];
        const double volume = mesh_volume(solid_) / double(samples.size());
        std::vector<Vec3> moved = sites;
        size_t n_in_sheets = 0;
        for (size_t i = 0; i < sites.size(); ++i) {
            moved[i] = in_the_middle(sites[i], math::cbrt(members[i] * volume));
            if (moved[i] != sites[i]) n_in_sheets += members[i];
        }
        return double(n_in_sheets) < kSheetShare * double(samples.size()) ? sites : moved;
    }

    std::vector<Vec3> uniform(size_t n) {
        std::vector<Vec3> sites;
        while (sites.size() < n) sites.push_back(sampler_.draw(random_));
        return sites;
    }

    /// Throws darts; the distance to keep shrinks until enough of them hit a free place.
    std::vector<Vec3> poisson() {
        std::vector<Vec3> sites;
        std::optional<PointGrid> listed;  // the first ones of them
        size_t n_listed = 0;
        double distance = std::max(size_, std::sqrt(middle_area_ / double(n_)));
        for (size_t k = 1; sites.size() < n_; ++k) {
            Vec3 p = sampler_.draw(random_);
            if (middle_) p = in_the_middle(p, size_);
            bool is_free = true;
            auto look = [&](size_t i) { is_free &= (sites[i] - p).squaredNorm() >= distance * distance; };
            if (listed) listed->visit_near(p, distance, look);
            for (size_t i = n_listed; i < sites.size() && is_free; ++i) look(i);
            if (is_free) sites.push_back(p);
            if (sites.size() > n_listed + n_listed / 16 + 32) {
                n_listed = sites.size();
                listed.emplace(sites);
            }
            if (k % (kPoissonTries * n_) == 0) distance *= kPoissonShrink;
        }
        return sites;
    }

    /// A place that is hit: one of the points, or somewhere on the curve through them.
    Vec3 place_of_impact() {
        const std::vector<Vec3>& p = settings_.points;
        if (settings_.shape == ImpactShape::points || p.size() == 1)
            return p[std::min(p.size() - 1, size_t(random_.share() * double(p.size())))];
        double length = 0;
        for (size_t i = 1; i < p.size(); ++i) length += (p[i] - p[i - 1]).norm();
        double at = random_.share() * length;
        for (size_t i = 1; i < p.size(); ++i) {
            const double l = (p[i] - p[i - 1]).norm();
            if (at <= l && l > 0) return p[i - 1] + at / l * (p[i] - p[i - 1]);
            at -= l;
        }
        return p.back();
    }

    /// A distance x (in impact radii) with density x^2 / (1 + x)^3 up to `farthest`: so many sites a volume falls off
    /// with (1 + x)^-3, the size of pieces grows with 1 + x. Its integral is ln(1 + x) + 2/(1 + x) - 1/(2 (1 + x)^2) -
    /// 3/2.
    double impact_distance(double farthest) {
        auto integral = [](double x) { return math::log1p(x) + 2 / (1 + x) - 0.5 / ((1 + x) * (1 + x)) - 1.5; };
        const double wanted = random_.share() * integral(farthest);
        double low = 0, high = farthest;
        for (int k = 0; k < 50; ++k) {
            const double middle = 0.5 * (low + high);
            (integral(middle) < wanted ? low : high) = middle;
        }
        return 0.5 * (low + high);
    }

    std::vector<Vec3> impact() {
        Aabb all = sampler_.bounds();
        for (const Vec3& p : settings_.points) all.extend(p);
        const double farthest = all.diagonal() / settings_.impact_radius;
        std::vector<Vec3> sites;
        for (size_t k = 0; k < kImpactTries * n_ && sites.size() < n_; ++k) {
            const Vec3 hit = place_of_impact();
            const double distance = settings_.impact_radius * impact_distance(farthest);
            const Vec3 p = hit + distance * random_.direction();
            if (sampler_.is_inside(p)) sites.push_back(p);
        }
        while (sites.size() < n_) sites.push_back(sampler_.draw(random_));
        return sites;
    }

    struct Grid {
        Vec3 start = Vec3::Zero();
        double cell = 1;
        std::array<int, 3> cells = {1, 1, 1};
    };
    Grid grid_of(double cell) const {
        const Aabb& box = sampler_.bounds();
        Grid g{Vec3::Zero(), cell, {}};
        for (int k = 0; k < 3; ++k) {
            const double size = box.max[k] - box.min[k];
            g.cells[k] = std::max(1, int(std::ceil(size / cell)));
            g.start[k] = 0.5 * (box.min[k] + box.max[k] - g.cells[k] * cell);
        }
        return g;
    }

    /// The grid with about the wanted number of cells that have more than crumbs of the solid.
    Grid choose_grid() {
        const std::vector<Vec3> samples = uniform(kGridSamples * n_);
        std::vector<uint64_t> cell_of(samples.size());
        auto count = [&](const Grid& g) {
            for (size_t i = 0; i < samples.size(); ++i) {
                uint64_t number = 0;
                for (int k = 0; k < 3; ++k) number = (number << 21) + uint64_t((samples[i][k] - g.start[k]) / g.cell);
                cell_of[i] = number;
            }
            std::sort(cell_of.begin(), cell_of.end());
            size_t n = 0;
            for (size_t i = 0, j; i < cell_of.size(); i = j) {
                for (j = i; j < cell_of.size() && cell_of[j] == cell_of[i];) ++j;
                n += j - i > kGridSamples / 10;
            }
            return n;
        };
        double low = 0.5 * size_, high = 2 * sampler_.bounds().diagonal();
        for (int k = 0; k < 30; ++k) {
            const double middle = std::sqrt(low * high);
            (count(grid_of(middle)) > n_ ? low : high) = middle;
        }
        const Grid fewer = grid_of(high), more = grid_of(low);
        return count(more) - n_ < n_ - count(fewer) ? more : fewer;
    }

    /// Sites of the grid that may have a share of the solid: no point of it is farther than half a grid cell's diagonal
    /// from a site, or a whole diagonal where sites are disturbed.
    std::vector<Vec3> grid() {
        const Grid g = choose_grid();
        const SurfaceLookup surface(solid_);
        std::vector<Vec3> sites;
        for (int z = 0; z < g.cells[2]; ++z)
            for (int y = 0; y < g.cells[1]; ++y)
                for (int x = 0; x < g.cells[0]; ++x) {
                    const Vec3 shift = settings_.grid_jitter * (random_.in_unit_box() - Vec3::Constant(0.5));
                    const Vec3 p = g.start + g.cell * (Vec3(x + 0.5, y + 0.5, z + 0.5) + shift);
                    if (sampler_.is_inside(p) || surface.nearest(p).distance <= std::sqrt(3.0) * g.cell)
                        sites.push_back(p);
                }
        return sites;
    }

    std::vector<Vec3> dense_near_group() {
        std::vector<double> in_group(solid_.positions.size(), 0);
        if (const auto painted = solid_.vertex_attributes.find(settings_.density_group);
            painted != solid_.vertex_attributes.end())
            for (size_t v = 0; v < std::min(in_group.size(), painted->second.size()); ++v)
                in_group[v] = std::clamp(double(painted->second[v]), 0.0, 1.0);
        else
            for (uint32_t v : solid_.vertex_groups.at(settings_.density_group)) in_group[v] = 1;
        const SurfaceLookup surface(solid_);
        std::vector<Vec3> sites;
        while (sites.size() < n_) {
            const Vec3 p = sampler_.draw(random_);
            const SurfacePoint near = surface.nearest(p);
            double share = 0;
            for (int m = 0; m < 3; ++m) share += near.barycentric[m] * in_group[solid_.triangles[near.triangle][m]];
            const double density = 1 + (settings_.density_factor - 1) * share;
            if (random_.share() * settings_.density_factor <= density) sites.push_back(p);
        }
        return sites;
    }

    Result<std::vector<Vec3>> middles(const Progress& progress) {
        std::vector<Vec3> samples = uniform((middle_ ? kSheetSamplesPerSite : kSamplesPerSite) * n_);
        const auto to_middle = [&](size_t, size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) samples[i] = in_the_middle(samples[i], size_);
        };
        if (middle_ && !for_chunks(samples.size(), 1000, threads_, progress, "finding sheets", to_middle))
            return cancelled();
        const std::vector<double> weights(samples.size(), 1);
        const Result<std::vector<uint32_t>> label =
            kmeans_clusters(samples, weights, uint32_t(n_), settings_.seed, threads_, progress);
        if (!label) return label.error();
        std::vector<Vec3> sum(n_, Vec3::Zero());
        std::vector<int> members(n_, 0);
        for (size_t i = 0; i < samples.size(); ++i) sum[(*label)[i]] += samples[i], ++members[(*label)[i]];
        std::vector<Vec3> sites;
        for (size_t c = 0; c < n_; ++c)
            if (members[c] > 0) sites.push_back(sum[c] / members[c]);
        return sites;
    }

    const TriMesh& solid_;
    const SiteSettings& settings_;
    int threads_;
    RandomShares random_;
    InteriorSampler sampler_;
    size_t n_;
    double size_;                          // cube root of a piece's mean volume, m
    std::optional<MiddleSurface> middle_;  // where there are sheets
    double middle_area_ = 0;               // of the surface in their middle, m2
};

std::vector<Vec3> leave_out_doubles(const std::vector<Vec3>& sites, double distance) {
    const PointGrid grid(sites);
    std::vector<Vec3> kept;
    for (uint32_t i = 0; i < sites.size(); ++i) {
        bool is_double = false;
        grid.visit_near(sites[i], distance, [&](uint32_t j) {
            is_double |= j < i && (sites[j] - sites[i]).squaredNorm() < distance * distance;
        });
        if (!is_double) kept.push_back(sites[i]);
    }
    return kept;
}

}  // namespace

Status SiteSettings::check(const std::string& where, const TriMesh& mesh) const {
    auto refuse = [&](const char* parameter, std::string what, std::string mend = {}) {
        Error e = bad_input(where, std::move(what), std::move(mend));
        e.parameter = parameter;
        return e;
    };
    if (count < 1) return refuse("pieces", "there must be at least one site");
    if ((kind == SiteKind::points || kind == SiteKind::impact) && points.empty())
        return refuse("points", "no points are given for the sites", "give points, or choose other sites");
    for (size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite()) return refuse("points", "point " + std::to_string(i) + " is not finite");
    if (!(impact_radius > 0) || !std::isfinite(impact_radius))
        return refuse("impact_radius", "the impact radius must be above 0 m");
    if (!(grid_jitter >= 0 && grid_jitter <= 1)) return refuse("grid_jitter", "the grid's jitter must be 0 to 1");
    if (!(density_factor >= 1 && density_factor <= 1000))
        return refuse("density_factor", "the density factor must be 1 to 1000");
    if (kind == SiteKind::density && !mesh.vertex_groups.contains(density_group) &&
        !mesh.vertex_attributes.contains(density_group)) {
        std::string known;
        for (const auto& [name, vertices] : mesh.vertex_groups) known += (known.empty() ? "" : ", ") + name;
        for (const auto& [name, values] : mesh.vertex_attributes) known += (known.empty() ? "" : ", ") + name;
        return refuse("density_group", "the mesh has no vertex group or attribute '" + density_group + "'",
                      known.empty() ? "it has none" : "it has " + known);
    }
    return {};
}

Result<std::vector<Vec3>> choose_sites(const TriMesh& solid, const SiteSettings& settings, int threads,
                                       const std::string& where, const Progress& progress) {
    if (Status s = settings.check(where, solid); !s) return s.error();
    if (!progress.report(0, "choosing sites")) return cancelled();
    SiteChooser chooser(solid, settings, threads);
    Result<std::vector<Vec3>> sites = chooser.choose(progress);
    if (!sites) return sites;
    Aabb box;
    for (const Vec3& p : solid.positions) box.extend(p);
    return leave_out_doubles(*sites, kSamePlace * box.diagonal());
}

}  // namespace sunder
