#define SUNDER_PIECE_FRAME_KERNELS kPieceFrameKernelsPortable
#include "solver/collision/piece_frame_kernels.inl"
