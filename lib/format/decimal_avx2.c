/* Printing floats on machines with AVX2: compiled for it. */
#include "decimal_kernel.h"

const tw_decimal_kernels tw_decimal_kernels_avx2 = {find_decimals, print_row, print_vectors};
