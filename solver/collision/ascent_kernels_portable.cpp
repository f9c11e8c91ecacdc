#define SUNDER_ASCENT_KERNELS kAscentKernelsPortable
#include "solver/collision/ascent_kernels.inl"
