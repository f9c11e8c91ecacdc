#!/bin/sh
# by_clang.sh CLANG COMPILER ARGUMENT...: CLANG in the place of CMake's compiler.
clang=$1
shift 2
exec "$clang" "$@"
