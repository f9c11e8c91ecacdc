#include "fracture_tools/skin/skin_weights.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "fracture_tools/skin/vector_clones.h"

namespace sunder {
namespace {

typedef double Lanes __attribute__((vector_size(32), may_alias, aligned(8)));
typedef int32_t Parts __attribute__((vector_size(16), may_alias, aligned(4)));
typedef float Weights __attribute__((vector_size(16)));
typedef int32_t Pairs __attribute__((vector_size(32)));

// Which of four pairs have a weight, as bits, to the places in two registers from which they are taken.
struct Packing {
    alignas(32) std::array<std::array<int32_t, 8>, 16> from{};
    std::array<uint8_t, 16> count{};
};

constexpr Packing kPacking = [] {
    Packing p;
    for (uint32_t some = 0; some < 16; ++some) {
        uint32_t n = 0;
        for (int32_t k = 0; k < 4; ++k)
            if (some >> k & 1) p.from[some][2 * n] = 2 * k, p.from[some][2 * n + 1] = 2 * k + 1, ++n;
        p.count[some] = static_cast<uint8_t>(n);
    }
    return p;
}();

inline __attribute__((always_inline)) uint32_t bits_of(const Parts& some) {
#if defined(__x86_64__)
    return static_cast<uint32_t>(__builtin_ia32_movmskps(reinterpret_cast<const Weights&>(some)));
#else
    return (some[0] & 1) | (some[1] & 2) | (some[2] & 4) | (some[3] & 8);
#endif
}

// The pairs that have a weight, one behind the other.
inline __attribute__((always_inline)) void pack(const Pairs& pairs, uint32_t some, SkinInfluence* out) {
    const Pairs& from = reinterpret_cast<const Pairs&>(kPacking.from[some]);
#if defined(__clang__)  // has no shuffle by an order that the program tells
    Pairs packed{};
    for (int k = 0; k < 8; ++k) packed[k] = pairs[from[k]];
#else
    const Pairs packed = __builtin_shuffle(pairs, from);
#endif
    std::memcpy(out, &packed, sizeof packed);
}

// Of n blocks of candidates; `number` and `part` are working memory of as many.
inline __attribute__((always_inline)) size_t weigh_blocks(const ParticlePlace* place, const uint32_t* particle,
                                                          uint32_t n_blocks, const Vec3& x, Lanes* number, Parts* part,
                                                          SkinInfluence* out) {
    const auto at = [&](size_t i) -> const Lanes& { return reinterpret_cast<const Lanes&>(place[particle[i]]); };
    const Lanes x0 = Lanes{} + x.x(), x1 = Lanes{} + x.y(), x2 = Lanes{} + x.z();

    Lanes closest = Lanes{} + std::numeric_limits<double>::infinity();
#pragma GCC unroll 8
    for (uint32_t k = 0; k < n_blocks; ++k) {
        const uint32_t i = kWeighed * k;
        const Lanes a = at(i), b = at(i + 1), c = at(i + 2), d = at(i + 3);
        const Lanes ab_xz = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                    ab_yr = __builtin_shufflevector(a, b, 1, 5, 3, 7);
        const Lanes cd_xz = __builtin_shufflevector(c, d, 0, 4, 2, 6),
                    cd_yr = __builtin_shufflevector(c, d, 1, 5, 3, 7);
        const Lanes dx = __builtin_shufflevector(ab_xz, cd_xz, 0, 1, 4, 5) - x0;
        const Lanes dy = __builtin_shufflevector(ab_yr, cd_yr, 0, 1, 4, 5) - x1;
        const Lanes dz = __builtin_shufflevector(ab_xz, cd_xz, 2, 3, 6, 7) - x2;
        const Lanes t = (dx * dx + dy * dy + dz * dz) * __builtin_shufflevector(ab_yr, cd_yr, 2, 3, 6, 7);
        number[k] = t;
        closest = t < closest ? t : closest;
    }
    // Far out (a spike, a long thin piece) the supports grow with the distance, so that the nearest always has a say.
    constexpr double kFarOut = 0.75 * 0.75;
    const double least = std::min(std::min(closest[0], closest[1]), std::min(closest[2], closest[3]));
    const double shrink = least > kFarOut ? 1 / (least / kFarOut) : 1;
    Lanes sums = {};
#pragma GCC unroll 8
    for (uint32_t k = 0; k < n_blocks; ++k) {
        const Lanes left = 1 - number[k] * shrink, inside = left > 0 ? left : Lanes{};
        number[k] = inside * inside * inside;
        sums += number[k];
    }
    constexpr double kOne = 16777216;  // 2^24 parts
    constexpr float kPart = static_cast<float>(1 / kOne);
    const double scale = kOne / ((sums[0] + sums[1]) + (sums[2] + sums[3]));
    Parts left = {}, most = {}, most_at = {}, index = {0, 1, 2, 3};  // of each lane
#pragma GCC unroll 8
    for (uint32_t k = 0; k < n_blocks; ++k, index += static_cast<int32_t>(kWeighed)) {
        const Parts parts = __builtin_convertvector(number[k] * scale + 0.5, Parts), more = parts > most;
        part[k] = parts;
        left -= parts;
        most = more ? parts : most, most_at = more ? index : most_at;
    }
    // The first of the largest has what rounding left. In all lanes:
    const Parts nobody = Parts{} + std::numeric_limits<int32_t>::max();
    const auto over_lanes = [&](Parts p, const auto& of_both) {
        p = of_both(p, Parts(__builtin_shufflevector(p, p, 2, 3, 0, 1)));
        return of_both(p, Parts(__builtin_shufflevector(p, p, 1, 0, 3, 2)));
    };
    const auto lower = [](const Parts& p, const Parts& q) { return p < q ? p : q; };
    const Parts most_of_all = over_lanes(most, [](const Parts& p, const Parts& q) { return p > q ? p : q; });
    const Parts largest = over_lanes(most == most_of_all ? most_at : nobody, lower);
    const Parts rest =
        static_cast<int32_t>(kOne) + over_lanes(left, [](const Parts& p, const Parts& q) { return p + q; });

    size_t kept = 0;
    index = Parts{0, 1, 2, 3};
#pragma GCC unroll 8
    for (uint32_t k = 0; k < n_blocks;
         ++k, index += static_cast<int32_t>(kWeighed)) {  // without branches: none could be foretold
        const Parts parts = part[k] + (index == largest ? rest : Parts{});
        const Parts weight = reinterpret_cast<Parts>(__builtin_convertvector(parts, Weights) * kPart);
        const Parts which = reinterpret_cast<const Parts&>(particle[kWeighed * k]);
        const Pairs pairs = __builtin_shufflevector(which, weight, 0, 4, 1, 5, 2, 6, 3, 7);
        const uint32_t some = bits_of(parts != 0);
        pack(pairs, some, out + kept);
        kept += kPacking.count[some];
    }
    return kept;
}

// So few that what is in between stays in registers.
template <uint32_t kBlocks>
inline __attribute__((always_inline)) size_t weigh_few(const ParticlePlace* place, const uint32_t* particle,
                                                       const Vec3& x, SkinInfluence* out) {
    Lanes number[kBlocks];
    Parts part[kBlocks];
    return weigh_blocks(place, particle, kBlocks, x, number, part, out);
}

}  // namespace

SUNDER_VECTOR_CLONES size_t weigh(const ParticlePlace* place, std::span<const uint32_t> candidates, const Vec3& x,
                                  WeighScratch& io_scratch, SkinInfluence* out) {
    const uint32_t* const particle = candidates.data();
    const uint32_t n_blocks = static_cast<uint32_t>(candidates.size() / kWeighed);
    switch (n_blocks) {
        case 1:
            return weigh_few<1>(place, particle, x, out);
        case 2:
            return weigh_few<2>(place, particle, x, out);
        case 3:
            return weigh_few<3>(place, particle, x, out);
        case 4:
            return weigh_few<4>(place, particle, x, out);
        case 5:
            return weigh_few<5>(place, particle, x, out);
        default:
            break;
    }
    if (io_scratch.parts.size() < candidates.size())
        io_scratch.number.resize(candidates.size()), io_scratch.parts.resize(candidates.size());
    return weigh_blocks(place, particle, n_blocks, x, reinterpret_cast<Lanes*>(io_scratch.number.data()),
                        reinterpret_cast<Parts*>(io_scratch.parts.data()), out);
}

}  // namespace sunder
