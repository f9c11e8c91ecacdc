#include "solver/data/invariant.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace sunder {

bool checks_invariants() {
    static const bool does = [] {
        const char* const set = std::getenv("SUNDER_VALIDATE");
        return set && *set && std::strcmp(set, "0") != 0;
    }();
    return does;
}

void end_as_broken(const char* what) {
    std::fprintf(stderr, "sunder: bug: it does not hold that %s\n", what);
    std::abort();
}

}  // namespace sunder
