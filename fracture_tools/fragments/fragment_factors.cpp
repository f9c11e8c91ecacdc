#include "fracture_tools/fragments/fragment_factors.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <tuple>

#include "fracture_tools/cells/kmeans.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr std::array<const char*, 4> kChannels = {"red", "green", "blue", "alpha"};

/// A number at each corner of the source, or nothing if it has no such map.
std::optional<std::vector<float>> corner_values(const TriMesh& source, const std::string& name) {
    std::vector<float> values;
    if (const auto painted = source.vertex_attributes.find(name); painted != source.vertex_attributes.end()) {
        for (const Triangle& t : source.triangles)
            for (uint32_t v : t) values.push_back(painted->second[v]);
        return values;
    }
    const auto channel = std::find(kChannels.begin(), kChannels.end(), name);
    if (channel == kChannels.end() || source.corner_colors.empty()) return std::nullopt;
    for (const Color& c : source.corner_colors) values.push_back(c[size_t(channel - kChannels.begin())]);
    return values;
}

std::string known_maps(const TriMesh& source) {
    std::string known;
    for (const auto& [name, values] : source.vertex_attributes) known += (known.empty() ? "" : ", ") + name;
    if (!source.corner_colors.empty())
        for (const char* channel : kChannels) known += (known.empty() ? "" : ", ") + std::string(channel);
    return known.empty() ? "it has no vertex attributes or colours" : "it has " + known;
}

/// What is painted on a fragment: the mean over its outer surface, or what is painted nearest to its middle.
std::vector<double> sample(const TriMesh& source, const std::vector<float>& painted, const FragmentSet& set) {
    const SurfaceLookup lookup(source);
    auto at = [&](const Vec3& p) {
        const SurfacePoint near = lookup.nearest(p);
        double value = 0;
        for (int m = 0; m < 3; ++m) value += near.barycentric[m] * painted[3 * near.triangle + m];
        return value;
    };
    std::vector<double> values;
    for (const Fragment& f : set.fragments) {
        double sum = 0, area = 0;
        for (uint32_t t = f.outer_begin; t < f.outer_end; ++t) {
            const auto& [i, j, k] = set.outer_triangles[t];
            const Vec3 &a = set.vertices[i], &b = set.vertices[j], &c = set.vertices[k];
            const double own = 0.5 * (b - a).cross(c - a).norm();
            sum += own * at((a + b + c) / 3), area += own;
        }
        values.push_back(area > 0 ? sum / area : at(f.centroid));
    }
    return values;
}

/// Neighbours of each fragment with the area shared, m2.
struct Neighbours {
    std::vector<uint32_t> offset, fragment;
    std::vector<double> area;

    explicit Neighbours(const FragmentSet& set) : offset(set.fragments.size() + 1, 0) {
        for (const Interface& i : set.interfaces) ++offset[i.a.index() + 1], ++offset[i.b.index() + 1];
        std::partial_sum(offset.begin(), offset.end(), offset.begin());
        fragment.resize(offset.back()), area.resize(offset.back());
        std::vector<uint32_t> next(offset.begin(), offset.end() - 1);
        for (const Interface& i : set.interfaces) {
            fragment[next[i.a.index()]] = i.b.value, area[next[i.a.index()]++] = i.area;
            fragment[next[i.b.index()]] = i.a.value, area[next[i.b.index()]++] = i.area;
        }
    }
};

/// Leaves each label to the largest of its parts that hang together; what else had it goes to a label around it, the
/// widest contact first. Parts of the solid that none is around become labels of their own.
void join_up(const FragmentSet& set, std::vector<uint32_t>& io_label) {
    const auto n = static_cast<uint32_t>(io_label.size());
    std::vector<uint32_t> part = disjoint_sets(n);
    for (const Interface& i : set.interfaces)
        if (io_label[i.a.index()] == io_label[i.b.index()]) unite(part, i.a.value, i.b.value);
    std::vector<double> volume(n, 0);
    for (uint32_t i = 0; i < n; ++i) volume[lowest(part, i)] += set.fragments[i].volume;
    std::vector<uint32_t> largest(n, kNone);  // part of each label; there are at most as many labels as fragments
    for (uint32_t i = 0; i < n; ++i)
        if (uint32_t& best = largest[io_label[i]]; lowest(part, i) == i && (best == kNone || volume[i] > volume[best]))
            best = i;
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t own = lowest(part, i);
        part[i] = own;
    }
    for (uint32_t i = 0; i < n; ++i)
        if (largest[io_label[i]] != part[i]) io_label[i] = kNone;

    const Neighbours around(set);
    uint32_t n_free = n;  // labels of its own for what nothing reaches
    for (;;) {
        std::tuple<double, uint32_t, uint32_t> widest{-1, kNone, kNone};  // area, fragment, its new label
        uint32_t unreached = kNone;
        for (uint32_t i = 0; i < n; ++i) {
            if (io_label[i] != kNone) continue;
            if (unreached == kNone) unreached = i;
            for (uint32_t s = around.offset[i]; s < around.offset[i + 1]; ++s)
                if (io_label[around.fragment[s]] != kNone && around.area[s] > std::get<0>(widest))
                    widest = {around.area[s], i, io_label[around.fragment[s]]};
        }
        if (unreached == kNone) return;
        if (std::get<1>(widest) == kNone)
            io_label[unreached] = n_free++;
        else
            io_label[std::get<1>(widest)] = std::get<2>(widest);
    }
}

}  // namespace

