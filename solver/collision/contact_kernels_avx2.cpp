#define SUNDER_CONTACT_KERNELS kContactKernelsAvx2
#include "solver/collision/contact_kernels.inl"
