#define SUNDER_NEWTON_KERNELS kNewtonKernelsPortable
#include "solver/newton_kernels.inl"
