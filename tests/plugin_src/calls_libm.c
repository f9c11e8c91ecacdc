/* What check_libm.py has to find: a function of libm that differs from processor to processor. */
#include <math.h>

double inexact(double x) { return sinh(x) / sqrt(x); }
