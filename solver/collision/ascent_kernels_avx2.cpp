#define SUNDER_ASCENT_KERNELS kAscentKernelsAvx2
#include "solver/collision/ascent_kernels.inl"
