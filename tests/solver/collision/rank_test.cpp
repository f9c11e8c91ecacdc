#include "solver/collision/rank.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace sunder {
namespace {

TEST(rank, of_equal_numbers_it_is_not_up_to_the_library_which_is_found) {
    std::vector<double> numbers = {0.0, -0.0, 1.0, -0.0, -2.0, 0.0, -0.0};  // -2, three of -0, two of 0, 1
    std::sort(numbers.begin(), numbers.end(),
              [](double a, double b) { return std::bit_cast<uint64_t>(a) < std::bit_cast<uint64_t>(b); });
    do {
        for (const size_t rank : {1, 3, 4, 5}) {
            std::vector<double> scratch = numbers;
            const double found = number_of_rank(scratch, rank);
            ASSERT_EQ(found, 0);
            ASSERT_EQ(std::signbit(found), rank <= 3) << rank;
        }
    } while (std::next_permutation(numbers.begin(), numbers.end(), [](double a, double b) {
        return std::bit_cast<uint64_t>(a) < std::bit_cast<uint64_t>(b);
    }));
}

TEST(rank, what_is_no_number_has_a_place) {
    std::vector<double> numbers(100, std::numeric_limits<double>::quiet_NaN());
    for (size_t i = 0; i < numbers.size(); i += 3) numbers[i] = static_cast<double>(i);
    EXPECT_EQ(number_of_rank(numbers, 10), 30);
    EXPECT_TRUE(std::isnan(number_of_rank(numbers, 99)));
}

}  // namespace
}  // namespace sunder
