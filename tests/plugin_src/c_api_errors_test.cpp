// What is thrown below the C interface, and what a host hears of it.
#include <gtest/gtest.h>

#include "plugin_src/c_api/handles.h"
#include "solver/data/invariant.h"
#include "solver/threads/parallel.h"

namespace sunder {
namespace {

// A bug of ours must not take the host down: neither in the thread that called, nor in one of a pool.
TEST(c_api_errors, a_failing_assertion_is_an_error_with_a_text_whatever_thread_meets_it) {
    const WorkerPool workers(4);
    const size_t n = 400;
    for (const size_t broken : {size_t{0}, size_t{123}, n - 1}) {
        c_api::Told told;
        const sunder_status status = c_api::guarded(told, [&]() -> Status {
            workers.for_each(n, [&](size_t i) { SUNDER_ASSERT(i != broken); });
            return {};
        });
        EXPECT_EQ(status, SUNDER_INTERNAL);
        EXPECT_EQ(told.status, SUNDER_INTERNAL);
        EXPECT_NE(told.error_text.find("i != broken"), std::string::npos) << told.error_text;
        EXPECT_NE(told.error_text.find("(tests/plugin_src/c_api_errors_test.cpp:"), std::string::npos);
    }
    c_api::Told told;
    EXPECT_EQ(c_api::guarded(told,
                             [&]() -> Status {
                                 SUNDER_ASSERT(n == 0);
                                 return {};
                             }),
              SUNDER_INTERNAL);
    EXPECT_NE(told.error_text.find("n == 0"), std::string::npos) << told.error_text;
    EXPECT_EQ(c_api::guarded(told,
                             [&]() -> Status {
                                 SUNDER_ASSERT(n > 0);
                                 return {};
                             }),
              SUNDER_OK);
}

}  // namespace
}  // namespace sunder
