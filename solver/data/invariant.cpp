#include "solver/data/invariant.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace sunder {

void fail_assertion(const char* condition, const char* file, int line) {
    std::string_view from_root = file;  // but that the compiler may have been given a way from its own folder
    while (from_root.starts_with("../")) from_root.remove_prefix(3);
    throw std::logic_error("a bug of Sunder: it does not hold that " + std::string(condition) + " (" +
                           std::string(from_root) + ":" + std::to_string(line) + ")");
}

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
