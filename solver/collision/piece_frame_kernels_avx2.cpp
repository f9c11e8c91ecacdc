#define SUNDER_PIECE_FRAME_KERNELS kPieceFrameKernelsAvx2
#include "solver/collision/piece_frame_kernels.inl"
