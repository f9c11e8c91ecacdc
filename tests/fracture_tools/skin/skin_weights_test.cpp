#include "fracture_tools/skin/skin_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sunder {
namespace {

constexpr double kPart = 1.0 / 16777216;  // 2^-24

// (1 - t^2)^3 of each candidate, over their sum; supports grow where the nearest is farther out than 0.75 of its own.
std::vector<double> plain_weights(const std::vector<ParticlePlace>& place, std::span<const uint32_t> candidates,
                                  const Vec3& x) {
    std::vector<double> weight;
    double nearest = 1e300, sum = 0;
    for (const uint32_t i : candidates) {
        const Vec3 d = Vec3(place[i].x, place[i].y, place[i].z) - x;
        weight.push_back(d.squaredNorm() * place[i].inv_square_support);
        nearest = std::min(nearest, weight.back());
    }
    for (double& w : weight) sum += w = std::pow(std::max(0.0, 1 - w / std::max(1.0, nearest / 0.5625)), 3);
    for (double& w : weight) w /= sum;
    return weight;
}

// Few are weighed without loops and many in them, with and without padding.
TEST(skin_weights, are_those_of_the_kernel_whatever_the_number_of_candidates) {
    std::mt19937_64 rng(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    constexpr uint32_t kParticles = 60;
    for (const double far_out : {0.0, 30.0})
        for (uint32_t n = 1; n <= 45; ++n) {
            std::vector<ParticlePlace> place;
            for (uint32_t i = 0; i < kParticles; ++i)
                place.push_back({uniform(rng), uniform(rng), uniform(rng), 0.2 + 0.1 * uniform(rng)});
            place.push_back(ParticlePlace::nowhere());
            std::vector<uint32_t> candidates;
            for (uint32_t k = 0; k < n; ++k) candidates.push_back(k + 10);
            const Vec3 x(0.3 * uniform(rng) + far_out, 0.3 * uniform(rng), 0.3 * uniform(rng));
            const std::vector<double> expected = plain_weights(place, candidates, x);
            candidates.resize((n + kWeighed - 1) / kWeighed * kWeighed, kParticles);

            WeighScratch scratch;
            std::vector<SkinInfluence> found(candidates.size());
            found.resize(weigh(place.data(), candidates, x, scratch, found.data()));
            double sum = 0, left = 1;
            auto next = found.begin();
            for (uint32_t k = 0; k < n; ++k) {
                const bool is_there = next != found.end() && next->particle == candidates[k];
                const double weight = is_there ? double{next->weight} : 0;
                EXPECT_EQ(std::fmod(weight, kPart), 0);
                // Each is rounded by half a part, and the largest takes what that leaves.
                EXPECT_NEAR(weight, expected[k], kPart * (0.5 * n + 1)) << "candidate " << k << " of " << n;
                EXPECT_TRUE(is_there || expected[k] <= kPart);
                sum += weight, left -= is_there ? expected[k] : 0, next += is_there;
            }
            EXPECT_EQ(next, found.end()) << "ascending, and nobody else";
            EXPECT_EQ(sum, 1);
            EXPECT_LT(left, n * kPart);
        }
}

}  // namespace
}  // namespace sunder
