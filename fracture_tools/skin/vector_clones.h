// Inner loops for more than one processor in one program.
#pragma once

/// Before a function: compiled for AVX2 and for any x86-64, chosen when the program starts. Both give the same bits,
/// because a * b + c is never contracted and no sum is reordered (CMakeLists.txt): wider registers hold more vertices,
/// not other sums.
/// Not under the thread sanitizer: it watches the function that chooses, which runs before it does itself.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SUNDER_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define SUNDER_VECTOR_CLONES
#endif
