// How the program ends: exit statuses, errors in one line, and Ctrl-C as a wish to stop.
#pragma once

#include <string>

#include "nodes/graph/graph.h"

namespace sunder::cli {

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUsage = 2, kBadInput = 3, kCancelled = 130 };

/// Prints "sunder: error: WHERE: WHAT (how to mend it)" and gives the exit status that goes with the code. `where`
/// stands in for an error that names no place.
int fail(const Error& error, const std::string& where);

/// From now on Ctrl-C (or a polite kill) asks running work to stop; a second one ends the program at once.
void watch_interrupts();
bool is_interrupted();

/// "12.3 MB".
std::string bytes_text(uint64_t bytes);
/// "1:05:09", "2:07", "8 s".
std::string duration_text(double seconds);

}  // namespace sunder::cli