Status apply_maps(const TriMesh& source, const PaintedMaps& maps, const std::string& where, FragmentSet& io_set) {
    struct Map {
        const char* parameter;
        const std::string& name;
        double Fragment::*factor;
    };
    for (const Map& map : {Map{"toughness_map", maps.toughness, &Fragment::toughness_factor},
                           Map{"yield_map", maps.yield, &Fragment::yield_factor},
                           Map{"density_map", maps.density, &Fragment::density_factor}}) {
        if (map.name.empty()) continue;
        const auto painted = corner_values(source, map.name);
        if (!painted) {
            Error e = bad_input(where, "the mesh has no vertex attribute '" + map.name + "'", known_maps(source));
            e.parameter = map.parameter;
            return e;
        }
        const std::vector<double> values = sample(source, *painted, io_set);
        size_t n_moved = 0;
        for (size_t i = 0; i < values.size(); ++i) {
            const double factor = std::clamp(values[i], kLeastFactor, kMostFactor);
            n_moved += factor != values[i];
            io_set.fragments[i].*map.factor *= factor;
        }
        if (n_moved > 0)
            io_set.warnings.push_back(where + ": '" + map.name + "' on " + std::to_string(n_moved) +
                                      " fragments is out of 0.001 to 1000, and was moved into it");
    }
    return {};
}

void gather_clusters(int count, double toughness_factor, uint64_t seed, FragmentSet& io_set) {
    const auto n = static_cast<uint32_t>(io_set.fragments.size());
    if (count < 1 || n == 0) return;
    std::vector<Vec3> centroid;
    std::vector<double> volume;
    for (const Fragment& f : io_set.fragments) centroid.push_back(f.centroid), volume.push_back(f.volume);
    std::vector<uint32_t> label = *kmeans_clusters(centroid, volume, std::min(uint32_t(count), n), seed, 1);
    join_up(io_set, label);

    std::vector<uint32_t> number(2 * size_t{n}, kNone);  // ascending with their lowest fragment
    int32_t n_clusters = 0;
    for (uint32_t i = 0; i < n; ++i) {
        if (number[label[i]] == kNone) number[label[i]] = uint32_t(n_clusters++);
        io_set.fragments[i].cluster = int32_t(number[label[i]]);
    }
    for (Interface& i : io_set.interfaces)
        if (io_set.fragments[i.a.index()].cluster == io_set.fragments[i.b.index()].cluster)
            i.toughness_factor *= toughness_factor;
}

void leave_out_weak_interfaces(double least_share, FragmentSet& io_set) {
    std::vector<uint32_t> joined = disjoint_sets(io_set.fragments.size());
    std::vector<Interface*> weak;
    for (Interface& i : io_set.interfaces) {
        const double section = math::cbrt(io_set.fragments[i.a.index()].volume * io_set.fragments[i.b.index()].volume);
        i.joins = !(i.area < least_share * section);
        if (i.joins)
            unite(joined, i.a.value, i.b.value);
        else
            weak.push_back(&i);
    }
    std::stable_sort(weak.begin(), weak.end(),
                     [](const Interface* x, const Interface* y) { return x->area > y->area; });
    for (Interface* i : weak) {
        i->joins = lowest(joined, i->a.value) != lowest(joined, i->b.value);
        unite(joined, i->a.value, i->b.value);
    }
}

void apply_region(const std::vector<uint8_t>& inside, const RegionFactors& factors, FragmentSet& io_set) {
    for (size_t i = 0; i < io_set.fragments.size(); ++i) {
        if (!inside[i]) continue;
        io_set.fragments[i].toughness_factor *= factors.toughness;
        io_set.fragments[i].yield_factor *= factors.yield;
        io_set.fragments[i].density_factor *= factors.density;
    }
    for (Interface& i : io_set.interfaces)
        if (inside[i.a.index()] && inside[i.b.index()]) i.toughness_factor *= factors.interface_toughness;
}

}  // namespace sunder
