# Toolchain of what is linked into the portable library: position independent, hidden, no contraction, optimised; the
# instructions of every x86-64, as the rest.
set(CMAKE_C_COMPILER gcc)
set(CMAKE_CXX_COMPILER g++)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(flags "-fPIC -fvisibility=hidden -ffp-contract=off")
set(CMAKE_C_FLAGS_INIT "${flags}")
set(CMAKE_CXX_FLAGS_INIT "${flags} -fvisibility-inlines-hidden")
