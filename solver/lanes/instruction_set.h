// Which instructions the kernels use: they are compiled once for each of these sets (CMakeLists.txt), and which one
// runs is decided when the program does. Results are the same to the last bit.
#pragma once

#include <cstdlib>
#include <string_view>

namespace sunder {

enum class InstructionSet { portable, avx2, avx512 };

/// The best that this processor has, and no better than the environment allows: SUNDER_INSTRUCTIONS=portable or avx2.
inline InstructionSet instruction_set() {
#ifdef SUNDER_HAS_AVX
    const char* const wish = std::getenv("SUNDER_INSTRUCTIONS");
    const std::string_view most = wish ? wish : "";
    if (most == "portable" || !__builtin_cpu_supports("avx2")) return InstructionSet::portable;
    if (most == "avx2" || !__builtin_cpu_supports("avx512vl") || !__builtin_cpu_supports("avx512dq"))
        return InstructionSet::avx2;
    return InstructionSet::avx512;
#else
    return InstructionSet::portable;
#endif
}

/// Of a table of kernels the one for it, by the name that all have in common.
#ifdef SUNDER_HAS_AVX
template <class Kernels>
const Kernels& best_kernels(const Kernels& portable, const Kernels& avx2, const Kernels& avx512) {
    const InstructionSet set = instruction_set();
    return set == InstructionSet::avx512 ? avx512 : set == InstructionSet::avx2 ? avx2 : portable;
}
#define SUNDER_BEST_KERNELS(name) best_kernels(name##Portable, name##Avx2, name##Avx512)
#else
#define SUNDER_BEST_KERNELS(name) name##Portable
#endif

}  // namespace sunder
