// Invariants that are dear to check: looked at where the environment has SUNDER_VALIDATE, as that of the tests.
#pragma once

namespace sunder {

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
