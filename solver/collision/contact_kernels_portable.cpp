#define SUNDER_CONTACT_KERNELS kContactKernelsPortable
#include "solver/collision/contact_kernels.inl"
