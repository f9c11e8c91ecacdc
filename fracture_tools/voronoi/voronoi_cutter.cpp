#include "fracture_tools/voronoi/voronoi_cutter.h"

#include "fracture_tools/voronoi/cell_parts.h"
#include "fracture_tools/voronoi/interior_sampler.h"
#include "fracture_tools/voronoi/restricted_voronoi.h"

namespace sunder {
namespace {

/// Once is enough unless 53 random bits meet a degenerate position.
constexpr int kJitterAttempts = 5;

std::vector<Vec3> jittered(std::span<const Vec3> sites, double amount, uint64_t seed) {
    RandomShares random(seed);
    std::vector<Vec3> out;
    for (const Vec3& s : sites) out.push_back(s + 2 * amount * (random.in_unit_box() - Vec3::Constant(0.5)));
    return out;
}

}  // namespace

Result<CellComplex> cut_by_sites(const TriMesh& solid, std::span<const Vec3> sites, uint64_t seed, int threads,
                                 const std::string& where, std::vector<std::string>& io_warnings,
                                 const Progress& progress) {
    Aabb box;
    for (const Vec3& p : solid.positions) box.extend(p);
    for (int attempt = 0; attempt < kJitterAttempts; ++attempt) {
        const std::vector<Vec3> moved =
            jittered(sites, kSiteJitter * box.diagonal(), seed * kJitterAttempts + uint64_t(attempt));
        Result<RestrictedVoronoi> cut = restrict_voronoi(solid, moved, threads, progress);
        if (!cut) return cut.error();
        if (!cut->is_generic()) continue;
        if (cut->mismatches > 0 || cut->overlaps > 0)
            return bad_input(where,
                             cut->overlaps > 0 ? "parts of the solid overlap"
                                               : "the surface crosses itself, so that its inside is not determined",
                             "unite overlapping parts, or use method kmeans");
        if (cut->overlapping > 0)
            io_warnings.push_back(where + ": " + std::to_string(cut->overlapping) +
                                  " break surfaces have overlapping triangles, where the surface crosses itself");
        split_into_parts(cut->complex);
        return std::move(cut->complex);
    }
    return bad_input(where, "no sites in general position were found", "try another seed");
}

}  // namespace sunder
