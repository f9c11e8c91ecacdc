// Which instructions the kernels use.
#pragma once

#include <cstdlib>
#include <string_view>

namespace sunder {

enum class InstructionSet { portable, avx2 };

/// The best that this processor has, or portable where the environment says SUNDER_INSTRUCTIONS=portable. Results are
/// the same to the last bit.
inline InstructionSet instruction_set() {
#ifdef SUNDER_HAS_AVX2
    const char* wish = std::getenv("SUNDER_INSTRUCTIONS");
    if ((!wish || std::string_view(wish) != "portable") && __builtin_cpu_supports("avx2")) return InstructionSet::avx2;
#endif
    return InstructionSet::portable;
}

}  // namespace sunder
