#define SUNDER_STRETCH_KERNELS kStretchKernelsPortable
#include "solver/stretch_kernels.inl"
