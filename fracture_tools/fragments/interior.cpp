#include "fracture_tools/fragments/interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "fracture_tools/fragments/interfaces.h"
#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// Edges a bump, so that the finer of the two octaves of the noise is seen.
constexpr double kEdgesPerBump = 4;
/// That refining makes of a square whose sides are the longest edge permitted. Measured: 6 to 7.
constexpr double kTrianglesPerSquare = 7;
/// And of a border as long as that edge, on either side of it.
constexpr double kTrianglesPerEdge = 4;
/// Triangles of break surfaces, by estimate, that a cut may grow to: 200 bytes each, measured at 245,000.
constexpr double kMostTriangles = 5e6;

/// Of all interfaces, m.
double border_length(const FragmentSet& set) {
    double sum = 0;
    std::vector<std::array<uint32_t, 2>> edges;
    for (const Interface& i : set.interfaces) {
        edges.clear();
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t)
            for (int c = 0; c < 3; ++c) {
                const auto [low, high] =
                    std::minmax(set.interface_triangles[t][c], set.interface_triangles[t][(c + 1) % 3]);
                edges.push_back({low, high});
            }
        std::sort(edges.begin(), edges.end());
        for (size_t e = 0; e < edges.size(); ++e) {
            const bool is_shared =
                (e > 0 && edges[e - 1] == edges[e]) || (e + 1 < edges.size() && edges[e + 1] == edges[e]);
            if (!is_shared) sum += (set.vertices[edges[e][0]] - set.vertices[edges[e][1]]).norm();
        }
    }
    return sum;
}

/// Refuses edges so short that the triangles would not fit into memory.
Status check_fineness(const InteriorSettings& settings, double longest, double size, const FragmentSet& set) {
    double area = 0;
    for (const Interface& i : set.interfaces) area += i.area;
    const double by_area = kTrianglesPerSquare * area / (longest * longest);
    const double by_border = kTrianglesPerEdge * border_length(set) / longest;
    const double n = by_area + by_border;
    if (n <= kMostTriangles) return {};
    const bool by_noise = settings.noise > 0 && settings.noise_scale / kEdgesPerBump * size == longest;
    const char* parameter = by_noise ? "noise_scale" : "interior_detail";
    const double given = by_noise ? settings.noise_scale : settings.detail;
    char text[200];
    std::snprintf(text, sizeof text, "%g is too fine: break surfaces would have %.1e triangles", given, n);
    Error e = bad_input(parameter, text);
    std::snprintf(text, sizeof text, "permitted for this cut: %.2g and more, or fewer pieces",
                  given * std::max(std::sqrt(2 * by_area / kMostTriangles), 2 * by_border / kMostTriangles));
    e.parameter = parameter, e.mend = text;
    return e;
}

}  // namespace

Status InteriorSettings::check(const std::string& where) const {
    auto refuse = [&](const char* parameter, const char* what) {
        Error e = bad_input(where, what);
        e.parameter = parameter;
        return e;
    };
    if (!(detail >= 0 && detail <= 10)) return refuse("interior_detail", "the interior detail must be 0 to 10");
    if (!(noise >= 0 && noise <= 0.5)) return refuse("noise", "the noise must be 0 to 0.5");
    if (!(noise_scale >= 0.05 && noise_scale <= 10))
        return refuse("noise_scale", "the noise's scale must be 0.05 to 10");
    if (!(rim_width >= 0) || !std::isfinite(rim_width))
        return refuse("rim_width", "the rim's width must be 0 m or more");
    if (!(smooth_angle >= 0 && smooth_angle <= 180))
        return refuse("interior_smooth_angle", "the smooth angle must be 0 to 180 degrees");
    return {};
}

Status shape_interior(const InteriorSettings& settings, int threads, const Progress& progress, FragmentSet& io_set) {
    io_set.interior_smooth_angle = settings.smooth_angle;
    double volume = 0;
    for (const Fragment& f : io_set.fragments) volume += f.volume;
    const double size = math::cbrt(volume / double(io_set.fragments.size()));
    double longest = settings.detail > 0 ? settings.detail * size : HUGE_VAL;
    if (settings.noise > 0) longest = std::min(longest, settings.noise_scale / kEdgesPerBump * size);
    if (longest < HUGE_VAL) {
        // Normals are those of the planes: thin triangles do not tell them.
        std::vector<Vec3> normal;
        for (const Interface& i : io_set.interfaces) normal.push_back(i.normal);
        if (Status s = check_fineness(settings, longest, size, io_set); !s) return s;
        if (Status s = refine_interfaces(longest, progress, io_set); !s) return s;
        assign_interface_uvs(io_set);
        if (settings.noise > 0) {
            if (Status s = displace_interfaces(settings.noise * size, settings.noise_scale * size, settings.noise_seed,
                                               threads, progress, io_set);
                !s)
                return s;
            measure_fragments(io_set);
        } else {
            measure_fragments(io_set);
            for (size_t i = 0; i < normal.size(); ++i) io_set.interfaces[i].normal = normal[i];
        }
    }
    mark_rim(settings.rim_width, io_set);
    return {};
}

void mark_rim(double width, FragmentSet& io_set) {
    std::vector<float> rim(io_set.vertices.size(), 0);
    std::vector<uint8_t> is_known(io_set.vertices.size(), 0);
    for (const Triangle& t : io_set.outer_triangles)
        for (uint32_t v : t) rim[v] = 1, is_known[v] = 1;
    if (width > 0 && !io_set.outer_triangles.empty()) {
        const SurfaceLookup outer(MeshView(io_set.vertices, io_set.outer_triangles));
        for (const Triangle& t : io_set.interface_triangles)
            for (uint32_t v : t) {
                if (is_known[v]) continue;
                is_known[v] = 1;
                rim[v] = float(std::max(0.0, 1 - outer.nearest(io_set.vertices[v]).distance / width));
            }
    }
    io_set.interface_corner_rim.clear();
    for (const Triangle& t : io_set.interface_triangles)
        for (uint32_t v : t) io_set.interface_corner_rim.push_back(rim[v]);
}

}  // namespace sunder
