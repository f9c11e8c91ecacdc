#define SUNDER_SWEEP_KERNELS kSweepKernelsAvx2
#include "solver/sweep_kernels.inl"
