// What our own code takes for granted, and how it is told where that does not hold: it is our bug then.
//
// SUNDER_ASSERT is on in every build. It stands at the doors of rooms, where it costs next to nothing: indices in
// range, sizes that agree, quantities that are finite or positive. What does not hold is thrown, and ends as an error
// of the C interface (threads of a pool hand it on to their caller): the host that we are in goes on.
//
// Invariants are dear to check, and looked at where the environment has SUNDER_VALIDATE, as that of the tests.
#pragma once

namespace sunder {

/// Throws a std::logic_error that says what does not hold, and where.
[[noreturn, gnu::cold]] void fail_assertion(const char* condition, const char* file, int line);

/// Whether SUNDER_VALIDATE is set to anything but 0; read once.
bool checks_invariants();

/// Says on standard error what does not hold, and ends the program: it is our bug.
[[noreturn]] void end_as_broken(const char* what);

/// Where invariants are checked, `holds()` must be true.
template <class Holds>
void invariant(const char* what, const Holds& holds) {
    if (checks_invariants() && !holds()) end_as_broken(what);
}

}  // namespace sunder

/// Not in what is noexcept, nor in kernels: there is nobody to catch it, or it would keep lanes apart.
#define SUNDER_ASSERT(...)                                        \
    (__builtin_expect(static_cast<bool>(__VA_ARGS__), 1) ? void() \
                                                         : ::sunder::fail_assertion(#__VA_ARGS__, __FILE__, __LINE__))
