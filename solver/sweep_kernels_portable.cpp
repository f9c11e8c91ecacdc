#define SUNDER_SWEEP_KERNELS kSweepKernelsPortable
#include "solver/sweep_kernels.inl"
