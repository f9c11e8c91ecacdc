#define SUNDER_NEWTON_KERNELS kNewtonKernelsAvx2
#include "solver/newton_kernels.inl"
