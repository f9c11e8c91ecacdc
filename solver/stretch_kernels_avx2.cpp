#define SUNDER_STRETCH_KERNELS kStretchKernelsAvx2
#include "solver/stretch_kernels.inl"
